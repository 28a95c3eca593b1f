"""Shares that neighbours agree on: what they minimise, and its limits."""

from active_recon.photos.random_walker import smoothed, Ties
import numpy as np
import pytest

SHAPE = 7, 9


def some_ties(seed, strength=3.0):
    rng = np.random.default_rng(seed)
    return Ties(*(np.float32(strength * rng.random((SHAPE[0] - down, SHAPE[1] - 1 + down)))
                  for down in (0, 1)))


def some_shares(seed):
    own, certain = np.random.default_rng(seed).random((2, *SHAPE)).astype(np.float32)
    return own, certain + np.float32(0.02)


@pytest.mark.parametrize('seed', range(4))
def test_shares_minimise_the_sum_over_pixels_and_neighbours(seed):
    ties, (own, certain) = some_ties(seed), some_shares(seed)
    number = np.arange(own.size).reshape(SHAPE)
    system = np.diag(certain.ravel().astype(float))
    for tied, first, second in ((ties.across, number[:, :-1], number[:, 1:]),
                                (ties.down, number[:-1], number[1:])):
        for tie, one, other in zip(tied.ravel(), first.ravel(), second.ravel(), strict=True):
            system[[one, other], [one, other]] += tie
            system[[one, other], [other, one]] -= tie
    exact = np.linalg.solve(system, (certain * own).ravel()).reshape(SHAPE)
    np.testing.assert_allclose(smoothed(ties, own, certain), exact, atol=5e-3)


def test_where_nothing_is_tied_each_pixel_keeps_its_share():
    own, certain = some_shares(0)
    np.testing.assert_allclose(smoothed(some_ties(0, 0.0), own, certain), own, atol=1e-6)


def test_a_share_that_all_have_stays():
    own = np.full(SHAPE, 0.3, np.float32)
    np.testing.assert_allclose(smoothed(some_ties(0), own, some_shares(0)[1]), own, atol=1e-6)


def test_a_certain_pixel_is_followed_by_its_doubtful_neighbours_up_to_an_edge():
    own, certain = np.full(SHAPE, 0.5, np.float32), np.full(SHAPE, 1e-3, np.float32)
    own[3, 0], certain[3, 0] = 1, 10
    ties = Ties(np.ones((SHAPE[0], SHAPE[1] - 1), np.float32),
                np.ones((SHAPE[0] - 1, SHAPE[1]), np.float32))
    ties.across[:, 4] = 0
    found = smoothed(ties, own, certain)
    assert found[:, :5].min() > 0.9
    np.testing.assert_allclose(found[:, 5:], 0.5, atol=1e-5)


def test_pixels_that_say_nothing_for_the_object_have_no_share():
    own, (_, certain) = np.zeros(SHAPE, np.float32), some_shares(0)
    np.testing.assert_array_equal(smoothed(some_ties(0), own, certain), own)
