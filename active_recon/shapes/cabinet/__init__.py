"""Parametric objects of the category cabinet."""
