"""A source read in a thread of its own, at its pace; a device that is gone is searched for."""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
import threading
import time

from active_recon.capture.sources import ImageSource
from active_recon.errors import DataError
import numpy as np
from numpy.typing import NDArray

RETRY_S = 1.0
"""How often a device that is gone is searched for, seconds."""
_KEPT = 4
_BROKEN = 'device'


@dataclass(frozen=True, eq=False)
class Grabbed:
    """
    What came from a source: an image, a problem, or neither at its end.

    - image: (H, W, 3) uint8 RGB; stamp: when it came, as `now` has it
    - problem: why there is none; `lasting` until an image comes again
    """

    image: NDArray[np.uint8] | None = None
    stamp: int = 0
    problem: DataError | None = None
    lasting: bool = False


class Grabber:
    """
    Reads a source until `close`; `take` returns what has come since the last call.

    `reopen` opens the source again: a device that was gone, and a file at its end if `loop`.
    `now` gives the stamp of an image; `wake` is called, in the thread, when something has come.
    Of the images that nobody takes only the last few are kept.
    """

    def __init__(self, source: ImageSource, reopen: Callable[[], ImageSource], loop: bool,
                 now: Callable[[], int], wake: Callable[[], None]) -> None:
        self._source: ImageSource | None = source
        self._reopen, self._loop = reopen, loop
        self._now, self._wake = now, wake
        self._come: deque[Grabbed] = deque(maxlen=_KEPT)
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def take(self) -> list[Grabbed]:
        """Return what has come since the last call, the oldest first."""
        taken = []
        while self._come:
            taken.append(self._come.popleft())
        return taken

    def close(self) -> None:
        """End the thread, and give the source back."""
        self._closed.set()
        self._thread.join()

    def _run(self) -> None:
        due = time.monotonic()
        while not self._closed.is_set():
            rate = None if self._source is None else self._source.rate
            if rate is not None:
                due = max(due + 1 / rate, time.monotonic() - 1 / rate)
                self._closed.wait(due - time.monotonic())
            try:
                if not self._read():
                    break
            except DataError as error:
                lost = error.kind == _BROKEN or self._source is None
                self._tell(Grabbed(problem=error, lasting=lost))
                if lost:
                    self._give_back()
                    self._closed.wait(RETRY_S)
        self._give_back()

    def _read(self) -> bool:
        """Read an image; return whether there will be another."""
        if self._source is None:
            self._source = self._reopen()
        image = self._source.read()
        if image is not None:
            self._tell(Grabbed(image, self._now()))
        elif self._loop:
            self._give_back()
        else:
            self._tell(Grabbed())
            return False
        return True

    def _tell(self, come: Grabbed) -> None:
        self._come.append(come)
        self._wake()

    def _give_back(self) -> None:
        source, self._source = self._source, None
        if source is not None:
            source.close()
