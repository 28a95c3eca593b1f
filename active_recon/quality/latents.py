"""How far a latent lies from those of the training objects."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

_SHRINKAGE = 0.1  # of the covariance towards its diagonal
_LEAST = 1e-6


def pooled(latent: NDArray[np.floating]) -> NDArray[np.float64]:
    """Return mean and standard deviation of each channel of latents (..., C, h, w): (..., 2 C)."""
    flat = latent.reshape(*latent.shape[:-2], -1).astype(np.float64)
    return np.concatenate([flat.mean(axis=-1), flat.std(axis=-1)], axis=-1)


@dataclass(frozen=True, eq=False)
class KnownLatents:
    """Pooled latents of training objects: their mean (D,), and what whitens them, (D, D)."""

    mean: NDArray[np.float64]
    whitening: NDArray[np.float64]

    @classmethod
    def of(cls, found: NDArray[np.float64]) -> Self:
        """Fit to pooled latents (N, D)."""
        covariance = np.cov(found.T)
        diagonal = np.diag(np.diag(covariance) + _LEAST)
        shrunk = (1 - _SHRINKAGE) * covariance + _SHRINKAGE * diagonal
        return cls(found.mean(axis=0), np.linalg.inv(np.linalg.cholesky(shrunk)))

    def distances(self, found: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the log of the Mahalanobis distance of pooled latents (..., D): (...)."""
        away = (found - self.mean) @ self.whitening.T
        return np.asarray(np.log(np.linalg.norm(away, axis=-1) + _LEAST))
