"""Processes that work for this one; Ctrl-C and a closed terminal are for it alone."""

from collections.abc import Callable
from concurrent.futures import Future, ProcessPoolExecutor
from contextlib import suppress
import multiprocessing
import os
import pickle
import signal
import threading
from types import FrameType
from typing import Any

from active_recon.interrupts import held_interrupts, interrupt

_STOP = signal.SIGUSR1


class WorkerPool(ProcessPoolExecutor):
    """
    A number of processes, each of which calls `begin` before its first item.

    None outlives the process that has the pool, which is the one that Ctrl-C ends.
    """

    def __init__(self, workers: int, begin: Callable[[], None]) -> None:
        # spawn, because a fork of a process that has threads (torch, embree, ROS) may hang.
        # In bytes, what `begin` needs is imported where _begin wants it
        super().__init__(workers, multiprocessing.get_context('spawn'), _begin,
                         (pickle.dumps(begin),))

    def submit(self, function: Callable[..., Any], /, *given: Any, **more: Any) -> Future[Any]:
        """Let a process call the function; where one has to be started for it, it is here."""
        # A process starts with what is blocked: Ctrl-C would end its imports in a traceback
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            # Another thread may get it, for this one: the pool could not end, half started
            with held_interrupts():
                return super().submit(_do, function, *given, **more)
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)

    def stop(self) -> None:
        """End what is being done: it raises KeyboardInterrupt, so that nothing of it stays."""
        for process in list(self._processes or ()):  # none once it is shut down
            with suppress(ProcessLookupError):
                os.kill(process, _STOP)


def _begin(pickled: bytes) -> None:
    if signal.getsignal(signal.SIGINT) != signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.SIG_DFL)  # there is nothing yet to lose or to tell
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
    pickle.loads(pickled)()
    signal.signal(_STOP, _stop)
    for kind in (signal.SIGINT, signal.SIGHUP):
        signal.signal(kind, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    assert parent is not None

    def follow() -> None:
        parent.join()
        os._exit(1)

    threading.Thread(target=follow, daemon=True).start()


_is_working = _is_stopped = False


def _do(function: Callable[..., Any], *given: Any, **more: Any) -> Any:
    global _is_working
    if _is_stopped:
        raise KeyboardInterrupt
    _is_working = True
    try:
        return function(*given, **more)
    finally:
        _is_working = False


def _stop(kind: int, frame: FrameType | None) -> None:
    global _is_stopped
    _is_stopped = True
    if _is_working:  # elsewhere it would end the process with a traceback
        interrupt(kind, frame)
