"""A grid in cells half as wide, and the surface of the object in them."""

from typing import TYPE_CHECKING

from active_recon.volumes.bodies import whole_bodies
from active_recon.volumes.isosurface import without_voids
from active_recon.volumes.voxels import VoxelGrid
import numpy as np
from numpy.typing import NDArray
from scipy.special import expit, logit

if TYPE_CHECKING:
    import trimesh

_SURE = 1e-6  # of float32: nothing is nearer to 0 or 1 that has a finite logit worth comparing


def refined_mesh(grid: VoxelGrid, threshold: float) -> 'trimesh.Trimesh':
    """
    Return the surface at the threshold in cells half as wide, metres; see `isosurface`.

    Voids inside are filled, see `without_voids`, and every body of the grid is one, see
    `whole_bodies`: what is so thin that nothing would be left of it keeps the grid's own cells.
    Raises DataError where no cell of the grid is above the threshold.
    """
    threshold = float(threshold)  # numpy's would be compared in float64
    if not grid.occupied(threshold).any():
        return grid.mesh(threshold)
    whole = whole_bodies(grid, refined(grid), threshold)
    return VoxelGrid(without_voids(whole.occupancy, threshold), grid.size).mesh(threshold)


def refined(grid: VoxelGrid) -> VoxelGrid:
    """
    Return the grid in cells half as wide, (2 X, 2 Y, 2 Z), to be cut at the same threshold.

    A cell counts as occupied where the object touches it, so a grid shows the object fatter by
    half a cell on each side, and its surface interpolated to narrower cells stays as fat. What
    touches a narrow cell touches every cell of the grid's own width around it, wherever that one
    is centred. Such cells are centred anywhere in the narrow one; the logits there are
    interpolated linearly between the grid's centres, and the lowest of them is the narrow cell's:
    an erosion by a quarter of the grid's cell (Serra, Image Analysis and Mathematical Morphology,
    1982). It stands at one of the corners, since no narrow cell reaches over a centre.

    Memory and time go with the cells: 40 MB and less than half a second for 64 a side.
    """
    logits = logit(np.clip(grid.occupancy, _SURE, 1 - _SURE))
    for axis in range(3):
        logits = _at_corners(logits, axis)
    for axis in range(3):
        logits = _lower_of_neighbours(logits, axis)
    return VoxelGrid(expit(logits), grid.size)


def _at_corners(values: NDArray[np.float32], axis: int) -> NDArray[np.float32]:
    """Return values at n centres along an axis, at the 2 n + 1 ends of cells half as wide."""
    ends = np.pad(np.moveaxis(values, axis, 0), ((1, 1), (0, 0), (0, 0)), 'edge')
    found = np.empty((2 * len(ends) - 3, *ends.shape[1:]), values.dtype)
    found[1::2] = ends[1:-1]
    found[::2] = (ends[1:] + ends[:-1]) / 2
    return np.moveaxis(found, 0, axis)


def _lower_of_neighbours(values: NDArray[np.float32], axis: int) -> NDArray[np.float32]:
    along = np.moveaxis(values, axis, 0)
    return np.moveaxis(np.minimum(along[1:], along[:-1]), 0, axis)
