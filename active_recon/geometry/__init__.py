"""Cameras, their lenses, and what of an image a network gets."""
