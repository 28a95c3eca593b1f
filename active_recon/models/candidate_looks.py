"""What a view scorer is told of candidate cameras: what each looks at, and where it stands."""

from functools import lru_cache
from typing import NamedTuple

from active_recon.models.sight import Array, cells_in_sight, sampled_cells, upright_frames
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

CHANNELS, GRID, FACTS = 4, 8, 12
"""Channels and cells a side of what a candidate looks at, and numbers beside; see `look`."""
MOST_VIEWS = 6
"""The number of views from which on more are told apart no longer."""
_RAYS, _STEPS = 16, 24  # of a candidate's lines of sight
_VIEW_RAYS, _VIEW_STEPS = 24, 32  # of the views taken, which are few
_DOUBT = np.float32(0.6931472)  # entropy of p = 0.5, nats
_SETS = 4
"""Sets of candidates whose lines of sight are kept: those of a planner, and of one beside it."""


class Looks(NamedTuple):
    """
    What K candidates look at, of B objects.

    - grids: (B, K, CHANNELS, GRID, GRID, GRID); facts: (B, K, FACTS); see `candidate_grids` and
      `candidate_facts`
    - views: (B,), the number of views taken, at most MOST_VIEWS
    """

    grids: Array
    facts: Array
    views: Array


def look(occupancy: Array, entropy: Array, taken: NDArray[np.floating],
         candidates: NDArray[np.floating]) -> Looks:
    """
    Return what candidates look at, poses (B, K, 4, 4), or (1, K, 4, 4) for all objects.

    Takes volumes (B, S, S, S): occupancy in [0, 1], the largest of the finer cells, and entropy,
    the mean of the finer cells in nats; and the poses of the views taken, (B, t, 4, 4). Lengths
    of poses count in sides of the grid.
    """
    candidates = np.broadcast_to(candidates, (len(occupancy), *candidates.shape[1:]))
    grids, facts = zip(*(
        (candidate_grids(*each), candidate_facts(*each[2:]))
        for each in zip(occupancy, entropy, taken, candidates, strict=True)), strict=True)
    views = np.full(len(taken), min(taken.shape[1], MOST_VIEWS), np.float32)
    return Looks(np.stack(grids), np.stack(facts), views)


def candidate_grids(occupancy: Array, entropy: Array, taken: NDArray[np.floating],
                    candidates: NDArray[np.floating]) -> Array:
    """
    Return one volume (S, S, S) as K candidates (K, 4, 4) look at it.

    Those are grids (K, CHANNELS, GRID, GRID, GRID) along the candidates' lines of sight: from near
    to far, from top to bottom and from left to right of the image. The channels are occupancy,
    entropy, how much was out of sight of all views taken (t, 4, 4), and the entropy of that.
    """
    seen = np.max([cells_in_sight(pose, occupancy, _VIEW_RAYS, _VIEW_STEPS) for pose in taken],
                  axis=0)
    missed, doubt = 1 - seen, entropy.ravel() / _DOUBT
    # One row for each cell, so that a sample fetches all of it at once
    cells = np.stack([occupancy.ravel(), doubt, missed, doubt * missed], axis=1)
    means = _means(np.ascontiguousarray(candidates, np.float32).tobytes(), len(occupancy))
    grids = (means @ cells).reshape(len(candidates), -1, CHANNELS)
    return np.ascontiguousarray(grids.transpose(0, 2, 1)).reshape(
        -1, CHANNELS, GRID, GRID, GRID)


@lru_cache(maxsize=_SETS)
def _means(poses: bytes, side: int) -> csr_array:
    """
    Return what makes candidates' grids of cells, (K GRID ** 3, side ** 3).

    A row is the mean of the samples in one cell of a grid; samples outside the volume are 0.
    """
    frames = upright_frames(np.frombuffer(poses, np.float32).reshape(-1, 4, 4))
    deep, wide = _STEPS // GRID, _RAYS // GRID
    samples = sampled_cells(frames, side, _RAYS, _STEPS).reshape(
        -1, GRID, deep, GRID, wide, GRID, wide)
    samples = samples.transpose(0, 1, 3, 5, 2, 4, 6).reshape(-1, deep * wide * wide)
    inside = samples < side ** 3
    ends = np.concatenate([[0], np.cumsum(inside.sum(axis=1))]).astype(np.int32)
    columns = samples[inside]
    shares = np.full(len(columns), 1 / samples.shape[1], np.float32)
    return csr_array((shares, columns, ends), (len(samples), side ** 3))


def candidate_facts(taken: NDArray[np.floating], candidates: NDArray[np.floating]) -> Array:
    """
    Return numbers on K candidates' places among the views taken, (K, FACTS).

    Of the angles at the centre to the t views: cosine and sine of the smallest, cosine of the
    largest, mean cosine, largest cosine to the point opposite of a view, its mean square; the
    candidate's sine of elevation and its difference to the views' mean; the number of views
    (1, 2, 3, 4 or more), one by one.
    """
    towards, known = (poses[:, :3, 3] / np.linalg.norm(poses[:, :3, 3], axis=1, keepdims=True)
                      for poses in (candidates, taken))
    cosines = (towards @ known.T).clip(-1, 1)
    nearest = cosines.max(axis=1)
    height = towards[:, 2]
    count = np.zeros((len(towards), 4))
    count[:, min(len(taken), 4) - 1] = 1
    return np.concatenate([np.stack([
        nearest, np.sqrt(1 - nearest ** 2), cosines.min(axis=1), cosines.mean(axis=1),
        (-cosines).max(axis=1), (cosines ** 2).mean(axis=1),
        height, height - known[:, 2].mean()], axis=1), count], axis=1, dtype=np.float32)
