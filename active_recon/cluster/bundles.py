"""Items in bundles: what is given out at once takes long enough to be worth the giving."""

from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import islice
import time
from typing import Any

from active_recon.cluster.results import attempt, Outcome

_WORTH = 0.05  # seconds that a bundle is to take
_LONGEST = 0.5  # seconds after which the rest of a bundle is given back
_MOST = 64
_FORGETTING = 0.3  # weight of the newest bundle in the mean time of an item

Bundle = list[tuple[int, Any]]
"""Items with their indices."""


@dataclass(frozen=True)
class Done:
    """The outcomes of a bundle's first items in their order, and the seconds they took."""

    outcomes: list[Outcome]
    seconds: float


def attempt_all(function: Callable[[Any], Any], items: list[Any]) -> Done:
    """Call the function for each item of a bundle, until they have taken longer than thought."""
    begun = time.perf_counter()
    outcomes: list[Outcome] = []
    for item in items:
        outcomes.append(attempt(function, item))
        if time.perf_counter() - begun > _LONGEST:
            break
    return Done(outcomes, time.perf_counter() - begun)


class Bundles:
    """The items that are left, drawn as they are asked for."""

    def __init__(self, items: Iterable[Any]) -> None:
        self._left = enumerate(items)
        self._alone: deque[tuple[int, Any]] = deque()
        self._each: float | None = None

    def draw(self) -> Bundle:
        """Return the next items, one where their time is not known; none at the end."""
        if self._alone:
            return [self._alone.popleft()]
        size = 1 if self._each is None else int(_WORTH / max(self._each, 1e-9))
        return list(islice(self._left, min(max(size, 1), _MOST)))

    def learn(self, done: Done) -> None:
        """Learn how long items take."""
        each = done.seconds / len(done.outcomes)
        self._each = each if self._each is None else (
            self._each + _FORGETTING * (each - self._each))

    def separate(self, bundle: Bundle) -> None:
        """Take back items of a bundle that was not finished, to be given out one by one."""
        self._alone.extend(bundle)
