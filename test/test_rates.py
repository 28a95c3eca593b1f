"""Rates and percentiles over a window: right for steady streams, and bounded for all others."""

import math
import sys

from active_recon.nodes.runtime.rates import Durations, Rate, WINDOW_S
import numpy as np
import pytest


def stream(hertz, seconds, began=100.0):
    """Return a rate after a steady stream, and the time of its last event."""
    rate = Rate(began)
    times = began + np.arange(1, round(hertz * seconds) + 1) / hertz
    for at in times:
        rate.add(at)
    return rate, times[-1]


@pytest.mark.parametrize('hertz', [0.5, 2.0, 10.0, 29.97, 1000.0])
@pytest.mark.parametrize('seconds', [4.0, 60.0])
def test_a_steady_stream_has_its_own_rate(hertz, seconds):
    rate, last = stream(hertz, seconds)
    one_event = 1 / (WINDOW_S - 0.25)
    assert rate.per_second(last) == pytest.approx(hertz, abs=1.1 * one_event)


def test_a_stream_that_ends_fades_to_nothing_within_the_window():
    rate, last = stream(10.0, 20.0)
    rates = [rate.per_second(last + after) for after in np.linspace(0, WINDOW_S, 40)]
    assert all(later <= earlier * 1.06 for earlier, later in zip(rates, rates[1:], strict=False))
    assert rates[-1] == 0


def test_a_rate_begins_with_nothing_and_forgets_no_event_of_its_first_seconds():
    rate = Rate(100.0)
    assert rate.per_second(100.0) == 0
    for at in (100.1, 100.6, 101.0):
        rate.add(at)
    assert rate.per_second(102.0) == pytest.approx(1.5)


def test_memory_does_not_grow_with_the_events():
    rate, _ = stream(10.0, 100.0)
    storm, _ = stream(1000.0, 100.0)
    assert sys.getsizeof(rate._buckets) == sys.getsizeof(storm._buckets)
    assert len(rate._buckets) == len(storm._buckets)


def test_percentiles_are_those_of_the_latest_durations():
    durations = Durations()
    for seconds in range(1000):
        durations.add(seconds)
    assert durations.percentile(0) == 800
    assert durations.percentile(50) == pytest.approx(899.5)
    assert durations.percentile(100) == 999


def test_percentiles_of_nothing_are_not_a_number():
    assert math.isnan(Durations().percentile(50))
