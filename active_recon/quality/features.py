"""A reconstruction in a few numbers, from which its quality is judged."""

from collections.abc import Sequence

from active_recon.quality.silhouettes import agreement, eroded, SeenView
from active_recon.volumes.occupancy_threshold import expected_iou
from active_recon.volumes.voxels import places
import numpy as np
from numpy.typing import NDArray

FEATURES = (
    'expected', 'doubt', 'volume', 'thinness', 'deep', 'deep_occupancy', 'shell_occupancy',
    'extent', 'border', 'iou', 'worst_iou', 'missed', 'most_missed', 'extra', 'most_extra',
    'outside', 'unsure', 'filled', 'uneven')
"""Names of the numbers of `features`."""
_EDGE = 1e-3


def features(occupancy: NDArray[np.floating], threshold: float,
             views: Sequence[SeenView]) -> NDArray[np.float64]:
    """
    Return the numbers of `FEATURES` of calibrated occupancies (R, R, R) and all views so far.

    - expected: log odds of the expected IoU of the cells above the threshold
    - doubt: log of sum p (1 - p) over the number of kept cells
    - volume: log of the share of cells kept; thinness: share of them at the surface; deep: share
      of them three cells below it, which a hollow object has not; deep_occupancy and
      shell_occupancy: mean occupancy of those and of the surface's cells; extent: of the kept
      cells' box in the cube, its longest side; border: share of them at the cube's faces
    - iou, worst_iou, missed, most_missed, extra, most_extra, outside, unsure, filled: means over
      views, and the worst, of `Agreement`; uneven: standard deviation of `filled`
    """
    values = occupancy.astype(np.float64)
    kept = values > threshold
    count = int(np.count_nonzero(kept))
    some = max(count, 1)
    below = eroded(kept)
    shell = kept & ~below
    points = (places(shell) + 0.5) / len(kept) - 0.5
    deep = eroded(eroded(below))
    box = np.ptp(points, axis=0).max() + 1 / len(kept) if count else 0.0
    inner = np.count_nonzero(kept[1:-1, 1:-1, 1:-1])
    doubt = (values * (1 - values)).sum() / (count + 1)
    found = [agreement(points, view) for view in views]
    table = np.array([[each.iou, each.missed, each.extra, each.outside, each.unsure, each.filled]
                      for each in found])
    iou, missed, extra, outside, unsure, filled = table.T
    return np.array([
        log_odds(expected_iou(values, kept)), np.log(doubt + _EDGE),
        np.log((count + 1) / kept.size), len(points) / some,
        np.count_nonzero(deep) / some, _mean(values, deep), _mean(values, shell), box,
        (count - inner) / some, iou.mean(), iou.min(), missed.mean(), missed.max(),
        extra.mean(), extra.max(), outside.mean(), unsure.mean(), filled.mean(), filled.std()])


def _mean(values: NDArray[np.float64], where: NDArray[np.bool_]) -> float:
    return float(values[where].mean()) if where.any() else 0.0


def log_odds(share: float) -> float:
    """Return the log odds of a share, which is first kept 0.001 away from 0 and 1."""
    inside = min(max(share, _EDGE), 1 - _EDGE)
    return float(np.log(inside / (1 - inside)))
