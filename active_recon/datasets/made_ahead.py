"""Processes that make the objects of a recipe, some ahead of what is asked for."""

from collections import deque
from concurrent.futures import Future
from concurrent.futures.process import BrokenProcessPool
from functools import partial
from itertools import count

from active_recon.cluster.pools import WorkerPool
from active_recon.datasets.recipes import Made, Maker
from active_recon.errors import WorkError


class MadeAhead:
    """
    Makes objects in order in so many processes; `ahead` of them are asked for before their turn.

    The first has the number `first`, each other one `stride` more than the one before. The
    processes end with `close`.
    """

    def __init__(self, maker: Maker, workers: int, ahead: int, first: int = 0,
                 stride: int = 1) -> None:
        self._pool = WorkerPool(workers, partial(_begin, maker))
        self._numbers, self._ahead = count(first, stride), workers + ahead
        self._coming: deque[Future[Made]] = deque()

    def take(self) -> Made:
        """Return the next object, when it is ready; raises as `Maker` does, and WorkError."""
        try:
            self._ask()
            made = self._coming.popleft().result()
            self._ask()
        except BrokenProcessPool as error:
            raise WorkError('a process that makes objects died: expected it to go on; if memory '
                            'is short, make objects in fewer processes') from error
        return made

    def close(self) -> None:
        """End the processes; what was asked for and is not made is given up."""
        self._pool.shutdown(cancel_futures=True)

    def _ask(self) -> None:
        while len(self._coming) < self._ahead:
            self._coming.append(self._pool.submit(_make, next(self._numbers)))


_maker: Maker | None = None


def _begin(maker: Maker) -> None:
    global _maker
    _maker = maker


def _make(number: int) -> Made:
    assert _maker is not None
    return _maker(number)
