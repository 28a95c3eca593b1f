"""Ctrl-C taken at chosen points: wherever else it struck, ROS's bindings could be torn apart."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
import signal


@contextmanager
def held_interrupts() -> Iterator[Callable[[], None]]:
    """
    Hold Ctrl-C and SIGTERM back in the block.

    What is yielded raises KeyboardInterrupt when called after one came; so does the block's end,
    where nothing has been raised before.
    """
    asked: list[int] = []
    before = {kind: signal.signal(kind, lambda kind, _frame: asked.append(kind))
              for kind in (signal.SIGINT, signal.SIGTERM)}

    def raise_if_asked() -> None:
        if asked:
            raise KeyboardInterrupt

    try:
        yield raise_if_asked
    finally:
        for kind, handler in before.items():
            signal.signal(kind, handler)
    raise_if_asked()
