"""
What a candidate camera would see of the published probabilities: depth, silhouette, entropy.

A cell is occupied with its probability, whatever the other cells are. Along a line of sight that
crosses cells 1, 2, ..., cell i is in sight with the probability T_i = prod_(j < i) (1 - p_j), and
is what the line hits with w_i = T_i p_i: the volume rendering of Max 1995 with the probabilities
as opacities. The silhouette is sum w_i, the expected depth the mean of the cells' distances under
w_i / sum w_i, and the entropy in sight sum T_i h_i, h_i the entropy of cell i.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import reduce

from active_recon.policies.sight_lines import cell_lines, image_lines, SightLines
import numpy as np
from numpy.typing import NDArray

RAYS = 16
COARSE_SIDE = 16
"""Cells a side that lines are drawn through, at most."""

Images = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class CoarseVolume:
    """
    B volumes in few cells, S a side, as lines of sight cross them.

    - occupancy: (B, S, S, S), the largest of the finer cells: what hides, hides
    - entropy: (B, S, S, S), the mean of the finer cells, nats
    """

    occupancy: Images
    entropy: Images

    @property
    def side(self) -> int:
        """S, cells a side."""
        return int(self.occupancy.shape[-1])


@dataclass(frozen=True, eq=False)
class CandidateImages:
    """
    What K cameras would see of B objects, (B, K, rays, rays) each.

    - silhouette: the probability that the line of sight hits anything, [0, 1]
    - depth: the expected distance at which it does, if it does, sides of the grid; 0 where it
      surely hits nothing; depth_variance: its variance
    - entropy: of all cells in sight, each as likely as it is in sight, nats
    - unseen: the same of what no view taken had in sight; 0 where no views are given
    """

    silhouette: Images
    depth: Images
    depth_variance: Images
    entropy: Images
    unseen: Images


def coarse_volume(occupancy: Images, side: int = COARSE_SIDE) -> CoarseVolume:
    """Return volumes (B, R, R, R) in at most `side` cells a side, as many as divide R."""
    whole = occupancy.shape[-1]
    cells = next(count for count in range(min(side, whole), 0, -1) if whole % count == 0)
    entropy = np.zeros(occupancy.size, occupancy.dtype)
    doubtful = np.flatnonzero((occupancy > 0) & (occupancy < 1))
    full = occupancy.ravel().take(doubtful)
    empty = 1 - full
    entropy[doubtful] = -full * np.log(full) - empty * np.log(empty)
    block = whole // cells
    return CoarseVolume(_pooled(occupancy, block, np.maximum),
                        _pooled(entropy.reshape(occupancy.shape), block, np.add)
                        / np.float32(block ** 3))


def render_candidates(volume: CoarseVolume, candidates: NDArray[np.float64],
                      taken: NDArray[np.float64] | None = None,
                      rays: int = RAYS) -> CandidateImages:
    """
    Return what candidates would see of volumes.

    Takes poses (B, K, 4, 4), or (1, K, 4, 4) for all objects, whose lengths count in sides of the
    grid, and those of the views taken, (B, t, 4, 4).
    """
    hidden = np.zeros_like(volume.entropy) if taken is None else (
        volume.entropy * (1 - in_sight(volume, taken)))
    found = [_rendered(image_lines(poses, volume.side, rays), occupancy, entropy, unseen)
             for poses, occupancy, entropy, unseen in zip(
                 np.broadcast_to(candidates, (len(hidden), *candidates.shape[1:])),
                 volume.occupancy, volume.entropy, hidden, strict=True)]
    return CandidateImages(*np.stack(found, axis=1).reshape(
        5, len(found), -1, rays, rays))


def in_sight(volume: CoarseVolume, poses: NDArray[np.float64]) -> Images:
    """
    Return how likely each cell was in sight of the best of views, (B, S, S, S) in [0, 1].

    Takes the cameras' poses, (B, t, 4, 4). A cell hides what is behind it, but not itself.
    """
    return np.stack([
        np.max([_passing(cell_lines(pose, volume.side), occupancy) for pose in cameras], axis=0)
        for occupancy, cameras in zip(volume.occupancy, poses, strict=True)]).reshape(
            volume.occupancy.shape)


def by_place(values: Images) -> Images:
    """Return values of cells (S, S, S) by their places in the flat grid, and 0 beyond them."""
    return np.append(values, np.float32(0))


def _pooled(values: Images, block: int, join: Callable[[Images, Images], Images]) -> Images:
    """Return values (B, R, R, R) with blocks of block x block x block cells joined to one."""
    for axis in (1, 2, 3):
        along = np.moveaxis(values, axis, 0)
        values = np.moveaxis(reduce(join, (along[first::block] for first in range(block))),
                             0, axis)
    return np.ascontiguousarray(values)


def _passing(cells: NDArray[np.unsignedinteger], occupancy: Images) -> Images:
    """Return what passes all cells (C, L) of L lines, (L,)."""
    passing: Images = np.multiply.reduce((1 - by_place(occupancy)).take(cells), axis=0)
    return passing


def _rendered(lines: SightLines, occupancy: Images, entropy: Images, unseen: Images) -> Images:
    """Return silhouette, depth, its variance, entropy and unseen of L lines, (5, L)."""
    full, doubt, hidden = by_place(occupancy), by_place(entropy), by_place(unseen)
    passing = np.ones(lines.cells.shape[1], np.float32)
    hit, depth, square, seen, new = np.zeros((5, len(passing)), np.float32)
    for cells, entry in zip(lines.cells, lines.entries, strict=True):
        seen += passing * doubt[cells]
        new += passing * hidden[cells]
        here = passing * full[cells]
        passing -= here
        hit += here
        here *= entry
        depth += here
        here *= entry
        square += here
    share = 1 / np.maximum(hit, np.float32(1e-9))
    depth *= share
    return np.stack([hit, depth, np.maximum(square * share - depth * depth, 0), seen, new])
