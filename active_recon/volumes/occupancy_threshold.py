"""
The threshold for one object that maximises the expected IoU.

If occupancies p are calibrated and cells are independent, the expected IoU J of a set S of cells
is about sum_S p / (|S| + sum_not-S p). Adding a cell raises it if and only if p > J / (1 + J), so
the best set is that of all cells above the threshold J / (1 + J) of its own J.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray


def expected_iou(occupancy: ArrayLike, kept: ArrayLike) -> float:
    """
    Return the approximate expected IoU of the cells `kept` with the truth, in [0, 1].

    Takes occupancies in [0, 1] and booleans, of the same shape. The IoU of two empty shapes is 1.
    """
    values, inside = np.asarray(occupancy, np.float64), np.asarray(kept, np.bool_)
    union = np.count_nonzero(inside) + values[~inside].sum()
    return float(values[inside].sum() / union) if union > 0 else 1.0


def best_threshold(occupancy: NDArray[np.floating]) -> tuple[float, float]:
    """
    Return the threshold that maximises the expected IoU of the cells above it, and that IoU.

    Takes occupancies in [0, 1] of any shape; the threshold is at most 0.5.
    """
    falling = np.sort(occupancy.ravel())[::-1].astype(np.float64)
    shared = falling.cumsum()
    # Cells of occupancy 0 do not change the expectation, so the first maximum is taken
    expected = shared / (np.arange(1, len(falling) + 1) + (shared[-1] - shared).clip(min=0))
    if shared[-1] <= 0:
        return 0.5, 1.0
    most = min(float(expected.max()), 1.0)
    return most / (1 + most), most
