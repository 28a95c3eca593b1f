"""Intervals by resampling objects, starts and seeds, and the share of a gap."""

from active_recon.errors import DataError
from active_recon.evaluation.statistics import (
    by_object,
    difference,
    gap_closed,
    headroom_sentence,
    Interval,
    mean_interval,
    resampled_means,
    views_to_reach,
)
import numpy as np
import pytest

SHAPES = [(12,), (12, 4), (12, 4, 3)]


def width(interval):
    return interval.high - interval.low


def drawn(rng, objects=30, starts=6, seeds=4, spread=(1.0, 0.3, 0.3, 0.3)):
    """Return values whose objects, starts and seeds differ by a spread each, and noise."""
    levels = [(objects, 1, 1), (1, starts, 1), (1, 1, seeds), (objects, starts, seeds)]
    return sum(scale * rng.normal(size=shape)
               for scale, shape in zip(spread, levels, strict=True))


@pytest.mark.parametrize('shape', SHAPES)
def test_a_constant_leaves_no_doubt(shape):
    found = mean_interval(np.full(shape, 0.7))
    assert (found.mean, found.low, found.high) == pytest.approx((0.7, 0.7, 0.7), abs=1e-12)


@pytest.mark.parametrize('shape', SHAPES)
def test_the_draws_lie_about_the_mean_and_repeat_with_their_seed(shape):
    values = np.random.default_rng(0).random(shape)
    draws = resampled_means(values)
    assert draws.shape == (2000,)
    assert draws.mean() == pytest.approx(values.mean(), abs=4 * draws.std() / np.sqrt(2000))
    assert draws.min() >= values.min()
    assert draws.max() <= values.max()
    np.testing.assert_array_equal(draws, resampled_means(values))
    assert (draws != resampled_means(values, seed=1)).any()


def test_a_draw_weighs_objects_starts_and_seeds_each_by_itself():
    rng = np.random.default_rng(0)
    parts = rng.random(9), rng.random(5), rng.random(3)
    product = parts[0][:, None, None] * parts[1][:, None] * parts[2]
    ones = [np.ones_like(part) for part in parts]
    single = [resampled_means(np.einsum('o,s,k->osk', *ones[:level], parts[level],
                                        *ones[level + 1:])) for level in range(3)]
    np.testing.assert_allclose(resampled_means(product), np.prod(single, axis=0))


def test_the_interval_covers_the_truth_about_as_often_as_it_says():
    rng, rounds, hits = np.random.default_rng(0), 300, 0
    for _ in range(rounds):
        found = mean_interval(drawn(rng, 40, 12, 12, (1, 0.2, 0.2, 0.5)), rounds=400)
        hits += found.low <= 0 <= found.high
    assert 0.91 <= hits / rounds <= 0.99


def test_doubt_about_any_level_alone_widens_the_interval():
    rng = np.random.default_rng(0)
    for level in range(3):
        spread = np.zeros(4)
        spread[level] = 1
        assert width(mean_interval(drawn(rng, spread=spread))) > 0.3


def test_more_objects_narrow_the_interval():
    values = drawn(np.random.default_rng(0), 400, 3, 1, (1, 0, 0, 0.3))
    widths = [width(mean_interval(values[:count])) for count in (25, 100, 400)]
    assert widths[0] > 1.5 * widths[1] > 1.5 ** 2 * widths[2]


def test_more_episodes_of_the_same_objects_narrow_little():
    values = np.random.default_rng(0).random((20, 1))
    once, many = mean_interval(values), mean_interval(np.repeat(values, 24, axis=1))
    assert width(many) == pytest.approx(width(once))


@pytest.mark.parametrize('seeds', [1, 4])
def test_what_two_share_does_not_widen_their_difference(seeds):
    rng = np.random.default_rng(0)
    values, others = drawn(rng, seeds=seeds), drawn(rng, seeds=seeds)
    shared = 10 * drawn(rng, seeds=seeds)
    apart, together = difference(values, others), difference(values + shared, others + shared)
    assert together.mean == pytest.approx(apart.mean)
    assert width(together) == pytest.approx(width(apart))
    assert width(mean_interval(values + shared)) > 5 * width(apart)


def test_a_policy_of_one_seed_is_compared_with_one_of_many():
    rng = np.random.default_rng(0)
    values = drawn(rng, seeds=1, spread=(1, 0.3, 0, 0))
    found = difference(values + 0.1, values + 0.001 * rng.normal(size=(30, 6, 5)))
    assert found.low < 0.1 < found.high
    assert width(found) < 0.005


def test_the_difference_of_something_from_itself_is_zero():
    values = drawn(np.random.default_rng(0))
    assert difference(values, values) == Interval(0, 0, 0)


def test_the_share_of_the_gap_is_none_of_random_and_all_of_the_oracle():
    rng = np.random.default_rng(0)
    random = drawn(rng, spread=(1, 0.1, 0.1, 0.1))
    oracle = random[..., :1] + rng.uniform(0.1, 0.3, size=(30, 6, 1))
    assert gap_closed(random, random, oracle) == Interval(0, 0, 0)
    assert gap_closed(oracle, random, oracle) == Interval(1, 1, 1)
    halfway = gap_closed((random + oracle) / 2, random, oracle)
    assert (halfway.mean, halfway.low, halfway.high) == pytest.approx((0.5, 0.5, 0.5))
    assert gap_closed(random - 0.1, random, oracle).high < 0


def test_a_gap_that_may_be_none_has_no_share():
    random = drawn(np.random.default_rng(0))
    noise = np.random.default_rng(1).normal(size=random.shape)
    assert gap_closed(random, random, random) is None
    assert gap_closed(random, random, random + noise) is None
    assert gap_closed(random, random, random - 0.1) is None


@pytest.mark.parametrize(('mean', 'words'), [
    (0.0049, 'under 0.005: on these objects no policy can gain'), (0.02, 'can gain at most')])
def test_small_headroom_is_said(mean, words):
    told = headroom_sentence(Interval(mean, mean - 0.001, mean + 0.001))
    assert f'{mean:.4f} [' in told
    assert words in told


def test_what_is_not_paired_is_not_compared():
    with pytest.raises(DataError, match='not paired: expected those of the same objects and '
                       'starts'):
        difference(np.zeros((4, 2)), np.zeros((5, 2)))
    with pytest.raises(DataError, match='not paired: expected those of the same objects and '
                       'starts'):
        gap_closed(np.zeros((4, 2)), np.zeros((4, 2)), np.ones((4, 3)))


def test_episodes_are_gathered_by_object():
    values = np.arange(12).reshape(6, 2)
    found = by_object(values, np.array([5, 5, 2, 2, 7, 7]))
    assert found.shape == (3, 2, 2)
    np.testing.assert_array_equal(found[1], values[2:4])


@pytest.mark.parametrize('objects', [[0, 0, 0, 1], [0, 1, 1], [0, 1, 0, 1]])
def test_episodes_that_differ_in_number_or_are_mixed_are_refused(objects):
    with pytest.raises(DataError, match='mixed episodes: expected the same number of'):
        by_object(np.zeros(len(objects)), np.array(objects))


def test_views_to_reach_a_level_are_where_the_mean_curve_crosses_it():
    curve = np.broadcast_to([0.2, 0.4, 0.5, 0.55], (6, 2, 1, 4))
    ends = np.broadcast_to([0.1, 0.2, 0.3, 0.45], (6, 2, 3, 4))
    found = views_to_reach(curve, ends)
    assert (found.mean, found.low, found.high) == pytest.approx((2.5, 2.5, 2.5))
    assert views_to_reach(ends, curve).mean == 4  # it does not get there
    assert views_to_reach(curve, curve - 0.6).mean == 1
    drawn_ends = ends + np.random.default_rng(0).normal(0, 0.1, (6, 1, 1, 1))
    spread = views_to_reach(curve, drawn_ends)
    assert 1 <= spread.low < spread.mean < spread.high <= 4
