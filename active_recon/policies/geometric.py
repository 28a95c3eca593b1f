"""The policies that look at no image: random, uniform, farthest."""

from active_recon.cameras import azimuth_difference, AZIMUTHS, TURN, VIEW_COUNT
from active_recon.policies.base import Choice, distance_to_taken
import numpy as np
from numpy.typing import NDArray


class RandomPolicy:
    """Any azimuth not yet taken, all alike; any at all once every one was taken."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng

    def choose(self, latent: NDArray[np.float32], taken: NDArray[np.float64],
               state: None = None) -> tuple[Choice, None]:
        """Draw; see Policy."""
        scores = self._rng.random((len(taken), VIEW_COUNT), dtype=np.float32)
        fresh = distance_to_taken(taken) > TURN / VIEW_COUNT / 2
        scores = np.where(fresh, scores, scores - 1)
        return Choice(AZIMUTHS[scores.argmax(axis=1)], scores), None


class UniformPolicy:
    """An equidistant sweep from the first view, for a given number of views."""

    def __init__(self, views: int) -> None:
        self._step = TURN / max(views, 1)

    def choose(self, latent: NDArray[np.float32], taken: NDArray[np.float64],
               state: None = None) -> tuple[Choice, None]:
        """Go one step on from the sweep's start, however roughly it was followed."""
        target = (taken[:, 0] + taken.shape[1] * self._step) % TURN
        scores = -np.abs(azimuth_difference(AZIMUTHS[None], target[:, None]))
        return Choice(target, scores.astype(np.float32)), None


class FarthestPolicy:
    """The azimuth with the largest distance to the nearest view taken."""

    def choose(self, latent: NDArray[np.float32], taken: NDArray[np.float64],
               state: None = None) -> tuple[Choice, None]:
        """Take the first of the farthest."""
        # Rounding settles ties the same way, whatever the precision of the azimuths
        scores = distance_to_taken(taken).round(4).astype(np.float32)
        return Choice(AZIMUTHS[scores.argmax(axis=1)], scores), None
