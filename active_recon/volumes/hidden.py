"""Cells of a shape that no camera can tell, such as those in a scan without an underside."""

import math

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_erosion

LOWEST = math.radians(-10)
"""The lowest elevation of a camera: from below, an object stands on something."""
_DIRECTIONS = 200  # twice as many hide 3 % fewer cells of shells
_GOLDEN = math.pi * (1 + math.sqrt(5))
_QUARTERS = np.stack(np.meshgrid(*[[0.25, 0.75]] * 3), axis=-1).reshape(-1, 3)
Cells = NDArray[np.bool_]
Points = NDArray[np.float64]


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
    centers, rest = cells.astype(np.float64) + 0.5, np.arange(len(cells))
    # A surface of cells is met everywhere by rays through squares of the side of a cell, if each
    # cell has eight points
    surface = np.argwhere(occupied & ~binary_erosion(occupied))
    points = (surface[:, None] + _QUARTERS).reshape(-1, 3)
    for direction in sight_lines(_DIRECTIONS):
        rest = rest[_behind(centers[rest], points, _axes_of(direction), len(occupied))]
    hidden[tuple(np.delete(cells, rest, axis=0).T)] = False
    return hidden


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


def _axes_of(direction: Points) -> Points:
    """Return two unit vectors across a direction that is not straight above, and it, (3, 3)."""
    right = np.array([-direction[1], direction[0], 0]) / math.hypot(*direction[:2])
    return np.stack([right, np.cross(direction, right), direction])


def _behind(asked: Points, points: Points, axes: Points, side: int) -> Cells:
    """Return which of the asked places (N, 3), in cells, lie behind any point (P, 3), (N,)."""
    reach = math.ceil(side * math.sqrt(3)) + 2  # the grid's extent from any direction

    def placed(places: Points) -> tuple[NDArray[np.intp], Points]:
        across, up, depth = axes @ (places - side / 2).T
        return (np.floor(across + reach / 2).astype(np.intp) * reach
                + np.floor(up + reach / 2).astype(np.intp)), depth

    nearest = np.full(reach * reach, -np.inf)
    np.maximum.at(nearest, *placed(points))
    pixel, depth = placed(asked)
    return np.asarray(depth < nearest[pixel])
