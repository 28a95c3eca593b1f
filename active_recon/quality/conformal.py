"""Conformal quantiles and p-values: exact for any distribution of exchangeable values."""

from collections.abc import Sequence
import math

import numpy as np
from numpy.typing import ArrayLike


def upper_quantile(scores: ArrayLike, miss: float) -> float:
    """
    Return what a new score exceeds with a probability of at most `miss`, in (0, 1).

    That is the ceil((n + 1) (1 - miss))-th smallest of n scores (Vovk 2005; Lei 2018, split
    conformal); infinite where there are too few.
    """
    ordered = np.sort(np.asarray(scores, np.float64))
    rank = math.ceil((len(ordered) + 1) * (1 - miss) - 1e-9)
    return float(ordered[rank - 1]) if rank <= len(ordered) else math.inf


def p_value(score: float, ordered: Sequence[float]) -> float:
    """
    Return the conformal p-value of a score, in (0, 1]; a high score is unusual.

    `ordered` are n scores of usual things, increasing. Of a usual thing, it is at most a with a
    probability of at most a.
    """
    above = len(ordered) - int(np.searchsorted(ordered, score, 'left'))
    return (above + 1) / (len(ordered) + 1)
