"""Cameras and lenses, and the cropping and warping of images for a network."""
