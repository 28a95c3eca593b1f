"""Cells of a shape that no camera can tell, such as those in a scan without an underside."""

import math

from active_recon.volumes.voxels import VoxelGrid
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_erosion

LOWEST = math.radians(-10)
"""The lowest elevation of a camera, radians: further below is what an object stands on."""
_DIRECTIONS = 200  # twice as many hide 3 % fewer cells of shells
_STRIDE = 77  # has no divisor in common with them
_GOLDEN = math.pi * (1 + math.sqrt(5))
_QUARTERS = np.stack(np.meshgrid(*[[0.25, 0.75]] * 3), axis=-1).reshape(-1, 3)
Cells = NDArray[np.bool_]
Points = NDArray[np.floating]


def hidden_cells(occupied: Cells) -> Cells:
    """
    Return the empty cells of a shape (R, R, R) that no camera sees, (R, R, R).

    A cell is seen if from its centre a straight way in one of 200 directions, spread evenly over
    elevations from LOWEST to straight above, meets no occupied cell. So the inside of a closed box
    is hidden, and that of a box whose only opening is below, but not that of a cup. Openings of
    one or two cells can count as closed.
    """
    hidden = _walled_in(occupied)
    cells = np.argwhere(hidden)
    if not len(cells):
        return hidden
    middle, rest = len(occupied) / 2, np.arange(len(cells))
    centers = (cells.T + 0.5 - middle).astype(np.float32)
    # A surface of cells is met everywhere by rays through squares of the side of a cell, if each
    # cell has eight points
    surface = np.argwhere(occupied & ~binary_erosion(occupied))
    points = np.concatenate([(surface + part - middle).T for part in _QUARTERS], axis=1)
    points = points.astype(np.float32)
    # Neighbours in this order look from far apart, so that what is seen is known early
    for direction in sight_lines(_DIRECTIONS)[np.arange(_DIRECTIONS) * _STRIDE % _DIRECTIONS]:
        if not len(rest):
            break
        rest = rest[_behind(centers[:, rest], points, direction, len(occupied))]
    hidden[tuple(np.delete(cells, rest, axis=0).T)] = False
    return hidden


def filled(grid: VoxelGrid) -> VoxelGrid:
    """Return the true cells of a shape, 0 or 1, with 1 in those that no camera can tell, too."""
    cells = grid.occupied(0.5)
    return VoxelGrid((cells | hidden_cells(cells)).astype(np.float32), grid.size)


def sight_lines(count: int) -> Points:
    """Return unit vectors to cameras, (count, 3), spread evenly from LOWEST to straight above."""
    steps = np.arange(count) + 0.5
    height = math.sin(LOWEST) + (1 - math.sin(LOWEST)) * steps / count
    across, azimuth = np.sqrt(1 - height ** 2), _GOLDEN * steps
    return np.stack([across * np.cos(azimuth), across * np.sin(azimuth), height], axis=1)


def _walled_in(occupied: Cells) -> Cells:
    """Return the empty cells that have an occupied one above and at all four sides."""
    walled = ~occupied
    for axis, ways in ((0, (1, -1)), (1, (1, -1)), (2, (-1,))):
        for way in ways:
            along = np.flip(occupied, axis) if way < 0 else occupied
            met = np.logical_or.accumulate(along, axis=axis)
            walled &= np.flip(met, axis) if way < 0 else met
    return walled


def _behind(asked: Points, points: Points, direction: Points, side: int) -> Cells:
    """
    Return which of the asked places (3, N), in cells, lie behind any point (3, P), (N,).

    `direction`, to the camera, is not straight above.
    """
    right = np.array([-direction[1], direction[0], 0]) / math.hypot(*direction[:2])
    across = np.stack([right, np.cross(direction, right)]).astype(np.float32)
    width = math.ceil(side * math.sqrt(3)) + 2  # the grid's extent from any direction

    def pixels(places: Points) -> NDArray[np.int32]:
        column, row = np.floor(across @ places + np.float32(width / 2)).astype(np.int32)
        return np.asarray(column * np.int32(width) + row)

    asked_at, points_at = pixels(asked), pixels(points)
    wanted = np.zeros(width * width, np.bool_)
    wanted[asked_at] = True
    some = np.flatnonzero(wanted[points_at])
    nearest, away = np.full(width * width, -np.inf, np.float32), direction.astype(np.float32)
    np.maximum.at(nearest, points_at[some], away @ points[:, some])
    return np.asarray(away @ asked < nearest[asked_at])
