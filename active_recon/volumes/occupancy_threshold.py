"""
The threshold that suits one object: the set of cells whose expected IoU is highest.

Where occupancies are calibrated and cells err independently, the expected IoU J of a set S of
cells is about sum_S p / (|S| + sum_not-S p). Adding a cell raises it if and only if p is above
J / (1 + J): the best set is what lies above a threshold, at which J and the threshold agree.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray


def expected_iou(occupancy: ArrayLike, kept: ArrayLike) -> float:
    """
    Return about the IoU that the cells kept will have with the truth, in [0, 1].

    Takes occupancies in [0, 1] and which cells are kept, of one shape. Two empty shapes are alike:
    1.
    """
    values, inside = np.asarray(occupancy, np.float64), np.asarray(kept, np.bool_)
    union = np.count_nonzero(inside) + values[~inside].sum()
    return float(values[inside].sum() / union) if union > 0 else 1.0


def best_threshold(occupancy: NDArray[np.floating]) -> tuple[float, float]:
    """
    Return the threshold above which cells have the highest expected IoU, and that IoU.

    Takes occupancies in [0, 1] of any shape, in any order; the threshold is at most a half.
    """
    falling = np.sort(occupancy.ravel())[::-1].astype(np.float64)
    shared = falling.cumsum()
    # Adding cells that are surely empty changes no expectation, so the first maximum is taken
    expected = shared / (np.arange(1, len(falling) + 1) + (shared[-1] - shared).clip(min=0))
    if shared[-1] <= 0:
        return 0.5, 1.0
    most = min(float(expected.max()), 1.0)
    return most / (1 + most), most
