"""Images that should be in a recording and are not: gaps in the stream, and counts that differ."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FEWEST = 10
"""Images from which on a camera is known to stream."""
_REGULAR_WITHIN = 0.25  # of the period
_REGULAR_SHARE = 0.8  # of the images
_SLACK = 3  # images on their way, or between two counts, at either end


@dataclass(frozen=True)
class ImageGaps:
    """
    What is missing between the first image of a recording and the last.

    - period_s: how far apart the images usually are; None where the camera does not stream
    - missing: how many would fit into the gaps; longest_s: the longest gap, 0 where there is none
    - unheard: images that were recorded and that the loop did not count; None: not known
    """

    period_s: float | None = None
    missing: int = 0
    longest_s: float = 0.0
    unheard: int | None = None


def gaps_between(stamps: Sequence[int]) -> ImageGaps:
    """
    Return the gaps in images of those stamps, nanoseconds in any order.

    A gap is twice the usual period or more. Where the images come neither as often nor as
    regularly as a stream's, nothing is said to be missing.
    """
    apart: NDArray[np.float64] = np.diff(np.unique(stamps)).astype(np.float64) / 1e9
    if len(apart) + 1 < FEWEST:
        return ImageGaps()
    period = float(np.median(apart))
    steps: NDArray[np.float64] = np.rint(apart / period)
    regular = np.abs(apart - np.maximum(steps, 1) * period) <= _REGULAR_WITHIN * period
    if regular.mean() < _REGULAR_SHARE:
        return ImageGaps()
    gaps = steps >= 2
    return ImageGaps(period, int((steps[gaps] - 1).sum()), float(apart[gaps].max(initial=0.0)))


def unheard_images(received: Sequence[int], counts: Sequence[tuple[int, Mapping[str, int]]]
                   ) -> int | None:
    """
    Return how many recorded images a node did not count.

    `received` are the images' receive times, `counts` the node's counters with theirs,
    nanoseconds. They are compared between the first count and the last, so that it does not
    matter who started first; None where there are not two, or the node began anew.
    """
    known = [(time, count['images']) for time, count in counts if 'images' in count]
    if len(known) < 2 or any(b < a for (_, a), (_, b) in zip(known, known[1:], strict=False)):
        return None
    (begin, first), (end, last) = known[0], known[-1]
    recorded = sum(begin < time <= end for time in received)
    unheard = recorded - (last - first)
    return unheard if unheard > _SLACK else 0
