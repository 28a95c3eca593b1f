"""Parametric objects of the category airplane."""
