"""Parametric objects of the category firearm."""
