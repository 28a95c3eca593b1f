"""Images that are missing: told where a camera streams, never where it only looks so."""

from active_recon.bags.runs.image_gaps import FEWEST, gaps_between, ImageGaps, uncounted_images
import numpy as np
import pytest

BEGIN = 1_700_000_000_000_000_000
MS = 1_000_000


def stream(count, period_ms=100, jitter_ms=0, seed=0):
    late = np.random.default_rng(seed).uniform(0, jitter_ms, count) * MS
    return [BEGIN + number * period_ms * MS + int(late[number]) for number in range(count)]


@pytest.mark.parametrize('jitter_ms', [0, 20])
def test_a_stream_without_gaps_misses_nothing(jitter_ms):
    found = gaps_between(stream(50, jitter_ms=jitter_ms))
    assert found.period_s == pytest.approx(0.1, rel=0.1)
    assert (found.missing, found.longest_s) == (0, 0)


@pytest.mark.parametrize('lost', [[20], [20, 21, 22], [5, 20, 21, 40]])
@pytest.mark.parametrize('jitter_ms', [0, 20])
def test_what_was_lost_is_counted_and_the_longest_gap_told(lost, jitter_ms):
    stamps = stream(50, jitter_ms=jitter_ms)
    left = [stamp for number, stamp in enumerate(stamps) if number not in lost]
    found = gaps_between(left)
    assert found.missing == len(lost)
    assert found.longest_s == pytest.approx(max(np.diff(left)) / 1e9)


def test_neither_the_order_nor_a_second_copy_matters():
    stamps = stream(30)
    del stamps[10]
    assert gaps_between([*reversed(stamps), *stamps[:5]]) == gaps_between(stamps)


def test_between_the_times_of_a_clock_that_went_back_nothing_is_missing():
    late, early = stream(30), [stamp - 10**12 for stamp in stream(40)]
    del late[10], early[20]
    received = [time - 10 * MS for time in stream(len(late) + len(early))]
    found = gaps_between([*late, *early], received)
    assert (found.missing, found.longest_s) == (2, pytest.approx(0.2))
    assert gaps_between([*late, *early]).missing > 1000  # without them that is not known


def test_a_camera_that_takes_its_images_one_by_one_misses_none():
    rng = np.random.default_rng(0)
    by_hand = np.cumsum(rng.uniform(500, 9000, 40)) * MS
    assert gaps_between([BEGIN + int(time) for time in by_hand]) == ImageGaps()
    assert gaps_between(stream(FEWEST - 1)) == ImageGaps()
    assert gaps_between([]) == ImageGaps()


def counted(*images):
    """Return counts once a second, of which the first comes with the first image."""
    return [(BEGIN + number * 1000 * MS, {'images': count}) for number, count in enumerate(images)]


def test_images_that_the_loop_did_not_count_are_those_between_the_counts():
    assert uncounted_images(stream(100), counted(0, 10, 20, 30)) == 0
    assert uncounted_images(stream(100), counted(500, 510, 511, 512)) == 18
    assert uncounted_images(stream(100), counted(0, 9, 19, 28)) == 0  # on their way


def test_counts_that_cannot_be_compared_say_nothing():
    assert uncounted_images(stream(100), counted(7)) is None
    assert uncounted_images(stream(100), counted(50, 60, 3, 13)) is None
    assert uncounted_images(stream(100), [(BEGIN, {'views': 3})] * 2) is None
