"""The heuristic policies, which use no image: random, uniform, farthest."""

import math

from active_recon.geometry.cameras import azimuth_difference, pose_azimuths, TURN
from active_recon.geometry.view_distance import (
    at_one_elevation,
    direction_distance,
    pose_directions,
)
from active_recon.policies.base import Choice, distance_to_taken, is_fresh, Observation
from active_recon.runtimes import State
import numpy as np
from numpy.typing import NDArray

_GOLDEN = (math.sqrt(5) - 1) / 2
_MOST_IN_TURN = 24
"""Views of a ring up to which an even sweep takes them one beside the other."""
_MOST = 1000
"""Views up to which their places are spread; a limit that stands for none may be any number."""


class HeuristicPolicy:
    """A policy without a state that uses only the cameras."""

    wants_volume = False

    def initial_state(self, batch: int) -> State:
        """Return no state."""
        return {}


class RandomPolicy(HeuristicPolicy):
    """A random candidate that was not taken yet; any candidate once all were taken."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng

    def choose(self, seen: Observation, state: State) -> tuple[Choice, State]:
        """Draw; see Policy."""
        fresh = is_fresh(seen)
        scores = self._rng.random(fresh.shape, dtype=np.float32)
        return Choice(np.where(fresh, scores, scores - 1)), state


class UniformPolicy(HeuristicPolicy):
    """
    An equidistant sweep from the first view around +z, for a given number of views.

    Where the candidates' elevations differ by more than 10 degrees, the sweep goes up and down
    besides: from azimuth to azimuth the height, the sine of the elevation, grows by 0.618 of the
    candidates' range, and goes on from the lowest where that is above the highest. These are
    points of a Fibonacci lattice, which gives equal areas of a sphere about equally many. They are
    taken in steps of about 137 degrees, so that few of them are spread too, as are more than 24
    at one elevation: an episode of so many is meant to end earlier. Where elevations differ the
    best candidate is the goal, and no azimuth between candidates is preferred. Where the camera
    cannot go around, and as many candidates as views are in reach, the sweep is from end to end of
    those, the best of which is the goal then too; it begins with the place nearest to the first
    view.
    """

    def __init__(self, views: int) -> None:
        self._views = min(max(views, 1), _MOST)
        self._step = TURN / self._views
        around = np.arange(self._views) * (1 - _GOLDEN) % 1
        self._order: NDArray[np.intp] = np.argsort(np.argsort(around))

    def choose(self, seen: Observation, state: State) -> tuple[Choice, State]:
        """Choose the next place of the sweep, counted from its start; see Policy."""
        first, count = seen.taken[:, 0], seen.taken.shape[1]
        directions = pose_directions(seen.candidates)
        turns, rest = divmod(count, self._views)
        is_ring = at_one_elevation(directions)
        spread = turns * self._views + self._order[rest]
        place = np.where(is_ring & (self._views <= _MOST_IN_TURN), count, spread)
        target, is_between = self._azimuths(seen, place)
        height = np.where(is_ring, pose_directions(first)[:, 2],
                          _risen(pose_directions(first)[:, 2], directions[..., 2], place))
        across = np.sqrt(np.maximum(1 - height ** 2, 0))
        wanted = np.stack([across * np.cos(target), across * np.sin(target), height], axis=-1)
        away = direction_distance(directions, wanted[:, None])
        between = np.where(is_ring & is_between, target, np.nan)
        return Choice((-away).astype(np.float32), between), state

    def _azimuths(self, seen: Observation,
                  place: NDArray[np.int64]) -> tuple[NDArray[np.float64], bool]:
        """
        Return the azimuths so many places after the first view's, (B,).

        And whether they may be goals between the candidates: within limits there are few, and each
        is worth a view.
        """
        first = pose_azimuths(seen.taken[:, 0])
        around = np.asarray((first + place * self._step) % TURN)
        if seen.reachable is None or seen.reachable.all() or seen.reachable.sum() < self._views:
            return around, True
        ends = np.unique(pose_azimuths(seen.candidates[0, seen.reachable]))
        gaps = np.diff(ends, append=ends[:1] + TURN)
        width = TURN - gaps.max(initial=0)
        if TURN - width <= self._step:
            return around, True
        low, last = ends[(gaps.argmax() + 1) % len(ends)], max(self._views - 1, 1)
        inside = azimuth_difference(first, low + width / 2).clip(-width / 2, width / 2)
        begun = np.rint((inside / max(width, 1e-9) + 0.5) * last)
        return np.asarray((low + (begun + place) % self._views * width / last) % TURN), False


def _risen(first: NDArray[np.float64], heights: NDArray[np.float64],
           steps: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return the height so many steps of a sweep after the first, within those of candidates."""
    low, high = heights.min(axis=1), heights.max(axis=1)
    share = ((first - low) / np.maximum(high - low, 1e-9)).clip(0, 1)
    return np.asarray(low + (high - low) * ((share + steps * _GOLDEN) % 1))


class FarthestPolicy(HeuristicPolicy):
    """The candidate with the largest distance to the nearest view taken."""

    def choose(self, seen: Observation, state: State) -> tuple[Choice, State]:
        """Choose the first of the farthest; see Policy."""
        # Rounding settles ties the same way, whatever the precision of the poses
        return Choice(distance_to_taken(seen).round(4).astype(np.float32)), state
