"""Meshes to voxels: the cells of the surface, and the cells that it encloses."""

from collections.abc import Iterator
import math

from active_recon.volumes.voxels import RESOLUTION, VoxelGrid
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_fill_holes
import trimesh

_AT_ONCE = 1 << 20  # samples: a mesh of long thin bars has more than the memory holds


def voxelise(mesh: trimesh.Trimesh, resolution: int = RESOLUTION) -> VoxelGrid:
    """
    Return the solid of a mesh that is fitted to the grid (inside the unit cube at the origin).

    A cell is occupied where the surface passes through it or where it is enclosed. Parity along
    rays is not used, because most models are not watertight. trimesh's voxeliser samples surfaces
    more coarsely: it differs by up to 34 of some 1,000 cells.
    """
    surface = np.zeros((resolution,) * 3, bool)
    for samples in _surface_samples(np.asarray(mesh.triangles), spacing=1 / (2 * resolution)):
        index = np.clip(np.floor((samples + 0.5) * resolution).astype(int), 0, resolution - 1)
        surface[tuple(index.T)] = True
    return VoxelGrid(binary_fill_holes(surface).astype(np.float32))


def _surface_samples(triangles: NDArray[np.float64],
                     spacing: float) -> Iterator[NDArray[np.float64]]:
    """Yield points on triangles, (T, 3, 3), at most `spacing` apart, (N, 3)."""
    edges = np.linalg.norm(triangles - np.roll(triangles, 1, axis=1), axis=2)
    steps = np.maximum(np.ceil(edges.max(axis=1) / spacing).astype(int), 1)
    for count in np.unique(steps):  # triangles with as many steps are sampled together
        i, j = np.triu_indices(count + 1)
        weights = np.column_stack([i, j - i, count - j]) / count  # barycentric, (lattice, 3)
        group = triangles[steps == count]
        for some in np.array_split(group, math.ceil(len(group) * len(weights) / _AT_ONCE)):
            yield (weights @ some).reshape(-1, 3)
