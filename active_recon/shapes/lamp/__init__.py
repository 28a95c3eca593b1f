"""Parametric objects of the category lamp."""
