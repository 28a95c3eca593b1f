"""
Means and their 95 % intervals: objects, starts and seeds are drawn anew, pairs are kept.

Values are (objects,), (objects, starts) or (objects, starts, seeds). Every level is resampled by
itself and the three draws are crossed, as in the pigeonhole bootstrap (Owen 2007), which errs on
the side of intervals that are too wide. All that is compared is resampled by the same draws: what
two policies share, such as an object that is hard for both, leaves their difference alone. Seeds
are paired where both have as many.
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

    Raises DataError unless each object has as many episodes, one after the other.
    """
    count = int(np.unique(objects).size)
    grid = objects.reshape(count, -1) if len(objects) % count == 0 else objects[None]
    if (grid != grid[:, :1]).any():
        raise DataError('uneven or mixed episodes: expected as many of every object, one after '
                        'the other')
    return values.reshape(*grid.shape, *values.shape[1:])


def resampled_means(values: Values, rounds: int = _ROUNDS, seed: int = 0) -> Values:
    """Return the mean of values under every draw, (rounds,)."""
    values = values.reshape(values.shape + (1,) * (3 - values.ndim))
    sizes: tuple[int, ...] = values.shape
    objects, starts, seeds = (_weights(size, rounds, seed, level)
                              for level, size in enumerate(sizes))
    of_objects = (objects @ values.reshape(sizes[0], -1)).reshape(rounds, *sizes[1:])
    return np.asarray(np.einsum('rsk,rs,rk->r', of_objects, starts, seeds, optimize=True))


def mean_interval(values: Values, rounds: int = _ROUNDS, seed: int = 0) -> Interval:
    """Return the mean of values and its interval."""
    return _interval(values.mean(), resampled_means(values, rounds, seed))


def difference(values: Values, others: Values, rounds: int = _ROUNDS, seed: int = 0) -> Interval:
    """Return the mean of values minus that of others, paired, and its interval."""
    _refuse_others(values, others)
    return _interval(values.mean() - others.mean(), resampled_means(values, rounds, seed)
                     - resampled_means(others, rounds, seed))


def gap_closed(values: Values, random: Values, oracle: Values, rounds: int = _ROUNDS,
               seed: int = 0) -> Interval | None:
    """
    Return the share of the gap between random and oracle that values close, and its interval.

    0 is random's, 1 the oracle's, below 0 is worse than random. None where the oracle is not
    surely ahead of random: there is no gap to take a share of.
    """
    _refuse_others(values, random, oracle)
    if difference(oracle, random, rounds, seed).low <= 0:
        return None
    floor, top, own = (resampled_means(each, rounds, seed) for each in (random, oracle, values))
    share = (values.mean() - random.mean()) / (oracle.mean() - random.mean())
    ahead = top > floor  # the few rounds where it is not have no gap to take a share of
    return _interval(share, (own - floor)[ahead] / (top - floor)[ahead])


def headroom_sentence(headroom: Interval) -> str:
    """Say what choosing views can gain at most; headroom is the oracle's mean minus random's."""
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
    """Return how much each of `count` weighs in every draw, (rounds, count); rows sum to 1."""
    drawn = np.random.default_rng([seed, level, count]).integers(count, size=(rounds, count))
    drawn += np.arange(rounds)[:, None] * count
    times = np.bincount(drawn.ravel(), minlength=rounds * count).reshape(rounds, count)
    return times / count


def _refuse_others(*samples: Values) -> None:
    shapes = {np.shape(sample)[:2] for sample in samples}
    if len(shapes) > 1:
        raise DataError('values not paired: expected those of the same objects and starts, got '
                        f'{", ".join(map(str, shapes))}')
