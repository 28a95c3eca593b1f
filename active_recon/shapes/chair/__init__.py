"""Parametric objects of the category chair."""
