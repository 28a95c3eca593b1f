"""Parametric objects of the category watercraft."""
