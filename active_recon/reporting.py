"""Progress of long work: the caller passes what reports it."""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager

Advance = Callable[[int, str], None]
"""Reports a number of further steps, and a note."""
Reporting = Callable[[str, int], AbstractContextManager[Advance]]
"""Opens the report of one task, given its title and its number of steps."""


@contextmanager
def silent(title: str, total: int) -> Iterator[Advance]:
    """Report nothing."""
    yield lambda steps, note: None


def by_step(advance: Advance) -> Advance:
    """Return what reports the number of the step reached, instead of further steps."""
    done = 0

    def reached(step: int, note: str) -> None:
        nonlocal done
        advance(step - done, note)
        done = step

    return reached
