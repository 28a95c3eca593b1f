"""How bright photographs and the light in them are, from what several of them show."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

_OFFSET = 2.0
"""Added to colours before their logarithm: dark ones are noise."""
_CLIPPED = 250
"""Colours from here on say nothing of the exposure."""
_PRIOR = 0.001
"""Weight, of all samples, of the assumption that nothing has to be evened."""
_ROUNDS = 4
_TOLERANCE = 0.15
"""Deviation of a logarithm above which a sample weighs less: a highlight, or another part."""
_POINTS = 8000
"""Points that are looked at: enough for a few dozen unknowns."""
_FULL = 98
"""Percentile of the samples' light that counts as full light."""


@dataclass(frozen=True, eq=False)
class Exposure:
    """
    The brightness of N photographs and of the light that moves with the camera.

    - gains: (N, 3), by which photographs are divided to be alike; their geometric mean is 1
    - light: (3,), by which the logarithm of the light on a surface is linear in its normal in the
      optical frame; full_light: that logarithm where the light is full
    """

    gains: NDArray[np.float64]
    light: NDArray[np.float64]
    full_light: float

    def evened(self, colors: NDArray[np.float32],
               normals: NDArray[np.floating]) -> NDArray[np.float32]:
        """Return colours (N, V, 3) as in full light, from normals (N, V, 3) in optical frames."""
        shade = np.minimum(normals @ self.light - self.full_light, 0)
        return np.asarray(colors / self.gains[:, None] / np.exp(shade)[..., None], np.float32)


def find_exposure(colors: NDArray[np.float32], weights: NDArray[np.float32],
                  normals: NDArray[np.floating]) -> Exposure:
    """
    Return what makes colours alike of points that several photographs show.

    `colors` are (N, V, 3), 0 to 255, of V points in N photographs; `weights` (N, V), 0 where a
    photograph does not show a point; `normals` (N, V, 3) of the surface in the optical frames.
    The logarithm of a colour is that of the point, of the photograph's gain, and of the light:
    linear in the normal in the optical frame, about as of a lamp beside the camera in front of a
    turntable. Light that stands still with the object is part of its colours.
    Weighted least squares with the points' colours eliminated, where samples that fit badly weigh
    less in each round; then a gain for each channel.
    """
    some = slice(None, None, max(colors.shape[1] // _POINTS, 1))
    logs = np.log(colors[:, some].astype(np.float64) + _OFFSET)
    trusted = weights[:, some] * (colors[:, some].max(axis=2) < _CLIPPED)
    terms = normals[:, some].astype(np.float64)
    if not trusted.any():
        return Exposure(np.ones((len(colors), 3)), np.zeros(terms.shape[2]), 0.0)
    gain, light = _solved(logs.mean(axis=2), trusted, terms)
    bare = logs - (gain[:, None] + terms @ light)[..., None]
    tints = [_solved(bare[..., channel], trusted, terms[..., :0])[0] for channel in range(3)]
    gains = gain[:, None] + np.stack(tints, axis=1)
    full = np.percentile((terms @ light)[trusted > 0.1 * trusted.max()], _FULL)
    return Exposure(np.exp(gains), light, float(full))


def _solved(logs: NDArray[np.float64], trusted: NDArray[np.float64],
            terms: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the gains (N,) and coefficients (K,) that explain logarithms (N, V), robustly."""
    weights = trusted
    count = len(logs)
    for _ in range(_ROUNDS):
        total = np.maximum(weights.sum(axis=0), 1e-12)
        mean = (weights * logs).sum(axis=0) / total
        own = terms - np.einsum('nv,nvk->vk', weights, terms) / total[:, None]
        crossed = np.einsum('nv,nvk->nk', weights, own)
        weighted = weights[..., None] * own
        system = np.block([
            [np.diag(weights.sum(axis=1)) - (weights / total) @ weights.T, crossed],
            [crossed.T, np.einsum('nvk,nvl->kl', weighted, own)]])
        wanted = np.concatenate([(weights * (logs - mean)).sum(axis=1),
                                 np.einsum('nvk,nv->k', weighted, logs - mean)])
        prior = _PRIOR * weights.sum() / count * np.eye(len(system))
        found = np.linalg.solve(system + prior, wanted)
        bare = logs - found[:count, None] - terms @ found[count:]
        away = bare - (weights * bare).sum(axis=0) / total
        weights = trusted / (1 + (away / _TOLERANCE) ** 2)
    gains = found[:count] - np.average(found[:count], weights=trusted.sum(axis=1))
    return gains, found[count:]
