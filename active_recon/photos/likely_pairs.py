"""Which photos are worth comparing in full: those that a quick look finds most alike."""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

_LARGEST = 512  # features of a photo that are looked at
_TOGETHER = 16  # photos whose features are compared with those of one in one product
_PARTNERS = 10  # of a photo, at least
_MAX_RATIO = 0.8  # of the angles to the nearest and to the second nearest, as of COLMAP


def likely_pairs(descriptors: Sequence[NDArray[np.uint8]],
                 scales: Sequence[NDArray[np.float32]]) -> list[tuple[int, int]]:
    """
    Return the pairs of photos (i, j), i < j, that probably show the same things, in order.

    Takes the descriptors, (N, 128), and the scales, (N,), of each photo's features. The largest
    are matched, by Lowe's ratio and in both directions (Wu, Towards Linear-time Incremental
    Structure from Motion, 3DV 2013, 2.1), and each photo is paired with the 10 that have most
    matches with it: so all are where there are no more. Photos without features are in no pair.
    """
    looks = [_directions(each, sizes) for each, sizes in zip(descriptors, scales, strict=True)]
    shared = np.zeros((len(looks), len(looks)), int)
    for one, other, alike in _compared(looks):
        shared[one, other] = shared[other, one] = 1 + _matches(alike)  # 0: without features
    chosen = set()
    for one, counts in enumerate(shared):
        best = np.argsort(-counts, kind='stable')[:_PARTNERS]
        chosen |= {(min(one, other), max(one, other))
                   for other in map(int, best) if counts[other]}
    return sorted(chosen)


def _compared(looks: Sequence[NDArray[np.float32]]
              ) -> Iterator[tuple[int, int, NDArray[np.float32]]]:
    """Yield photos i < j that have features, and the cosines between these, (M, M')."""
    ends = np.cumsum([0, *map(len, looks)])
    all_looks = np.concatenate(looks) if looks else np.zeros((0, 128), np.float32)
    for one, look in enumerate(looks):
        # Products of two photos each are waited for many times as long where other programs keep
        # the cores busy
        for first in range(one + 1, len(looks), _TOGETHER):
            last = min(first + _TOGETHER, len(looks))
            alike = look @ all_looks[ends[first]:ends[last]].T
            parts = np.split(alike, ends[first + 1:last] - ends[first], axis=1)
            yield from ((one, other, part) for other, part in enumerate(parts, first)
                        if part.size)


def _directions(descriptors: NDArray[np.uint8],
                scales: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the descriptors of the largest features as unit vectors, (M, 128)."""
    largest = descriptors[np.argsort(-scales, kind='stable')[:_LARGEST]].astype(np.float32)
    lengths = np.linalg.norm(largest, axis=1, keepdims=True)
    return np.asarray(largest / np.maximum(lengths, 1))


def _matches(alike: NDArray[np.float32]) -> int:
    """
    Return the number of mutual nearest neighbours that are much nearer than the next.

    Takes the cosines between features, (M, M'), which it changes.
    """
    number = np.arange(len(alike))
    nearest = alike.argmax(axis=1)
    cosine = alike[number, nearest]
    mutual = alike.max(axis=0)[nearest] == cosine  # a tenth of the time of `argmax`
    alike[number, nearest] = -1
    angle, second = (np.arccos(each.clip(-1, 1)) for each in (cosine, alike.max(axis=1)))
    return int((mutual & (angle < _MAX_RATIO * second)).sum())
