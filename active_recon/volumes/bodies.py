"""The bodies of a grid in narrower cells: what hangs together in its own cells does so in them."""

from typing import Any

from active_recon.volumes.voxels import VoxelGrid
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation, find_objects, label

_AROUND = np.ones((3, 3, 3), np.bool_)
_SPECK = 1e-3
"""Share of the largest body's cells below which a body is noise."""
_SPLIT = np.array([label(np.unpackbits(np.uint8(cells)).reshape(2, 2, 2))[1] > 1
                   for cells in range(256)])
"""Whether some of the eight cells around a corner, one a bit, are not joined by faces there."""


def whole_bodies(grid: VoxelGrid, narrow: VoxelGrid, threshold: float) -> VoxelGrid:
    """
    Return a grid refined from another so that none of its bodies is torn.

    `narrow` has twice the cells of `grid` and is below it everywhere, see `refined`. A body of
    the grid (cells joined by faces, edges or corners) has the largest of its bodies in narrow
    cells (joined by faces), without the crumbs beside it. Where that is not within a cell of a
    part of the grid's body, the part keeps the grid's own cells; where those meet at an edge or a
    corner only, the narrow cells around it join them. Bodies of less than a thousandth of the
    largest one's cells are left out.
    """
    occupied = grid.occupied(threshold)
    bodies = _halved(label(occupied, _AROUND)[0])
    kept = _largest_of_each(narrow.occupied(threshold), bodies)
    lost = occupied & ~binary_dilation(_pooled(kept), _AROUND)
    occupancy = narrow.occupancy
    if lost.any():
        # Its neighbours too: they are where it hangs on to what is left
        own = np.where(occupied & binary_dilation(lost, _AROUND, iterations=2), grid.occupancy,
                       np.float32(0))
        cells = _halved(own)
        cells = np.where(cells > 0, cells, _necks(own))
        occupancy = np.where(cells > 0, cells, occupancy)
        kept = _largest_of_each(occupancy > threshold, bodies)
    below = np.minimum(occupancy, np.float32(threshold))
    return VoxelGrid(np.where(kept, occupancy, below), grid.size)


def _largest_of_each(cells: NDArray[np.bool_], bodies: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Return the cells of the largest part of each body, but for specks; 0 is no body."""
    parts, count = label(cells)
    sizes = np.bincount(parts.ravel(), minlength=count + 1)
    sizes[0] = 0
    body = np.zeros(count + 1, np.intp)
    for part, box in enumerate(find_objects(parts), 1):
        body[part] = bodies[box][parts[box] == part].max()  # necks are in none
    by_size = np.argsort(sizes, kind='stable')[::-1]
    _, first = np.unique(body[by_size], return_index=True)
    largest = np.zeros(count + 1, np.bool_)
    largest[by_size[first]] = True
    return np.asarray((largest & (sizes > _SPECK * sizes.max()))[parts])


def _necks(cells: NDArray[np.float32]) -> NDArray[np.float32]:
    """
    Return values for the narrow cells around the corners at which cells meet without a face.

    Each has the highest of the cells (X, Y, Z) around its corner, all others 0, as empty cells.
    """
    wide, (x, y, z) = np.pad(cells, 1), (side + 1 for side in cells.shape)
    around = np.stack([wide[i:i + x, j:j + y, k:k + z]
                       for i in (0, 1) for j in (0, 1) for k in (0, 1)])
    split = _SPLIT[np.packbits(around > 0, axis=0)[0]]
    return _halved(np.where(split, around.max(axis=0), np.float32(0)))[1:-1, 1:-1, 1:-1]


def _pooled(cells: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which 2 x 2 x 2 blocks have a cell, (X, Y, Z) of (2 X, 2 Y, 2 Z)."""
    x, y, z = (side // 2 for side in cells.shape)
    return np.asarray(cells.reshape(x, 2, y, 2, z, 2).any(axis=(1, 3, 5)))


def _halved(values: NDArray[Any]) -> NDArray[Any]:
    """Return values in cells half as wide."""
    return values.repeat(2, 0).repeat(2, 1).repeat(2, 2)
