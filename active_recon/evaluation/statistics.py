"""
Means and their 95 % intervals, by bootstrap over objects, starts and seeds.

Values are (objects,), (objects, starts) or (objects, starts, seeds). Each level is resampled
independently and the three draws are crossed, as in the pigeonhole bootstrap (Owen 2007), whose
intervals tend to be too wide rather than too narrow. Compared values are resampled by the same
draws, so that common effects, for example of an object that is difficult for both policies,
cancel in the difference. Seeds are paired where both have equally many.
"""

from dataclasses import dataclass
from functools import lru_cache

from active_recon.errors import DataError
import numpy as np
from numpy.typing import NDArray

Values = NDArray[np.float64]
SMALL_HEADROOM = 0.005
_ROUNDS = 2000


@dataclass(frozen=True)
class Interval:
    """A mean and the ends of its 95 % interval."""

    mean: float
    low: float
    high: float


def by_object(values: Values, objects: NDArray[np.int64]) -> Values:
    """
    Return values of episodes (E, ...) as (objects, starts, ...).

    Raises DataError unless every object has the same number of episodes, in consecutive rows.
    """
    count = int(np.unique(objects).size)
    grid = objects.reshape(count, -1) if len(objects) % count == 0 else objects[None]
    if (grid != grid[:, :1]).any():
        raise DataError('uneven or mixed episodes: expected the same number of every object, in '
                        'consecutive rows')
    return values.reshape(*grid.shape, *values.shape[1:])


def resampled_means(values: Values, rounds: int = _ROUNDS, seed: int = 0) -> Values:
    """Return the mean of values in each bootstrap draw, (rounds,)."""
    values = values.reshape(values.shape + (1,) * (3 - values.ndim))
    sizes: tuple[int, ...] = values.shape
    objects, starts, seeds = (_weights(size, rounds, seed, level)
                              for level, size in enumerate(sizes))
    of_objects = (objects @ values.reshape(sizes[0], -1)).reshape(rounds, *sizes[1:])
    return np.asarray(np.einsum('rsk,rs,rk->r', of_objects, starts, seeds, optimize=True))


def mean_interval(values: Values, rounds: int = _ROUNDS, seed: int = 0) -> Interval:
    """Return the mean of values and its 95 % interval."""
    return _interval(values.mean(), resampled_means(values, rounds, seed))


def difference(values: Values, others: Values, rounds: int = _ROUNDS, seed: int = 0) -> Interval:
    """
    Return the mean of values minus that of others, and its 95 % interval, paired.

    Raises DataError where they have different numbers of objects or starts.
    """
    _require_paired(values, others)
    return _interval(values.mean() - others.mean(), resampled_means(values, rounds, seed)
                     - resampled_means(others, rounds, seed))


def gap_closed(values: Values, random: Values, oracle: Values, rounds: int = _ROUNDS,
               seed: int = 0) -> Interval | None:
    """
    Return the fraction of the gap between random and oracle that values close, and its interval.

    0 is random, 1 the oracle, below 0 is worse than random. None where the oracle is not
    significantly better than random, so that there is no gap. Raises DataError as `difference`.
    """
    _require_paired(values, random, oracle)
    if difference(oracle, random, rounds, seed).low <= 0:
        return None
    floor, top, own = (resampled_means(each, rounds, seed) for each in (random, oracle, values))
    share = (values.mean() - random.mean()) / (oracle.mean() - random.mean())
    ahead = top > floor  # in the few other draws there is no gap
    return _interval(share, (own - floor)[ahead] / (top - floor)[ahead])


def views_to_reach(values: Values, others: Values, rounds: int = _ROUNDS, seed: int = 0
                   ) -> Interval:
    """
    Return after how many views the mean of values is where that of others ends, and its interval.

    Both are (objects, starts, seeds, T), of 1 to T views; between two views the mean is linear.
    What is not reached counts as T. Raises DataError as `difference`.
    """
    _require_paired(values, others)
    curves = np.stack([resampled_means(of_view, rounds, seed)
                       for of_view in np.moveaxis(values, -1, 0)])
    ends = resampled_means(others[..., -1], rounds, seed)
    return _interval(_crossing(values.mean(axis=(0, 1, 2)), float(others[..., -1].mean())),
                     np.array([_crossing(curve, float(end))
                               for curve, end in zip(curves.T, ends, strict=True)]))


def _crossing(curve: Values, level: float) -> float:
    """Return where a curve of 1 to T views first reaches a level, T where it does not."""
    reached = np.flatnonzero(curve >= level)
    if not len(reached):
        return float(len(curve))
    after = int(reached[0])
    if after == 0:
        return 1.0
    below = curve[after - 1]
    return float(after + (level - below) / (curve[after] - below))


def headroom_sentence(headroom: Interval) -> str:
    """Return a sentence on the headroom of view policies: the oracle's mean minus random's."""
    spread = f'{headroom.mean:.4f} [{headroom.low:.4f}, {headroom.high:.4f}]'
    sentence = f'An oracle that sees the truth is ahead of random by {spread}'
    if headroom.mean < SMALL_HEADROOM:
        return (f'{sentence}, under {SMALL_HEADROOM}: on these objects no policy can gain '
                'anything that matters by choosing its views.')
    return f'{sentence}: that is what choosing views can gain at most.'


def _interval(mean: float, draws: Values) -> Interval:
    low, high = np.percentile(draws, [2.5, 97.5])
    return Interval(float(mean), float(low), float(high))


@lru_cache(maxsize=32)
def _weights(count: int, rounds: int, seed: int, level: int) -> Values:
    """Return the weight of each of `count` items in every draw, (rounds, count); rows sum to 1."""
    drawn = np.random.default_rng([seed, level, count]).integers(count, size=(rounds, count))
    drawn += np.arange(rounds)[:, None] * count
    times = np.bincount(drawn.ravel(), minlength=rounds * count).reshape(rounds, count)
    return times / count


def _require_paired(*samples: Values) -> None:
    shapes = {np.shape(sample)[:2] for sample in samples}
    if len(shapes) > 1:
        raise DataError('values not paired: expected those of the same objects and starts, got '
                        f'{", ".join(map(str, shapes))}')
