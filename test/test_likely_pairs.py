"""Pairs of photos that a quick look finds most alike."""

from itertools import combinations

from active_recon.photos.likely_pairs import likely_pairs
import numpy as np
import pytest

PHOTOS, STEP, SEEN = 30, 20, 100  # each photo shows SEEN of the features around, from STEP on


@pytest.fixture(scope='module')
def around():
    """Return descriptors and scales of photos around an object: neighbours share features."""
    rng = np.random.default_rng(0)
    features = rng.integers(0, 256, (PHOTOS * STEP, 128), np.uint8)
    scales = rng.uniform(1, 10, len(features)).astype(np.float32)
    places = [np.arange(SEEN) + STEP * photo for photo in range(PHOTOS)]
    return ([features[each % len(features)] for each in places],
            [scales[each % len(scales)] for each in places])


def steps_apart(one, other):
    return min(abs(one - other), PHOTOS - abs(one - other))


def test_photos_that_share_features_are_compared_and_most_others_are_not(around):
    found = likely_pairs(*around)
    assert {pair for pair in combinations(range(PHOTOS), 2) if steps_apart(*pair) < 5} <= {*found}
    assert len(found) < PHOTOS * (PHOTOS - 1) / 2 * 0.8
    assert found == sorted({(min(pair), max(pair)) for pair in found})


def test_the_order_of_photos_does_not_matter_for_what_they_share(around):
    order = np.random.default_rng(1).permutation(PHOTOS)
    shuffled = likely_pairs(*([part[place] for place in order] for part in around))
    back = {tuple(sorted((int(order[one]), int(order[other])))) for one, other in shuffled}
    for found in ({*likely_pairs(*around)}, back):
        assert {pair for pair in found if steps_apart(*pair) < 5} == {
            pair for pair in combinations(range(PHOTOS), 2) if steps_apart(*pair) < 5}


def test_of_few_photos_all_pairs_are_compared(around):
    few = [part[::3] for part in around]
    assert likely_pairs(*few) == [*combinations(range(PHOTOS // 3), 2)]


def test_a_photo_without_features_is_in_no_pair(around):
    descriptors, scales = ([*part[:3]] for part in around)
    descriptors[1], scales[1] = descriptors[1][:0], scales[1][:0]
    assert likely_pairs(descriptors, scales) == [(0, 2)]


def test_among_many_features_the_largest_decide():
    rng = np.random.default_rng(2)
    shown = rng.integers(0, 256, (600, 128), np.uint8)
    large, small = np.full(600, 9, np.float32), np.ones(600, np.float32)
    first = rng.integers(0, 256, (600, 128), np.uint8)

    def photo(of_large, of_small):
        return np.concatenate([of_large, of_small]), np.concatenate([large, small])

    others = [photo(rng.integers(0, 256, (600, 128), np.uint8), first) for _ in range(12)]
    last = photo(shown, rng.integers(0, 256, (600, 128), np.uint8))
    photos = [photo(shown, first), *others, last]
    found = likely_pairs(*map(list, zip(*photos, strict=True)))
    assert (0, len(photos) - 1) in found
