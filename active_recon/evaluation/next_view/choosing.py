"""Ways to choose the views of an episode: policies, and what no robot has."""

from collections.abc import Callable

from active_recon.evaluation.next_view.watching import Ahead, WatchedObject
from active_recon.policies import Policy
import numpy as np
from numpy.typing import NDArray

Order = tuple[int, ...]
"""The views of an episode, by their numbers, the first of which was not chosen."""


def chosen_by(policy: Policy, watched: WatchedObject, start: int, count: int) -> Order:
    """
    Return the views that a policy takes: the best of its scores, each time.

    What it proposes between the candidates is left out, since nothing was rendered there.
    """
    walk, memory = watched.begin(start), policy.initial_state(1)
    while len(walk.taken) < min(count, watched.count):
        choice, memory = policy.choose(watched.observation(walk, policy.wants_volume), memory)
        walk = watched.step(walk, int(choice.scores[0].argmax()))
    return walk.taken


def chosen_ahead(worth: Callable[[Ahead], NDArray[np.float64]], watched: WatchedObject,
                 start: int, count: int) -> Order:
    """Return the views that are each worth most, one step ahead, of all not yet taken."""
    walk = watched.begin(start)
    while len(walk.taken) < min(count, watched.count):
        walk = watched.step(walk, int(np.nanargmax(worth(watched.ahead(walk)))))
    return walk.taken


def judged(watched: WatchedObject, order: Order) -> list[float]:
    """Return the IoU after each view of an order."""
    walk = watched.begin(order[0])
    found = [watched.iou(walk)]
    for view in order[1:]:
        walk = watched.step(walk, view)
        found.append(watched.iou(walk))
    return found
