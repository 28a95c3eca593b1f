"""Parametric objects of the category monitor."""
