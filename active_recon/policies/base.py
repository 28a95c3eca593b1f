"""The interface of view policies: an observation in, a score for every candidate out."""

from dataclasses import dataclass
from typing import Protocol

from active_recon.geometry.view_distance import direction_distance, pose_directions
from active_recon.runtimes import State
import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Observation:
    """
    B episodes after a view, and the candidates for the next one.

    - latent: (B, C, h, w), the network's after that view
    - taken: (B, t, 4, 4), the poses of the cameras of all views so far, in order
    - candidates: (B, K, 4, 4), poses of cameras; one set for all where B is 1 there
    - occupancy: (B, R, R, R), the published probabilities, for policies of `wants_volume`
    - reachable: (K,), whether the camera can go to each candidate; None: to all of them

    Poses are object from optical frame, in the frame in which the network predicts. Where there is
    an occupancy, their lengths count in sides of its grid.
    """

    latent: NDArray[np.float32]
    taken: NDArray[np.float64]
    candidates: NDArray[np.float64]
    occupancy: NDArray[np.float32] | None = None
    reachable: NDArray[np.bool_] | None = None


@dataclass(frozen=True, eq=False)
class Choice:
    """
    The choice of the next view, for B episodes.

    - scores: (B, K), of the candidates, finite; higher is better
    - azimuth: (B,), radians, that the policy prefers to all candidates; NaN where it prefers
      none; None: for no episode
    - is_gain: whether the scores are expected gains of IoU, and not only an order
    """

    scores: NDArray[np.float32]
    azimuth: NDArray[np.float64] | None = None
    is_gain: bool = False


class Policy(Protocol):
    """
    Scores the candidates for the next view; its state is passed in and returned.

    `wants_volume`: whether it uses the observation's occupancy.
    """

    @property
    def wants_volume(self) -> bool: ...

    def initial_state(self, batch: int) -> State:
        """Return the state of so many episodes before any view."""
        ...

    def choose(self, seen: Observation, state: State) -> tuple[Choice, State]:
        """Choose after a view, for B episodes at once."""
        ...


def distance_to_taken(seen: Observation) -> NDArray[np.float64]:
    """Return how far each candidate is from the nearest view taken, (B, K), radians."""
    nearest: NDArray[np.float64] = _gaps(seen).min(axis=2)
    return nearest


def is_fresh(seen: Observation) -> NDArray[np.bool_]:
    """Return which candidates are nearest to no view taken, (B, K)."""
    gaps = _gaps(seen)
    fresh = np.ones(gaps.shape[:2], np.bool_)
    np.put_along_axis(fresh, gaps.argmin(axis=1), False, axis=1)
    return fresh


def _gaps(seen: Observation) -> NDArray[np.float64]:
    """Return how far each candidate is from each view taken, (B, K, t), radians."""
    return direction_distance(pose_directions(seen.candidates)[:, :, None],
                              pose_directions(seen.taken)[:, None])
