"""The goal that a camera is sent to: the best of the candidates, or what lies between them."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
import math

from active_recon.acquisition.motion import MotionLimits
from active_recon.acquisition.motion_cost import MotionCost
from active_recon.geometry.cameras import Camera, VIEW_COUNT
from active_recon.geometry.view_distance import nearest_camera, nearest_cameras, view_distances
import numpy as np
from numpy.typing import NDArray

_SAME_VIEW = math.pi / VIEW_COUNT  # half of the way between two azimuths of a turntable


@dataclass(frozen=True, eq=False)
class Goal:
    """
    The camera of the next view, and the utility of every reachable candidate.

    - camera: its pose in the object frame; it may lie between the candidates
    - candidates: N cameras; scores: (N,), more is better
    - gain: the expected gain of IoU of its view; None where the scores are no gains
    - worth: the most that any goal in reach is expected to gain, less `motion_cost` of the time
      that its view takes; None likewise
    """

    camera: Camera
    candidates: Sequence[Camera] = field(repr=False)
    scores: NDArray[np.float32] = field(repr=False)
    gain: float | None = None
    worth: float | None = None


@dataclass(frozen=True, eq=False)
class Wanted:
    """
    A camera between the candidates, if one is wanted, and the candidates' scores (N,).

    `is_gain`: whether the scores are expected gains of IoU.
    """

    camera: Camera | None
    scores: NDArray[np.float32]
    is_gain: bool = False


def best_goal(wanted: Wanted, candidates: Sequence[Camera], camera: Camera,
              taken: Sequence[Camera], failed: Sequence[Camera], limits: MotionLimits,
              cost: MotionCost) -> Goal | None:
    """
    Return the best goal for a camera that is somewhere; None where none is left.

    What is wanted between the candidates is worth as much as the best of them. The views `taken`
    and those that `failed` are not asked for again: the same view once more brings nothing. A
    candidate without a view is left out for one of its neighbourhood as long as there are others.
    `cost` is that of the way to a goal.
    """
    scores, options = wanted.scores, list(candidates)
    nearest = np.arange(len(candidates))
    if wanted.camera is not None:  # first: of those alike, the first is taken
        options.insert(0, wanted.camera)
        nearest = np.insert(nearest, 0, nearest_camera(wanted.camera, candidates))
        scores = np.append(scores.max(), scores)
    # One outside of the limits, which changed since, tells nothing of the candidate near it
    failed = [each for each in failed if limits.allows(each.azimuth)]
    azimuths = np.array([option.azimuth for option in options])
    is_failed, is_taken = (np.isin(nearest, nearest_cameras(cameras, candidates))
                           for cameras in (failed, taken))
    is_open = limits.allows(azimuths) & ~is_failed
    eligible = is_open & ~is_taken
    if not eligible.any():  # the nearest to a view need not be where that was taken
        eligible = is_open & ~(view_distances(options, taken) < _SAME_VIEW).any(axis=1)
    if not eligible.any():
        return None
    value = cost.utility(scores, wanted.is_gain, camera, options, limits)
    best = int(np.flatnonzero(eligible)[value[eligible].argmax()])
    own = slice(len(options) - len(candidates), None)
    goal = Goal(options[best], [each for each, free in zip(
        candidates, is_open[own], strict=True) if free], value[own][is_open[own]])
    if not wanted.is_gain:
        return goal
    worth = cost.less_time(scores, camera, options, limits)
    return replace(goal, gain=float(scores[best]), worth=float(worth[eligible].max()))
