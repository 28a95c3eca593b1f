"""Parametric objects of the category bookshelf."""
