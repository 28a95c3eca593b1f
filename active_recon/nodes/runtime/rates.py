"""Rates and durations over a window, in bounded memory."""

from collections import deque
import math

import numpy as np

WINDOW_S = 5.0
"""Window over which a rate is measured."""
_BUCKETS = 20
_SAMPLES = 200


class Rate:
    """
    Events per second over the last `WINDOW_S` seconds, or since the beginning if that is later.

    Times are seconds of a monotonic clock. Events are counted in buckets of 0.25 s, so memory is
    bounded and the window is accurate to a bucket.
    """

    def __init__(self, began: float) -> None:
        self._began = began
        self._buckets: deque[list[int]] = deque(maxlen=_BUCKETS)

    def add(self, at: float) -> None:
        """Count an event."""
        bucket = _bucket(at)
        if not self._buckets or self._buckets[-1][0] != bucket:
            self._buckets.append([bucket, 0])
        self._buckets[-1][1] += 1

    def per_second(self, at: float) -> float:
        """Return the rate at a time, 0 without events in the window."""
        first = _bucket(at) - _BUCKETS + 1
        since = max(self._began, first * WINDOW_S / _BUCKETS)
        events = sum(count for bucket, count in self._buckets if bucket >= first)
        return events / max(at - since, WINDOW_S / _BUCKETS)


class Durations:
    """The latest 200 durations, seconds, and their percentiles."""

    def __init__(self) -> None:
        self._samples: deque[float] = deque(maxlen=_SAMPLES)

    def add(self, seconds: float) -> None:
        """Add a duration; it replaces the oldest one."""
        self._samples.append(seconds)

    def percentile(self, percent: float) -> float:
        """Return a percentile, 0 to 100, interpolated; NaN before the first duration."""
        return float(np.percentile(self._samples, percent)) if self._samples else math.nan


def _bucket(at: float) -> int:
    return math.floor(at * _BUCKETS / WINDOW_S)
