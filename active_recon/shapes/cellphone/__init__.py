"""Parametric objects of the category cellphone."""
