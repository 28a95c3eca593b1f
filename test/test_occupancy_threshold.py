"""The threshold of one object keeps the set of cells whose expected IoU is highest."""

from active_recon.volumes.occupancy_threshold import best_threshold, expected_iou
from active_recon.volumes.voxels import iou
import numpy as np
import pytest


def some(seed, cells=40):
    """Return occupancies of a few kinds: sure ones, doubtful ones, all."""
    rng = np.random.default_rng(seed)
    sharpness = rng.choice([0.2, 1.0, 3.0])
    return rng.beta(sharpness, sharpness, cells).astype(np.float32)


@pytest.mark.parametrize('seed', range(5))
def test_what_is_certain_is_expected_exactly(seed):
    truth = np.random.default_rng(seed).random((4, 4, 4)) < 0.3
    other = np.random.default_rng(seed + 100).random((4, 4, 4)) < 0.3
    assert expected_iou(truth.astype(float), other) == pytest.approx(iou(other, truth))
    threshold, expected = best_threshold(truth.astype(np.float32))
    assert (threshold, expected) == (0.5, 1.0)
    np.testing.assert_array_equal(truth > threshold, truth)


@pytest.mark.parametrize('seed', range(20))
def test_no_other_set_is_expected_to_do_better(seed):
    occupancy = some(seed)
    threshold, expected = best_threshold(occupancy)
    assert expected_iou(occupancy, occupancy > threshold) == pytest.approx(expected)
    rng = np.random.default_rng(seed)
    for _ in range(200):
        kept = (occupancy > threshold) ^ (rng.random(occupancy.shape) < rng.choice([0.02, 0.3]))
        assert expected_iou(occupancy, kept) <= expected + 1e-9
    for at in occupancy:
        assert expected_iou(occupancy, occupancy > at) <= expected + 1e-9


@pytest.mark.parametrize('seed', range(5))
def test_threshold_and_expectation_agree(seed):
    threshold, expected = best_threshold(some(seed))
    assert threshold == pytest.approx(expected / (1 + expected))
    assert 0 < threshold <= 0.5


@pytest.mark.parametrize('seed', range(5))
def test_the_order_of_the_cells_says_nothing(seed):
    occupancy = some(seed, 64)
    shuffled = np.random.default_rng(seed).permutation(occupancy).reshape(4, 4, 4)
    assert best_threshold(shuffled) == pytest.approx(best_threshold(occupancy), rel=1e-12)


def test_empty_space_around_an_object_changes_nothing():
    occupancy = some(3)
    padded = np.concatenate([occupancy, np.zeros(1000, np.float32)])
    assert best_threshold(padded) == pytest.approx(best_threshold(occupancy), rel=1e-12)


def test_nothing_is_alike_nothing():
    nothing = np.zeros((2, 2, 2), np.float32)
    assert best_threshold(nothing) == (0.5, 1.0)
    assert expected_iou(nothing, nothing > 0) == 1


def test_what_is_doubtful_is_kept_where_all_is_doubtful():
    occupancy = np.full(1000, 0.3, np.float32)
    threshold, expected = best_threshold(occupancy)
    assert expected == pytest.approx(0.3)
    assert (occupancy > threshold).all()


def test_the_expectation_is_near_what_calibrated_cells_have():
    rng = np.random.default_rng(0)
    occupancy = rng.beta(0.3, 0.6, 20_000)
    threshold, expected = best_threshold(occupancy)
    measured = [iou((occupancy > threshold)[None, None], (rng.random(20_000) < occupancy)[None,
                                                                                          None])
                for _ in range(10)]
    assert np.mean(measured) == pytest.approx(expected, abs=0.01)
