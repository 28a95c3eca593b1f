"""Requests to stop, taken at chosen points: elsewhere ROS's bindings could be torn apart."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
import os
import signal
import threading
from types import FrameType

_IMPORTING = '<frozen importlib._bootstrap>'
_AGAIN_AFTER = 0.01  # seconds
_is_interrupted = False


def stop_signals() -> tuple[signal.Signals, ...]:
    """Return the signals of Ctrl-C, `kill` and, without `nohup`, a terminal that is closed."""
    is_ignored = signal.getsignal(signal.SIGHUP) == signal.SIG_IGN
    return (signal.SIGINT, signal.SIGTERM, *(() if is_ignored else (signal.SIGHUP,)))


def interrupt(kind: int, frame: FrameType | None) -> None:
    """
    Raise KeyboardInterrupt, after an import that is going on: what a command does on a signal.

    Some libraries take whatever ends the import of another one for the want of that one.
    """
    while frame is not None and frame.f_code.co_filename != _IMPORTING:
        frame = frame.f_back
    if frame is None:
        global _is_interrupted
        _is_interrupted = True
        raise KeyboardInterrupt
    again = threading.Timer(_AGAIN_AFTER, os.kill, (os.getpid(), kind))
    again.daemon = True
    again.start()


def is_interrupted() -> bool:
    """
    Return whether `interrupt` has raised: what fails since then fails for that.

    Some libraries make an error of their own of it, as torch does where weights are read.
    """
    return _is_interrupted


def forget_interrupt() -> None:
    """Begin anew, as a command does: `is_interrupted` is false."""
    global _is_interrupted
    _is_interrupted = False


@contextmanager
def held_interrupts() -> Iterator[Callable[[], None]]:
    """
    Hold the `stop_signals` back in the block, if it is the main thread's, which gets them.

    What is yielded raises KeyboardInterrupt when called after one came; so does the block's end,
    where nothing has been raised before.
    """
    asked: list[int] = []
    mine = threading.current_thread() is threading.main_thread()
    before = {kind: signal.signal(kind, lambda kind, _frame: asked.append(kind))
              for kind in (stop_signals() if mine else ())}

    def raise_if_asked() -> None:
        if asked:
            raise KeyboardInterrupt

    try:
        yield raise_if_asked
    finally:
        for kind, handler in before.items():
            signal.signal(kind, handler)
    raise_if_asked()
