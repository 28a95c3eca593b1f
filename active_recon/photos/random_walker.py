"""
Shares that are alike in neighbours without an edge between them.

Grady, "Multilabel random walker image segmentation using prior models", CVPR 2005.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

_TOLERANCE = 1e-3  # of what is left, relative to the right side
_MOST_STEPS = 60
Plane = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Ties:
    """How strongly neighbours are tied: across, (H, W - 1), and down, (H - 1, W)."""

    across: Plane
    down: Plane

    def degrees(self) -> Plane:
        """Return the sum of each pixel's ties, (H, W)."""
        sums = np.zeros((self.across.shape[0], self.down.shape[1]), np.float32)
        sums[:, :-1] += self.across
        sums[:, 1:] += self.across
        sums[:-1] += self.down
        sums[1:] += self.down
        return sums


def smoothed(ties: Ties, own: Plane, certain: Plane) -> Plane:
    """
    Return each pixel's share, (H, W), alike in tied neighbours.

    `own` is a pixel's share by itself, `certain` how much that weighs against its ties. Minimises
    the sum of certain (x - own)^2 over all pixels and of tie (x - x')^2 over all neighbours.
    """
    diagonal = ties.degrees() + certain

    def applied(x: Plane) -> Plane:
        found = diagonal * x
        found[:, :-1] -= ties.across * x[:, 1:]
        found[:, 1:] -= ties.across * x[:, :-1]
        found[:-1] -= ties.down * x[1:]
        found[1:] -= ties.down * x[:-1]
        return found

    # Conjugate gradients, by hand: sparse matrices take five times as long, and BLAS, which
    # scipy's are made of, many times as long where other programs keep the cores busy
    inverse, right = 1 / diagonal, certain * own
    found, left = own.copy(), right - applied(own)
    enough = _TOLERANCE ** 2 * _dot(right, right)
    step, before = np.zeros_like(own), 1.0
    for _ in range(_MOST_STEPS):
        if _dot(left, left) <= enough:
            break
        turned = inverse * left
        now = _dot(left, turned)
        step = turned + np.float32(now / before) * step
        moved = applied(step)
        by = np.float32(now / _dot(step, moved))
        found += by * step
        left -= by * moved
        before = now
    return np.asarray(found)


def _dot(a: Plane, b: Plane) -> float:
    return float(np.einsum('ij,ij->', a, b))
