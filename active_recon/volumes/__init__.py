"""Voxel grids and meshes: measures, conversion, rendering and files."""
