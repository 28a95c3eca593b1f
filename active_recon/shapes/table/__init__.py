"""Parametric objects of the category table."""
