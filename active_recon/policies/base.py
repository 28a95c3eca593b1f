"""What every view policy is: what was seen in, what every azimuth is worth out."""

from dataclasses import dataclass
from typing import Any, Protocol

from active_recon.cameras import azimuth_difference, AZIMUTHS, TURN
import numpy as np
from numpy.typing import NDArray

_ROUNDING = 1e-3  # rad, of the azimuths that were rendered


@dataclass(frozen=True, eq=False)
class Choice:
    """Where to look next, for B episodes: azimuths (B,) and the worth of all 24, (B, 24)."""

    azimuth: NDArray[np.float64]
    scores: NDArray[np.float32]


class Policy(Protocol):
    """Chooses the next azimuth; its state is handed back to be passed in again."""

    def choose(self, latent: NDArray[np.float32], taken: NDArray[np.float64],
               state: Any = None) -> tuple[Choice, Any]:
        """
        Choose after a view, for B episodes at once.

        - latent: (B, C, h, w), A_t after that view
        - taken: (B, t), the azimuths of all views so far, radians, the last one's last
        - state: what the last call handed back; None before the first
        """
        ...


def kept_apart(wanted: NDArray[np.float64], taken: NDArray[np.float64],
               separation: float) -> NDArray[np.float64]:
    """
    Return azimuths (B,) at least `separation` from all taken (B, t), and near those wanted (B,).

    Those wanted, where they are far enough; else the nearest of the 24 that is; where none is, the
    farthest from what was taken. All in radians.
    """
    far_enough = np.abs(azimuth_difference(taken, wanted[:, None])).min(axis=1) >= separation
    away = np.abs(azimuth_difference(AZIMUTHS[None], wanted[:, None]))
    # All that are too near come after all that are not, which are at most half a turn away
    rank = np.where(are_apart(taken, separation), -away, distance_to_taken(taken) - TURN)
    return np.where(far_enough, wanted, AZIMUTHS[rank.argmax(axis=1)])


def are_apart(taken: NDArray[np.float64], separation: float) -> NDArray[np.bool_]:
    """Return which of the 24 azimuths are `separation` from all taken, (B, t) to (B, 24)."""
    return distance_to_taken(taken) > separation - _ROUNDING


def distance_to_taken(taken: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return how far each of the 24 azimuths is from the nearest taken, (B, t) to (B, 24)."""
    gaps = np.abs(azimuth_difference(AZIMUTHS[None, :, None], taken[:, None, :]))
    nearest: NDArray[np.float64] = gaps.min(axis=2)
    return nearest
