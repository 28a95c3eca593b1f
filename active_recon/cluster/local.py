"""Work in processes of this machine."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from typing import Any

from active_recon.cluster.bundles import attempt_all, Bundle, Bundles, Done
from active_recon.cluster.pools import WorkerPool
from active_recon.cluster.results import attempt, ATTEMPTS, DIED, Result
from active_recon.cluster.stores import Place


class LocalCrew:
    """
    A number of processes, each with one bundle of items at a time.

    A single one is this process itself. Each is a pool of its own, so that it is known which
    items a dying process had.
    """

    dashboard = ''

    def __init__(self, workers: int) -> None:
        self.workers = workers

    def map(self, function: Callable[[Any], Any], items: Iterable[Any],
            shared: Place | None = None, reads: Sequence[Place] = ()) -> Iterator[Result]:
        """Yield the results in the order of their completion; see `crew.Crew`."""
        function = partial(_staying, function)
        if self.workers == 1:
            for index, item in enumerate(items):
                yield attempt(function, item).result(index)
            return
        with ExitStack() as stack:
            hands: list[_Hand] = []
            try:
                yield from self._results(function, Bundles(items), stack, hands)
            except (KeyboardInterrupt, GeneratorExit):  # nobody waits for what is being done
                for hand in hands:
                    hand.stop()
                raise

    def _results(self, function: Callable[[Any], Any], bundles: Bundles, stack: ExitStack,
                 hands: 'list[_Hand]') -> Iterator[Result]:
        idle: list[_Hand] = []
        busy: dict[Future[Done], _Errand] = {}
        while True:
            while len(busy) < self.workers and (bundle := bundles.draw()):
                if idle:
                    hand = idle.pop()
                else:
                    hand = _Hand(function, stack)
                    hands.append(hand)
                errand = _Errand(hand, bundle)
                busy[errand.begin()] = errand
            if not busy:
                return
            finished, _ = wait(busy, return_when=FIRST_COMPLETED)
            for future in finished:
                errand = busy.pop(future)
                done = errand.done(future)
                if done is not None:
                    bundles.learn(done)
                    bundles.separate(errand.bundle[len(done.outcomes):])
                    for (index, _), outcome in zip(errand.bundle, done.outcomes, strict=False):
                        yield outcome.result(index)
                elif len(errand.bundle) > 1:
                    bundles.separate(errand.bundle)
                elif errand.begun < ATTEMPTS:
                    busy[errand.begin()] = errand
                    continue
                else:
                    yield DIED.result(errand.bundle[0][0])
                idle.append(errand.hand)


class _Hand:
    """One process; a new one takes the place of one that died."""

    def __init__(self, function: Callable[[Any], Any], stack: ExitStack) -> None:
        self._function, self._stack = function, stack
        self.renew()

    def renew(self) -> None:
        self._pool = self._stack.enter_context(
            WorkerPool(1, partial(_begin, self._function)))

    def submit(self, items: list[Any]) -> 'Future[Done]':
        try:
            return self._pool.submit(_work, items)
        except BrokenProcessPool:  # it died between two items
            self.renew()
            return self._pool.submit(_work, items)

    def stop(self) -> None:
        """Let the process end what it is doing."""
        self._pool.stop()


@dataclass
class _Errand:
    """A bundle in a process's hands."""

    hand: _Hand
    bundle: Bundle
    begun: int = 0

    def begin(self) -> 'Future[Done]':
        self.begun += 1
        return self.hand.submit([item for _, item in self.bundle])

    def done(self, future: 'Future[Done]') -> Done | None:
        """Return what became of it; None: its process died."""
        try:
            return future.result()
        except BrokenProcessPool:
            self.hand.renew()
            return None


def _staying(function: Callable[[Any], Any], item: Any) -> Any:
    """Call the function; where it asks its process to end, as parsers do, it has failed."""
    try:
        return function(item)
    except SystemExit as error:
        raise RuntimeError(f'it asked its process to end: SystemExit: {error}') from error


_function: Callable[[Any], Any] | None = None


def _begin(function: Callable[[Any], Any]) -> None:
    global _function
    _function = function


def _work(items: list[Any]) -> Done:
    assert _function is not None
    return attempt_all(_function, items)
