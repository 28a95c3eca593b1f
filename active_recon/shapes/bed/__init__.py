"""Parametric objects of the category bed."""
