"""Parametric objects of the category sofa."""
