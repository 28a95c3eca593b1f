"""Voxelisation of meshes: the cells of the surface, and the cells that it encloses."""

from collections.abc import Iterator
import math

from active_recon.volumes.voxels import RESOLUTION, VoxelGrid
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import label
import trimesh

_AT_ONCE = 1 << 20  # samples: those of a mesh of long thin bars do not fit into memory at once


def voxelise(mesh: trimesh.Trimesh, resolution: int = RESOLUTION) -> VoxelGrid:
    """
    Return the voxels of a mesh, (R, R, R), over the unit cube at the origin, 0 or 1.

    A cell is occupied if the surface passes through it or encloses it. Parity along rays is not
    used, because most models are not watertight; trimesh's voxeliser is not used, because it
    samples surfaces more coarsely and differs in up to 34 of some 1,000 cells.
    """
    surface = np.zeros((resolution,) * 3, bool)
    for samples in _surface_samples(np.asarray(mesh.triangles), spacing=1 / (2 * resolution)):
        index = np.clip(np.floor((samples + 0.5) * resolution).astype(int), 0, resolution - 1)
        surface[tuple(index.T)] = True
    return VoxelGrid(_filled(surface).astype(np.float32))


def _filled(surface: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """
    Return the cells, (R, R, R), from which no way through faces leads out without a true one.

    This is what scipy's `binary_fill_holes` returns, in half of its time.
    """
    regions, _ = label(~np.pad(surface, 1))
    return np.asarray(regions[1:-1, 1:-1, 1:-1] != regions[0, 0, 0])


def _surface_samples(triangles: NDArray[np.float64],
                     spacing: float) -> Iterator[NDArray[np.float64]]:
    """Yield points on triangles, (T, 3, 3), at most `spacing` apart, (N, 3)."""
    edges = np.linalg.norm(triangles - np.roll(triangles, 1, axis=1), axis=2)
    steps = np.maximum(np.ceil(edges.max(axis=1) / spacing).astype(int), 1)
    for count in np.unique(steps):  # triangles with equally many steps are sampled together
        i, j = np.triu_indices(count + 1)
        weights = np.column_stack([i, j - i, count - j]) / count  # barycentric, (lattice, 3)
        group = triangles[steps == count]
        for some in np.array_split(group, math.ceil(len(group) * len(weights) / _AT_ONCE)):
            yield (weights @ some).reshape(-1, 3)
