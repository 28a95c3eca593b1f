"""Voxel grids and meshes: measured, converted, rendered, written to disk."""
