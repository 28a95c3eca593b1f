"""Means over views and over categories, with their 95 % intervals."""

from active_recon.evaluation.statistics import Interval, mean_interval, Values
import numpy as np
from numpy.typing import NDArray


def per_view(values: Values) -> list[Interval]:
    """Return mean and interval after each of T views, of values (N, S, T): N objects, S starts."""
    return [mean_interval(values[..., view]) for view in range(values.shape[-1])]


def unweighted(values: Values, categories: NDArray[np.str_], rounds: int = 2000,
               seed: int = 0) -> Interval:
    """
    Return the mean over categories of their means, with its 95 % interval, of values (N, S).

    Every category has the same weight. The interval is from a bootstrap over the objects within
    each category.
    """
    rng = np.random.default_rng(seed)
    rows = values.reshape(len(values), -1).mean(axis=1)
    means, draws = [], []
    for name in np.unique(categories):
        own = rows[categories == name]
        means.append(own.mean())
        draws.append(own[rng.integers(len(own), size=(rounds, len(own)))].mean(axis=1))
    low, high = np.percentile(np.mean(draws, axis=0), [2.5, 97.5])
    return Interval(float(np.mean(means)), float(low), float(high))
