"""Probabilities of a volume that nothing in it makes symmetric."""

import numpy as np


def some_volume(seed=0, side=32):
    """Return probabilities of a blob that fades out, with nothing alike, (side, side, side)."""
    across = (np.arange(side) + 0.5) / side - 0.5
    x, y, z = np.meshgrid(across - 0.1, 1.5 * across, across + 0.05, indexing='ij')
    rng = np.random.default_rng(seed)
    blurred = 1 / (1 + np.exp(25 * (np.sqrt(x ** 2 + y ** 2 + z ** 2) - 0.3)))
    return (blurred * rng.uniform(0.5, 1, blurred.shape)).astype(np.float32)
