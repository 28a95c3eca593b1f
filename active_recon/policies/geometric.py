"""The heuristic policies, which use no image: random, uniform, farthest."""

from active_recon.geometry.cameras import pose_azimuths, TURN
from active_recon.geometry.view_distance import direction_distance, pose_directions
from active_recon.policies.base import Choice, distance_to_taken, is_fresh, Observation
from active_recon.runtimes import State
import numpy as np


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
    """An equidistant sweep from the first view around +z, for a given number of views."""

    def __init__(self, views: int) -> None:
        self._step = TURN / max(views, 1)

    def choose(self, seen: Observation, state: State) -> tuple[Choice, State]:
        """Choose the next azimuth of the sweep, counted from its start; see Policy."""
        first, count = seen.taken[:, 0], seen.taken.shape[1]
        target = (pose_azimuths(first) + count * self._step) % TURN
        height = pose_directions(first)[:, 2]
        across = np.sqrt(np.maximum(1 - height ** 2, 0))
        wanted = np.stack([across * np.cos(target), across * np.sin(target), height], axis=-1)
        away = direction_distance(pose_directions(seen.candidates), wanted[:, None])
        return Choice((-away).astype(np.float32), target), state


class FarthestPolicy(HeuristicPolicy):
    """The candidate with the largest distance to the nearest view taken."""

    def choose(self, seen: Observation, state: State) -> tuple[Choice, State]:
        """Choose the first of the farthest; see Policy."""
        # Rounding settles ties the same way, whatever the precision of the poses
        return Choice(distance_to_taken(seen).round(4).astype(np.float32)), state
