"""Ways to choose the views of an episode: policies, and what no robot has."""

from collections.abc import Callable, Sequence
from itertools import pairwise

from active_recon.acquisition.motion import MotionLimits
from active_recon.acquisition.motion_cost import MotionCost, TimedMotion
from active_recon.evaluation.next_view.watching import Ahead, Walk, WatchedObject
from active_recon.geometry.cameras import Camera
from active_recon.policies import Policy
from active_recon.policies.checked import begun_by, chosen
import numpy as np
from numpy.typing import NDArray

Order = tuple[int, ...]
"""The views of an episode, by their numbers, the first of which was not chosen."""


def chosen_by(policy: Policy, watched: WatchedObject, start: int, count: int,
              motion_cost: float = 0.0) -> Order:
    """
    Return the views that a policy takes: the best of its scores, each time; none is taken twice.

    `motion_cost` of a second, at 1 rad/s around either axis, is taken off, see `TimedMotion`. What
    a policy proposes between the candidates is left out, since nothing was rendered there.
    """
    walk, memory = watched.begin(start), begun_by(policy)
    cost = MotionCost(timed=TimedMotion(motion_cost=motion_cost))
    cameras = cameras_of(watched)
    while len(walk.taken) < min(count, watched.count):
        choice, memory = chosen(policy, watched.observation(walk, policy.wants_volume), memory)
        scores = cost.utility(choice.scores[0], choice.is_gain, cameras[walk.taken[-1]], cameras,
                              MotionLimits()).copy()
        scores[list(walk.taken)] = -np.inf
        walk = watched.step(walk, int(scores.argmax()))
    return walk.taken


def cameras_of(watched: WatchedObject) -> Sequence[Camera]:
    """Return the cameras of all views."""
    return [Camera(pose) for pose in watched.views.poses[0].numpy()]


def motion_time(watched: WatchedObject, order: Order) -> float:
    """Return the time that the motion through an order takes, seconds at 1 rad/s."""
    cameras = cameras_of(watched)
    return float(sum(TimedMotion().seconds(cameras[one], [cameras[other]], MotionLimits())[0]
                     for one, other in pairwise(order)))


def chosen_ahead(worth: Callable[[Ahead], NDArray[np.float64]], watched: WatchedObject,
                 start: int, count: int) -> Order:
    """Return the views that are each worth most, one step ahead, of all not yet taken."""
    return _continued(worth, watched, watched.begin(start), count)


def _continued(worth: Callable[[Ahead], NDArray[np.float64]], watched: WatchedObject, walk: Walk,
               count: int) -> Order:
    while len(walk.taken) < min(count, watched.count):
        walk = watched.step(walk, int(np.nanargmax(worth(watched.ahead(walk)))))
    return walk.taken


def chosen_together(watched: WatchedObject, start: int, count: int) -> Order:
    """
    Return the best three views with the first of them given, and then the best one at a time.

    Every pair of further views is tried: what looking one step ahead misses shows. Takes as many
    reconstructions as there are ordered pairs.
    """
    first = watched.begin(start)
    if count < 3:
        return _continued(lambda ahead: ahead.iou, watched, first, count)
    alone = watched.ahead(first).iou
    # The better of two alone comes first; the IoU of a pair does not depend on the order
    pairs = {(view, int(np.nanargmax(after))): float(np.nanmax(after))
             for view in np.flatnonzero(np.isfinite(alone)).tolist()
             if np.isfinite(after := watched.ahead(watched.step(first, view)).iou).any()}
    order = [start]
    if pairs:
        best = max(pairs, key=lambda pair: pairs[pair])
        order += sorted(best, key=lambda view: -float(alone[view]))
    walk = first
    for view in order[1:]:
        walk = watched.step(walk, view)
    return _continued(lambda ahead: ahead.iou, watched, walk, count)


def judged(watched: WatchedObject, order: Order) -> list[float]:
    """Return the IoU after each view of an order."""
    walk = watched.begin(order[0])
    found = [watched.iou(walk)]
    for view in order[1:]:
        walk = watched.step(walk, view)
        found.append(watched.iou(walk))
    return found
