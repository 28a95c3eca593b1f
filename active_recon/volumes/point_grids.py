"""From a cloud of points back to its voxel grid."""

from active_recon.errors import DataError
from active_recon.volumes.voxels import RESOLUTION, VoxelGrid
import numpy as np
from numpy.typing import NDArray

_MOST_CELLS = 256  # a side
# Centres of cells of different powers of two never coincide: where one fits, no other does
_RESOLUTIONS = sorted(range(1, _MOST_CELLS + 1), key=lambda side: (side & (side - 1) > 0, side))
_FEW = 300  # points tested before all of them
_TELLING = 8  # this many cells of an object are never all a multiple of 3 apart by chance
_OFF_CENTRE = 1e-3  # in cells: above float32's rounding, below the differences between grids


def grid_from_points(points: NDArray[np.float32], size: float = 1.0,
                     resolution: int = RESOLUTION) -> VoxelGrid:
    """
    Return the grid of points (N, 4): x, y, z, occupancy; the inverse of `VoxelGrid.points`.

    Its resolution is the smallest with every point at the centre of a cell, powers of two first;
    `resolution` is used where there are no points. Raises DataError of the kind 'cloud' where
    points are outside of the cube of `size` metres, are not at the centres of one grid's cells,
    only at every third, fifth ... of them, share a cell, or have an occupancy outside of [0, 1].
    """
    if not len(points):
        return VoxelGrid(np.zeros((resolution,) * 3, np.float32), size)
    columns = np.ascontiguousarray(points.T)
    with np.errstate(invalid='ignore', over='ignore'):  # values that are not finite: see below
        shares, values = columns[:3] / size + np.float32(0.5), columns[3]
    if not (shares.min() >= 0 and shares.max() < 1):  # also where a coordinate is NaN
        raise DataError(f'point out of the cube: expected all inside a cube of {size} m about the '
                        'origin', 'cloud')
    if not (values.min() >= 0 and values.max() <= 1):
        raise DataError(f'invalid occupancy: expected values in [0, 1], got {values.min()} '
                        f'to {values.max()}', 'cloud')
    side = _cells_a_side(shares)
    if side is None:
        raise DataError('points between cell centres: expected them at the centres of at '
                        f'most {_MOST_CELLS} cells a side of a cube of {size} m, got '
                        f'{len(points)} elsewhere', 'cloud')
    index = (shares * side).astype(np.int32)
    if (spacing := _spacing(index)) > 1:
        raise DataError('points of a cube of another size: expected the cells of a cube of '
                        f'{size} m beside each other, got {len(points)} that are {spacing} of '
                        f'{side} a side apart', 'cloud')
    x, y, z = index
    cells = (x * side + y) * side + z
    # In the order of the cells, as they are published, no two can be the same
    if not (cells[1:] > cells[:-1]).all() and (count := len(np.unique(cells))) < len(points):
        raise DataError(f'several points in a cell: expected one point a cell, got {len(points)} '
                        f'in {count} cells of {side} a side', 'cloud')
    occupancy = np.zeros(side ** 3, np.float32)
    occupancy[cells] = values
    return VoxelGrid(occupancy.reshape((side,) * 3), size)


def _cells_a_side(shares: NDArray[np.floating]) -> int | None:
    """Return the resolution whose cell centres points (3, N) in [0, 1) are, None if none is."""
    def fit(shares: NDArray[np.floating], side: int) -> bool:
        places = shares * side
        return bool(np.abs(places - np.floor(places) - 0.5).max() <= _OFF_CENTRE)

    return next((side for side in _RESOLUTIONS
                 if fit(shares[:, :_FEW], side) and fit(shares, side)), None)


def _spacing(index: NDArray[np.int32]) -> int:
    """
    Return the spacing of points (3, N) in cells where it is that of a coarser grid, else 1.

    Grids with the same centre share cell centres only if one is an odd number of times finer.
    """
    if index.shape[1] < _TELLING:
        return 1
    for points in (index[:, :_FEW], index):
        spacing = int(np.gcd.reduce(np.abs(points - index[:, :1]), axis=None))
        if spacing % 2 == 0 or spacing == 1:
            return 1
    return spacing
