"""Parametric objects of the category car."""
