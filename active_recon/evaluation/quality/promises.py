"""
When an episode may stop, so that what it promises is kept: Learn then Test.

A bound that holds after a fixed number of views need not hold where it chooses when to stop: the
episodes that stop are those whose quality is overestimated. So the rule is calibrated, on episodes
that follow it (Angelopoulos et al. 2021, arXiv 2110.01052): margins are tested from the largest
down, each with an exact binomial test, until one is not proven to keep the promise. The test takes
episodes that are independent: one of each object.
"""

from dataclasses import dataclass

from active_recon.errors import DataError
from active_recon.evaluation.quality.measuring import Measured
import numpy as np
from numpy.typing import NDArray
from scipy.stats import beta, binom

BROKEN = 0.1
"""The share of the stopped episodes that may be below what they promised."""
ERROR = 0.1
"""The probability that the calibrated rule breaks more promises than that."""
FEWEST = 38  # episodes that prove it with one broken promise at most
MARGINS: NDArray[np.float64] = np.arange(0.4, -0.305, -0.01)
NEVER = 2.0
"""An expected IoU that no reconstruction has: the target cannot be promised."""


@dataclass(frozen=True, eq=False)
class Episodes:
    """Expected and true IoU of E episodes after 1 to K views, (E, K) each, NaN where unknown."""

    expected: NDArray[np.float64]
    iou: NDArray[np.float64]

    @classmethod
    def of(cls, measured: Measured, expected: NDArray[np.float64]) -> 'Episodes':
        """
        Return the episodes that were measured, with expected IoU (N,).

        Raises DataError where one is there twice: of the two, the rule would know one alone.
        """
        names, rows = np.unique(measured.episode, return_inverse=True)
        found = np.full((2, len(names), int(measured.count.max())), np.nan)
        again = np.bincount(rows * found.shape[2] + measured.count - 1) > 1
        if again.any():
            name = str(names[again.argmax() // found.shape[2]])
            raise DataError('quality: an episode measured twice: expected an object once for a '
                            f'kind of views and a seed, got two of {name!r}; leave a file out, or '
                            'measure one with another --seed')
        found[:, rows, measured.count - 1] = expected, measured.iou
        return cls(*found)

    def stops(self, needed: float) -> NDArray[np.int64]:
        """Return after which view (0 for the first) each stops, -1 where it does not, (E,)."""
        enough = np.nan_to_num(self.expected, nan=-1.0) >= needed
        return np.where(enough.any(axis=1), enough.argmax(axis=1), -1)

    def stopped(self, needed: float) -> NDArray[np.float64]:
        """Return the true IoU of the episodes that stop, where they do, (S,)."""
        at = self.stops(needed)
        rows = np.flatnonzero(at >= 0)
        return self.iou[rows, at[rows]]


def one_of_each(measured: Measured) -> NDArray[np.bool_]:
    """
    Return which rows are of one episode of each object in each kind of views, (N,).

    That is the one of most views; of several, the first by its name.
    """
    _, first, sizes = np.unique(measured.episode, return_index=True, return_counts=True)
    longest = first[np.argsort(-sizes, kind='stable')]
    named = np.stack([measured.object[longest], measured.kind[longest]], axis=1)
    _, place = np.unique(named, axis=0, return_index=True)
    return np.isin(measured.episode, measured.episode[longest[place]])


def needed_for(target: float, episodes: Episodes) -> float:
    """Return the expected IoU at which a target may be promised; NEVER where none is proven."""
    proven = NEVER
    for margin in MARGINS:
        ious = episodes.stopped(target + margin)
        if len(ious) < FEWEST:
            continue  # by the expected IoU alone, which does not know the truth
        if binom.cdf((ious < target).sum(), len(ious), BROKEN) > ERROR:
            break
        proven = float(target + margin)
    return proven


def kept_at_least(kept: int, count: int, error: float = 0.05) -> float:
    """Return the exact (Clopper-Pearson) lower bound of a share, of `kept` out of `count`."""
    return float(beta.ppf(error, kept, count - kept + 1)) if kept else 0.0
