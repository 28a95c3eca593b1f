"""The surface of a grid of occupancies, closed and with its outside on one side everywhere."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import trimesh

_CLEARANCE = 1e-3
"""What every cell keeps from the threshold: the surface never runs through a cell's centre."""


def isosurface(occupancy: NDArray[np.float32], threshold: float,
               size: float = 1.0) -> 'trimesh.Trimesh':
    """
    Return the surface at a threshold, metres, of (X, Y, Z) in a cube of that side about 0.

    It is a closed manifold, oriented outwards, at the border of the cube too: every edge belongs
    to two faces. For that, cells nearer to the threshold than 0.001 are taken as just that near,
    which moves the surface by a thousandth of a cell at most, and the cases of marching cubes are
    the classical ones, which treat a face between two cubes alike from both of its sides
    (Lorensen 1987, with the consistent table of scikit-image). Needs one cell above the
    threshold.
    """
    from skimage.measure import marching_cubes  # slow to import, and only meshes need them
    import trimesh

    occupied = np.argwhere(occupancy > threshold)
    low = occupied.min(axis=0)
    box = tuple(map(slice, low, occupied.max(axis=0) + 1))
    # A margin of the neighbours, of empty cells at the border, closes the surface
    wide = np.pad(occupancy, 1)[tuple(slice(cut.start, cut.stop + 2) for cut in box)]
    clear = np.where(wide > threshold, np.maximum(wide, threshold + _CLEARANCE),
                     np.minimum(wide, threshold - _CLEARANCE))
    vertices, faces, _, _ = marching_cubes(  # type: ignore[no-untyped-call]
        clear, threshold, method='lorensen', gradient_direction='ascent')
    # Sample (i, j, k) of the margined box is the centre of cell low + (i - 1, j - 1, k - 1)
    placed = (vertices + low - 0.5) * (size / len(occupancy)) - size / 2
    return trimesh.Trimesh(placed, faces, process=False)


def without_voids(occupancy: NDArray[np.float32], threshold: float) -> NDArray[np.float32]:
    """
    Return occupancies (X, Y, Z) with 1 in the empty cells that no way of faces joins to outside.

    No camera sees into them, and the networks are trained on shapes without any.
    """
    from scipy.ndimage import label

    parts, count = label(np.pad(occupancy <= threshold, 1, constant_values=True))
    if count == 1:
        return occupancy
    outside = parts[0, 0, 0]
    inside = ((parts != outside) & (parts != 0))[1:-1, 1:-1, 1:-1]
    return np.where(inside, np.float32(1), occupancy)
