"""Images missing in a recording: gaps in the stream, and differences of the counts."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FEWEST = 10
"""The smallest number of images that shows that a camera streams."""
_REGULAR_WITHIN = 0.25  # of the period
_REGULAR_SHARE = 0.8  # of the images
_SLACK = 3  # images in transit, or between two counts, at either end


@dataclass(frozen=True)
class ImageGaps:
    """
    What is missing between the first image of a recording and the last.

    - period_s: the usual time between images, seconds; None if the camera does not stream
    - missing: the number of images that fit into the gaps; longest_s: the longest gap, seconds
    - uncounted: images that were recorded but not counted by the loop; None if unknown
    """

    period_s: float | None = None
    missing: int = 0
    longest_s: float = 0.0
    uncounted: int | None = None


def gaps_between(stamps: Sequence[int], received: Sequence[int] = ()) -> ImageGaps:
    """
    Return the gaps in images of those stamps, nanoseconds in any order.

    A gap is at least twice the usual period. If the images are fewer or less regular than those
    of a stream, nothing is reported as missing. By the times at which they were received, if they
    are given, it is known where the clock went back, and nothing is missing.
    """
    known, first = np.unique(stamps, return_index=True)
    apart: NDArray[np.float64] = np.diff(known).astype(np.float64) / 1e9
    if len(apart) + 1 < FEWEST:
        return ImageGaps()
    period = float(np.median(apart))
    steps: NDArray[np.float64] = np.rint(apart / period)
    regular = np.abs(apart - np.maximum(steps, 1) * period) <= _REGULAR_WITHIN * period
    if regular.mean() < _REGULAR_SHARE:
        return ImageGaps()
    gaps = steps >= 2
    if received:
        gaps &= np.diff(np.array(received)[first]) >= 0
    return ImageGaps(period, int((steps[gaps] - 1).sum()), float(apart[gaps].max(initial=0.0)))


def uncounted_images(received: Sequence[int], counts: Sequence[tuple[int, Mapping[str, int]]]
                   ) -> int | None:
    """
    Return the number of recorded images that a node did not count.

    `received` are the receive times of the images, `counts` the node's counters with their
    receive times, nanoseconds. Only images between the first count and the last are compared, so
    that the order of start does not matter. None if there are fewer than two counts, or the node
    was restarted.
    """
    known = [(time, count['images']) for time, count in counts if 'images' in count]
    if len(known) < 2 or any(b < a for (_, a), (_, b) in zip(known, known[1:], strict=False)):
        return None
    (begin, first), (end, last) = known[0], known[-1]
    recorded = sum(begin < time <= end for time in received)
    uncounted = recorded - (last - first)
    return uncounted if uncounted > _SLACK else 0
