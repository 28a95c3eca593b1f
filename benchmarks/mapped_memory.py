"""What memory costs that was not used for a moment: some virtual machines map it anew."""

from collections.abc import Iterator
import time

from benchmarks.figures import Figure, timed_ms
import numpy as np

_REPEATS = 30
_PAUSE_S = 0.1  # between the views of a loop
_SMALL = 1 << 20  # bytes of a block: of larger ones numpy asks for huge pages


def memory_figures() -> Iterator[Figure]:
    """Return the time of a sum over 16 MB, repeated at once and after pauses, milliseconds."""
    blocks = [np.ones(_SMALL // 8) for _ in range(16)]

    def total() -> float:
        return sum(float(block.sum()) for block in blocks)

    yield Figure('a sum over 16 MB', 'ms', timed_ms(total, _REPEATS), None)
    after = []
    for _ in range(_REPEATS):
        time.sleep(_PAUSE_S)
        after += timed_ms(total, 1, 0)
    yield Figure(f'the same, {_PAUSE_S:g} s after the last', 'ms', after, None)
