"""Batches drawn by threads while the steps before them are computed."""

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from itertools import islice
from typing import TypeVar

Drawn = TypeVar('Drawn')


def drawn_ahead(draw: Callable[[int], Drawn], steps: Sequence[int],
                threads: int) -> Iterator[tuple[int, Drawn]]:
    """
    Yield each step with what `draw` returns for it, in order.

    So many threads draw at most two steps each ahead; with none, a step is drawn when it is asked
    for. The results are the same where `draw` depends on the step alone. An error of a draw is
    raised at its step.
    """
    if threads == 0:
        yield from ((step, draw(step)) for step in steps)
        return
    left = iter(steps)
    with ThreadPoolExecutor(threads) as pool:
        waiting: deque[tuple[int, Future[Drawn]]] = deque(
            (step, pool.submit(draw, step)) for step in islice(left, 2 * threads))
        try:
            while waiting:
                step, drawn = waiting.popleft()
                yield step, drawn.result()
                waiting.extend((step, pool.submit(draw, step)) for step in islice(left, 1))
        finally:  # of a training that was stopped
            for _, drawn in waiting:
                drawn.cancel()
