"""How long work tells how far it is: whoever asks for it gives the means."""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager

Advance = Callable[[int, str], None]
"""Tells of so many more steps, and a note."""
Reporting = Callable[[str, int], AbstractContextManager[Advance]]
"""Opens a report of what is done, given a title and how many steps."""


@contextmanager
def silent(title: str, total: int) -> Iterator[Advance]:
    """Report to nobody."""
    yield lambda steps, note: None
