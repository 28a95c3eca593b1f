"""The learned policy of a lifting network: the expected gain of IoU of every candidate."""

from functools import lru_cache
import math

from active_recon.models.candidate_looks import look
from active_recon.policies.base import Choice, distance_to_taken, Observation
from active_recon.policies.candidate_rendering import COARSE_SIDE, coarse_volume
from active_recon.runtimes import PolicyRuntime, State
import numpy as np
from numpy.typing import NDArray

_LESS = np.float32(1e-6)
_PREPARED = 16  # views, with their candidates
_SAME = math.radians(10)
"""Angle to a view taken below which a candidate is worth the less, the nearer it is."""


class ScoringPolicy:
    """
    Scores each candidate by the gain of IoU that its model expects, given the probabilities.

    It has no front and no fixed candidates: any cameras that look at the object. A candidate
    within 10 degrees of a view taken is worth the less, the nearer it is; one at a view taken is
    worth nothing, and comes after all others.
    """

    wants_volume = True

    def __init__(self, runtime: PolicyRuntime) -> None:
        self._runtime = runtime
        self.provenance = runtime.provenance

    def initial_state(self, batch: int) -> State:
        """Return the model's state before any view."""
        return self._runtime.initial_state(batch)

    def prepare(self, camera: NDArray[np.float64], candidates: NDArray[np.float64]) -> None:
        """Compute the lines of sight that `choose` will ask for; see `Planner.expect_camera`."""
        _look_at_nothing(camera.tobytes(), candidates.tobytes())

    def choose(self, seen: Observation, state: State) -> tuple[Choice, State]:
        """Return expected gains of IoU as scores; see Policy."""
        assert seen.occupancy is not None
        volume = coarse_volume(seen.occupancy)
        looks = look(volume.occupancy, volume.entropy, seen.taken, seen.candidates)
        found, state = self._runtime.step(looks._asdict(), state)
        gains = found['gain']
        least = np.minimum(gains.min(axis=1, keepdims=True), 0)
        new = np.minimum(distance_to_taken(seen) / _SAME, 1)
        scores = least + (gains - least) * new - _LESS * (1 - new)
        return Choice(scores.astype(np.float32), is_gain=True), state


@lru_cache(maxsize=_PREPARED)
def _look_at_nothing(camera: bytes, candidates: bytes) -> None:
    """Let `look` compute its lines of sight, which it keeps; once for cameras that come again."""
    nothing = np.zeros((1, *(COARSE_SIDE,) * 3), np.float32)
    look(nothing, nothing, *(np.frombuffer(poses).reshape(1, -1, 4, 4)
                             for poses in (camera, candidates)))
