"""True shapes that are hollow: their inside is empty, and hardly any view can tell."""

import numpy as np
from numpy.typing import NDArray

HOLLOW = 0.2
"""The share of enclosed cells that are empty above which an object counts as hollow."""
_SIDES = 5


def hollow_share(truth: NDArray[np.bool_]) -> float:
    """
    Return the share of the cells in or enclosed by a shape (R, R, R) that are empty, in [0, 1].

    A cell is enclosed if the shape lies in its way to at least five of the six sides of the grid.
    A closed solid has 0; a model of open sheets, such as a scan without an underside, has more.
    """
    walls = np.zeros(truth.shape, np.int8)
    for axis in range(3):
        walls += np.logical_or.accumulate(truth, axis=axis)
        walls += np.flip(np.logical_or.accumulate(np.flip(truth, axis), axis=axis), axis)
    empty = int(np.count_nonzero(~truth & (walls >= _SIDES)))
    return empty / max(empty + int(np.count_nonzero(truth)), 1)
