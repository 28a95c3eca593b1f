"""Faults of a camera's streams: messages that are missing, late, or no longer arrive."""

from collections import deque
from collections.abc import Iterator
import math
from statistics import median

import numpy as np
from numpy.typing import NDArray

STREAMS = ('images', 'camera_info', 'poses')
SILENT_S = 0.5
"""A stream is silent after this time without a message, or after three of its periods."""
LATE_S = 0.15
"""An image is late if it arrives this long after the camera info or the pose of its stamp."""
CLOCK_BACK_S = 1.0
"""A stamp older than the last one by this much means that the clock jumped back."""
WINDOW_S = 1.0
"""Missing and late messages are counted over this time."""
_KEPT_S = 3.0
_LONGEST_STEP_S = 0.2
_STAMPS = 21
_REGULAR, _NO_LONGER = 0.85, 0.6
"""Fraction of periods near the median at which a stream becomes regular, and ceases to be."""
_AT_LEAST, _SHARE = 2, 0.1
_QUEUE = 10
"""Images that are queued for a busy node; further ones are lost."""

_NAMES = {'images': 'images', 'camera_info': 'camera infos', 'poses': 'poses'}
_Moments = dict[int, dict[str, float]]  # arrival time of each stream's message, by stamp


class StreamMonitor:
    """
    Detects faults of a camera's streams from the stamps and arrival times of its messages.

    Stamps are in nanoseconds, `now` is a monotonic clock in seconds. Messages that arrive
    irregularly, for example published by hand, are not a stream and are never missing.
    """

    def __init__(self) -> None:
        self.clear()

    @property
    def has_begun(self) -> bool:
        """Whether a message of any stream was added."""
        return bool(self._quiet)

    def clear(self) -> None:
        """Forget all messages."""
        self._quiet: dict[str, float] = {}
        self._checked = math.inf
        self._stamps: dict[str, deque[int]] = {
            stream: deque(maxlen=_STAMPS) for stream in STREAMS}
        self._periods: dict[str, float] = {}
        self._moments: _Moments = {}
        self._busy: deque[tuple[float, float]] = deque()  # time of a call, time since the last
        self._lost_at: float | None = None

    def add(self, stream: str, stamp: int, now: float) -> None:
        """Add a message of one of STREAMS, whether or not it can be used."""
        self._moments.setdefault(stamp, {}).setdefault(stream, now)
        self._quiet[stream] = 0.0
        stamps = self._stamps[stream]
        if stamps and stamp < stamps[-1] - CLOCK_BACK_S * 1e9:
            stamps.clear()
        if not stamps or stamp > stamps[-1]:
            stamps.append(stamp)

    def add_lost(self, now: float) -> None:
        """Add a gap in the sequence numbers: images that were published and not received."""
        self._lost_at = now

    def faults(self, now: float) -> dict[str, str]:
        """
        Return the faults now: a description of each, by its kind.

        Must be called several times a second: silence is measured from one call to the next.
        """
        self._moments = self._since(now - _KEPT_S)
        for stream, stamps in self._stamps.items():
            if len(stamps) == _STAMPS:
                self._note_period(stream, np.diff(stamps) / 1e9)
        recent = self._since(now - WINDOW_S)
        # A busy node receives queued messages afterwards, so past busy times matter
        self._busy.append((now, now - min(self._checked, now)))
        while self._busy[0][0] < now - _KEPT_S:
            self._busy.popleft()
        missing = {f'missing_{stream}': f'{words}; {self._cause(stream, now)}'
                   for stream, words in _missing(recent)}
        return {**self._silent(now), **missing, **dict(_late(recent))}

    def _cause(self, stream: str, now: float) -> str:
        """Describe where the missing messages of a stream were lost."""
        busy = max(time for _, time in self._busy)
        period = self._periods.get('images', 0.0)
        if stream == 'images' and period and busy > max(_QUEUE * period, _LONGEST_STEP_S):
            return (f'lost in processing: this node was busy for {busy:.1f} s, and its queue '
                    f'holds {_QUEUE} images')
        if stream == 'images' and self._lost_at is not None and now - self._lost_at < _KEPT_S:
            return ('lost in transport: they were published and did not arrive; is the connection '
                    "too slow, or the middleware's buffer too small for such images? On one "
                    "machine the camera's process needs the Fast DDS profile of these nodes: see "
                    'missing_images under Troubleshooting')
        return 'lost in transport, or never published'

    def _note_period(self, stream: str, periods: NDArray[np.float64]) -> None:
        """Keep the period of a stream while it is regular."""
        typical = float(np.median(periods))
        regular = float(np.mean((periods >= typical / 3) & (periods <= 3 * typical)))
        if regular >= (_NO_LONGER if stream in self._periods else _REGULAR):
            self._periods[stream] = typical
        else:
            self._periods.pop(stream, None)

    def _silent(self, now: float) -> dict[str, str]:
        # A node that was busy between two calls may have messages queued
        step = min(max(now - self._checked, 0.0), _LONGEST_STEP_S)
        self._checked = now
        for stream in self._quiet:
            self._quiet[stream] += step
        silent = {stream: self._quiet[stream] for stream, period in self._periods.items()
                  if self._quiet[stream] > max(SILENT_S, 3 * period)}
        if len(silent) == len(STREAMS):
            return {'silent_camera': (
                f'nothing from the camera for {min(silent.values()):.1f} s: expected images, '
                'camera info and poses as before; is it running and connected?')}
        return {f'silent_{stream}': (
            f'no {_NAMES[stream]} for {time:.1f} s: expected one every '
            f'{self._periods[stream]:.2g} s as before; is their publisher still running?')
            for stream, time in silent.items()}

    def _since(self, begin: float) -> _Moments:
        """Return the stamps with a message that arrived since `begin`."""
        return {stamp: came for stamp, came in self._moments.items()
                if max(came.values()) >= begin}


def _missing(moments: _Moments) -> Iterator[tuple[str, str]]:
    """Yield each stream with missing stamps, and a description with their number."""
    stamps = {stream: {stamp for stamp, came in moments.items() if stream in came}
              for stream in STREAMS}
    of_camera = stamps['images'] | stamps['camera_info']
    expected = {'images': stamps['camera_info']}
    # Poses of a tracker have stamps of their own, which match no image
    if 2 * len(stamps['poses'] & of_camera) >= len(stamps['poses']):
        expected['poses'] = of_camera
    for stream, awaited in expected.items():
        last = max(stamps[stream], default=0)  # later ones may be on their way
        due = {stamp for stamp in awaited if stamp < last}
        lost = len(due - stamps[stream])
        if lost >= max(_AT_LEAST, _SHARE * len(due)):
            yield stream, (
                f"{_NAMES[stream]} missing: expected one for each stamp of the camera's other "
                f'messages, {lost} of the last {len(due)} did not arrive')


def _late(moments: _Moments) -> Iterator[tuple[str, str]]:
    behind = [came['images'] - min(came.values())
              for came in moments.values() if 'images' in came and len(came) > 1]
    late = [time for time in behind if time > LATE_S]
    if len(late) >= max(_AT_LEAST, _SHARE * len(behind)):
        yield 'late_images', (
            'late images: expected them with the other messages of their stamp, '
            f'{len(late)} of the last {len(behind)} came {median(late):.2f} s later; views are '
            'taken that much later')
