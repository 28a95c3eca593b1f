"""Why a view is worth taking, in plain words."""

from dataclasses import dataclass
import math

from active_recon.policies.base import Observation
from active_recon.policies.candidate_rendering import coarse_volume, in_sight
from active_recon.volumes.voxels import cell_centers
import numpy as np
from numpy.typing import NDArray

_LITTLE = 0.1
"""Share of the doubt in sight below which a view shows nothing that was not in sight before."""


@dataclass(frozen=True)
class GoalReason:
    """Why a goal is worth its view: what it shows, in words, and its gain of IoU, if expected."""

    shows: str
    gain: float | None = None

    @property
    def sentence(self) -> str:
        """Both in words."""
        return self.shows if self.gain is None else (
            f'{self.shows}; expected gain of IoU {self.gain:z.3f}')


def goal_reason(seen: Observation, goal: NDArray[np.float64],
                gain: float | None = None) -> GoalReason:
    """
    Return what a camera at a pose (4, 4) would show, for one episode.

    It names the part of the object where the doubt (entropy) lies that the camera would have in
    sight and no view had: its top, its underside or a side, and how much of the doubt in sight
    that is. Where it is little, the camera is said to look again at what is in doubt. `gain` is
    the expected gain of IoU, if the policy knows it. The observation needs its occupancy; lengths
    of the pose count in sides of the grid, its azimuth is in the observation's frame.
    """
    assert seen.occupancy is not None
    volume = coarse_volume(seen.occupancy[:1])
    from_goal, before = (in_sight(volume, poses)[0]
                         for poses in (goal[None, None], seen.taken[:1]))
    doubt = from_goal * volume.entropy[0]
    new = np.maximum(from_goal - before, 0) * volume.entropy[0]
    share = float(new.sum() / max(float(doubt.sum()), 1e-9))
    part = _part(volume.occupancy[0], new if share >= _LITTLE else doubt)
    what = (f'shows {part}: {share:.0%} of the doubt in sight was hidden from all views'
            if share >= _LITTLE else f'looks again at {part}, where doubt is left')
    return GoalReason(what, gain)


def _part(occupancy: NDArray[np.float32], weight: NDArray[np.float32]) -> str:
    """Return the name of the part where weights of cells (S, S, S) lie, from the middle."""
    side = len(weight)
    centers = cell_centers(side)
    where, middle = (np.average(centers, axis=0, weights=each.ravel())
                     if each.sum() > 0 else np.zeros(3) for each in (weight, occupancy))
    x, y, z = where - middle
    if abs(z) > math.hypot(x, y):
        return 'the top' if z > 0 else 'the underside'
    if math.hypot(x, y) < 1 / (2 * side):
        return 'the whole object'
    return f'the side towards azimuth {round(math.degrees(math.atan2(y, x))) % 360} degrees'
