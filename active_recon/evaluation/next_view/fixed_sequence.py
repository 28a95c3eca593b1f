"""The best sequence of views that is the same for all objects: what one-shot set cover finds."""

from collections.abc import Callable, Sequence
import math

from active_recon.errors import DataError
from active_recon.evaluation.next_view.watching import WatchedObject
from active_recon.geometry.cameras import pose_azimuths, TURN
from active_recon.geometry.view_distance import direction_distance, pose_directions
from active_recon.policies import Choice, Observation
from active_recon.policies.base import is_fresh
from active_recon.policies.geometric import HeuristicPolicy
from active_recon.runtimes import State
import numpy as np
from numpy.typing import NDArray

_DIGITS = 1  # of degrees, by which places on a grid of cameras are told apart

Offsets = NDArray[np.float64]
"""Azimuths counted from the first view's, and elevations, (T - 1, 2), radians."""


class FixedSequence(HeuristicPolicy):
    """Goes through a sequence, whatever it sees; no view is taken twice."""

    def __init__(self, sequence: Offsets) -> None:
        self._sequence = sequence

    def choose(self, seen: Observation, state: State) -> tuple[Choice, State]:
        """Choose the candidate nearest to the next of the sequence; see Policy."""
        step = min(seen.taken.shape[1], len(self._sequence)) - 1
        offset, elevation = self._sequence[step]
        azimuth = pose_azimuths(seen.taken[:, 0]) + offset
        wanted = np.stack([math.cos(elevation) * np.cos(azimuth),
                           math.cos(elevation) * np.sin(azimuth),
                           np.full_like(azimuth, math.sin(elevation))], axis=-1)
        away = direction_distance(pose_directions(seen.candidates), wanted[:, None])
        return Choice(np.where(is_fresh(seen), -away, -away - TURN).astype(np.float32)), state


def find_sequence(objects: Sequence[WatchedObject], starts: Sequence[int], count: int,
                  advance: Callable[[int], None] = lambda done: None) -> Offsets:
    """
    Return the offsets that bring most IoU one after the other, over objects and their starts.

    Each next one is that which brings most above the mean of all views, on average over the
    objects, given those before: what one-shot set cover comes to where IoU is what is covered. It
    ends after all views of an object. Raises DataError where there is one alone, and where the
    cameras do not stand alike around the objects' first views, as they do on a turntable.
    """
    count = min(count, *(watched.count for watched in objects))
    if count < 2:
        raise DataError('nothing to choose: expected training objects of two views or more, got '
                        'one')
    walks = [watched.begin(start) for watched, start in zip(objects, starts, strict=True)]
    places = [_places(watched, start) for watched, start in zip(objects, starts, strict=True)]
    found: list[tuple[float, float]] = []
    for _ in range(count - 1):
        worth: dict[tuple[float, float], list[float]] = {}
        for watched, walk, own in zip(objects, walks, places, strict=True):
            after = watched.ahead(walk).iou
            # Not all objects have all places: an easy object must not speak for its places alone
            for place, value in zip(own, after - np.nanmean(after), strict=True):
                if np.isfinite(value):
                    worth.setdefault(place, []).append(float(value))
            advance(1)
        shared = {place: float(np.mean(values)) for place, values in worth.items()
                  if 2 * len(values) > len(walks)}
        if not shared:
            raise DataError('cameras stand differently around each object: expected a grid of '
                            'azimuths and elevations that all objects have, as `--cameras '
                            'turntable` and `--cameras dome` make, got no place in common')
        found.append(max(shared, key=lambda place: shared[place]))
        policy = FixedSequence(np.radians(found))
        walks = [watched.step(walk, int(policy.choose(
            watched.observation(walk, False), {})[0].scores[0].argmax()))
            for watched, walk in zip(objects, walks, strict=True)]
    return np.radians(found)


def _places(watched: WatchedObject, start: int) -> list[tuple[float, float]]:
    """Return where each view stands: degrees of azimuth from the first on, and of elevation."""
    poses = watched.views.poses[0].numpy()
    offsets = np.degrees(pose_azimuths(poses) - pose_azimuths(poses[start]))
    elevations = np.degrees(np.arcsin(pose_directions(poses)[:, 2]))
    return [(float(offset), float(elevation)) for offset, elevation in zip(
        offsets.round(_DIGITS) % 360, elevations.round(_DIGITS), strict=True)]
