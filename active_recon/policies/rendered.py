"""
Policies that look at the probabilities: how much doubt a candidate would have in sight.

None of them is learned. Each sums doubt over the lines of sight of a small image of the candidate,
as far as probably nothing hides it.
"""

from collections.abc import Callable
import math

from active_recon.policies.base import Choice, distance_to_taken, is_fresh, Observation
from active_recon.policies.candidate_rendering import (
    by_place,
    coarse_volume,
    CoarseVolume,
    RAYS,
    render_candidates,
)
from active_recon.policies.sight_lines import image_lines, SightLines
from active_recon.runtimes import State
import numpy as np
from numpy.typing import NDArray

Scores = NDArray[np.float32]

_DOUBT, _HIDING, _OUTLINE, _BASE = 6, 4, 2, 1  # exponents and lambda of Smith et al.
_APART, _SHARE, _ROUNDING = math.radians(60), 0.75, 1e-4
_LESS = np.float32(1e-6)


class RenderedPolicy:
    """
    Goes where most is to be seen of what is not known, apart from where it has been.

    `worth` returns how much that is of each candidate, (B, K), 0 or more. Candidates within 60
    degrees of a view taken come after all others; where every one in reach is, those less than
    three quarters as far from the views as the farthest of them. Views taken come last. Smith et
    al. leave out candidates within 63 degrees, or less where too few are left. Without such a rule
    the policies here were no better than random: doubt inside an object looks the same after every
    view.
    """

    wants_volume = True

    def __init__(self, worth: Callable[[Observation, CoarseVolume], Scores]) -> None:
        self._worth = worth

    def initial_state(self, batch: int) -> State:
        """Return no state."""
        return {}

    def choose(self, seen: Observation, state: State) -> tuple[Choice, State]:
        """Choose the candidate of the greatest worth; see Policy."""
        assert seen.occupancy is not None
        worth = self._worth(seen, coarse_volume(seen.occupancy))
        gaps = distance_to_taken(seen)
        in_reach = gaps if seen.reachable is None else gaps[:, seen.reachable]
        enough = np.minimum(_APART, _SHARE * in_reach.max(axis=1, keepdims=True, initial=0))
        rank = (gaps < enough - _ROUNDING).astype(np.float32) + ~is_fresh(seen)
        return Choice(worth - rank * (worth.max(axis=1, keepdims=True) + _LESS)), state


def visible_entropy(seen: Observation, volume: CoarseVolume) -> Scores:
    """
    Return the entropy in sight of each candidate, nats a line of sight.

    It is the occlusion-aware volumetric information of Isler et al. 2016 (rpg_ig), section III,
    on the network's probabilities.
    """
    return np.asarray(render_candidates(volume, seen.candidates).entropy.mean(axis=(2, 3)))


def unseen_entropy(seen: Observation, volume: CoarseVolume) -> Scores:
    """
    Return the entropy in sight that no view taken had in sight, nats a line of sight.

    It is the unobserved-voxel information of Isler et al. 2016, each cell as much unobserved as it
    probably was hidden from all views.
    """
    images = render_candidates(volume, seen.candidates, seen.taken)
    return np.asarray(images.unseen.mean(axis=(2, 3)))


def rendered_uncertainty(seen: Observation, volume: CoarseVolume) -> Scores:
    """
    Return the uncertainty of silhouette and depth that each candidate would show.

    Smith et al. 2022 (Uncertainty-Driven Active Vision for Implicit Scene Reconstruction, arXiv
    2210.00978), with the exponents that they publish and without their directional derivative:
    the mean over lines of sight of (1 + U_silhouette) U_depth. U_silhouette is 1 - |2 s - 1|^2 of
    a silhouette s; U_depth = sum_i T_i u_i d_i^2, with u_i = 1 - |2 p_i - 1|^6, distances d_i in
    units of the farthest, and T_i what passes the cells before, each of which holds back
    max(0, 2 p - 1)^4. The sum is over cells crossed instead of points.
    """
    return np.stack([
        _uncertainty(image_lines(poses, volume.side, RAYS), occupancy).reshape(
            len(poses), -1).mean(axis=1)
        for poses, occupancy in zip(
            np.broadcast_to(seen.candidates, (len(volume.occupancy),
                                              *seen.candidates.shape[1:])),
            volume.occupancy, strict=True)])


def _uncertainty(lines: SightLines, occupancy: Scores) -> Scores:
    """Return the uncertainty of each of L lines of sight, (L,)."""
    free = by_place(1 - occupancy)
    free[-1] = 1  # beyond the grid
    doubt = 1 - np.abs(2 * free - 1) ** _DOUBT
    kept = 1 - np.maximum(0, 1 - 2 * free) ** _HIDING
    farthest = lines.entries.max()
    background, passing = np.ones((2, lines.cells.shape[1]), np.float32)
    depth = np.zeros_like(passing)
    for cells, entry in zip(lines.cells, lines.entries, strict=True):
        depth += passing * doubt[cells] * (entry / farthest) ** 2
        passing *= kept[cells]
        background *= free[cells]
    return (_BASE + 1 - np.abs(2 * background - 1) ** _OUTLINE) * depth
