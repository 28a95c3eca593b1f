"""Parametric objects of the category bench."""
