"""The paper's policy at run time: the attentive-recurrent visual model's mean azimuth."""

import math

from active_recon.errors import ViewError
from active_recon.geometry.cameras import (
    azimuth_difference,
    ELEVATION_TOLERANCE,
    pose_azimuths,
    TURN,
)
from active_recon.geometry.view_distance import pose_directions
from active_recon.policies.base import Choice, Observation
from active_recon.runtimes import PolicyRuntime, State
import numpy as np
from numpy.typing import NDArray

_ROUNDING = 1e-3  # rad, of the azimuths that were rendered


class AttentionPolicy:
    """
    The mean of pi(u_t | theta; s_t), separated from the views taken; its state is the LSTM's.

    The paper's policy always takes the mean, and so the same view twice in half of its episodes.
    Here goals keep the model's `view_separation` from all views taken. Only the cameras' azimuths
    are used; of several elevations, the camera's is kept.
    """

    wants_volume = False

    def __init__(self, runtime: PolicyRuntime, sigma: float = 0.35) -> None:
        self._runtime = runtime
        self.provenance = runtime.provenance
        self._sigma = sigma
        self._latent_shape = tuple(runtime.facts['latent_shape'])
        self._separation = float(runtime.facts['view_separation'])

    def initial_state(self, batch: int) -> State:
        """Return the memory before any view."""
        return self._runtime.initial_state(batch)

    def choose(self, seen: Observation, state: State) -> tuple[Choice, State]:
        """
        Choose the mean, or the candidate nearest to it that is separated from the views taken.

        A candidate's score is its log density, up to a constant. Candidates too near to a view
        score lower than all others, and the lower the nearer they are. Where candidates stand at
        several elevations, those away from the last view's score lower still. Raises ViewError
        where the latents are those of another model.
        """
        if seen.latent.shape[1:] != self._latent_shape:
            raise ViewError(f'wrong shape of the latent: expected {self._latent_shape}, as the '
                            f'policy was trained on, got {seen.latent.shape[1:]}', 'latent')
        taken, candidates = pose_azimuths(seen.taken), pose_azimuths(seen.candidates)
        proposal, state = self._runtime.step(
            {'latent': seen.latent, 'azimuth': taken[:, -1].astype(np.float32)}, state)
        mean = proposal['mean_azimuth'].astype(np.float64) % TURN
        away = azimuth_difference(candidates, mean[:, None]) / self._sigma
        gaps = gaps_to_taken(candidates, taken)
        scores = np.where(gaps > self._separation - _ROUNDING, -away ** 2 / 2,
                          -(math.pi / self._sigma) ** 2 / 2
                          - (self._separation - gaps) / self._sigma)
        scores -= _is_elsewhere(seen) * (1 + np.ptp(scores, axis=1, keepdims=True))
        separated = is_separated(mean, taken, self._separation)
        return Choice(scores.astype(np.float32), np.where(separated, mean, np.nan)), state


def _is_elsewhere(seen: Observation) -> NDArray[np.bool_]:
    """Return which candidates are not at the elevations nearest to the camera's, (B, K)."""
    own, others = (np.arcsin(pose_directions(poses)[..., 2].clip(-1, 1))
                   for poses in (seen.taken[:, -1:], seen.candidates))
    away = np.abs(others - own)
    return np.asarray(away > away.min(axis=1, keepdims=True) + ELEVATION_TOLERANCE)


def enforce_separation(wanted: NDArray[np.float64], taken: NDArray[np.float64],
               candidates: NDArray[np.float64], separation: float) -> NDArray[np.float64]:
    """
    Return azimuths (B,) at least `separation` from all taken (B, t), and near those wanted (B,).

    The wanted azimuth where it is separated; else the nearest of the candidates (B, K) that is;
    where none is, the candidate farthest from the views taken. All in radians.
    """
    away = np.abs(azimuth_difference(candidates, wanted[:, None]))
    gaps = gaps_to_taken(candidates, taken)
    # All that are too near come after all that are not, which are at most half a turn away
    rank = np.where(gaps > separation - _ROUNDING, -away, gaps - TURN)
    best = np.take_along_axis(candidates, rank.argmax(axis=1)[:, None], axis=1)[:, 0]
    return np.where(is_separated(wanted, taken, separation), wanted, best)


def is_separated(azimuths: NDArray[np.float64], taken: NDArray[np.float64],
                 separation: float) -> NDArray[np.bool_]:
    """Return whether azimuths (B,) are at least `separation` from all taken (B, t), radians."""
    nearest = np.abs(azimuth_difference(taken, azimuths[:, None])).min(axis=1)
    return np.asarray(nearest >= separation)


def gaps_to_taken(candidates: NDArray[np.float64],
                  taken: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return how far azimuths (B, K) are from the nearest taken (B, t), (B, K), radians."""
    gaps = np.abs(azimuth_difference(candidates[:, :, None], taken[:, None, :]))
    nearest: NDArray[np.float64] = gaps.min(axis=2)
    return nearest
