"""Parametric objects of the category motorbike."""
