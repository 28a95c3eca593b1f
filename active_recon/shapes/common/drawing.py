"""Random draws that the categories share."""

from collections.abc import Mapping
from typing import TypeVar

import numpy as np

T = TypeVar('T')


def choose(rng: np.random.Generator, weights: Mapping[T, float]) -> T:
    """Return one of the keys, drawn by their weights, which need not sum to 1."""
    values = np.array([*weights.values()], np.float64)
    return list(weights)[rng.choice(len(values), p=values / values.sum())]
