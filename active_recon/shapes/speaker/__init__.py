"""Parametric objects of the category speaker."""
