"""Whether a camera stands still, and whether its poses can be believed."""

from collections import deque

from active_recon.geometry.cameras import azimuth_difference, Camera
import numpy as np
from numpy.typing import NDArray

STILL_ANGLE = 0.01
"""A still camera has not moved by more, radians as seen from the object or turned in place."""
STILL_TIME = 0.08
"""For so long, seconds: two images of a stream of 10 Hz."""
UNSURE_TIME = 0.5
"""For so long, seconds, no rest is believed after poses that turned back without one."""
_KEPT = 16


class Stillness:
    """
    Told of a camera's poses in the order of their stamps, nanoseconds.

    A camera that goes somewhere comes to rest before it goes back. Poses that turn back from one
    to the next, each time by more than `STILL_ANGLE`, are not those of a motion: they jump.
    """

    def __init__(self) -> None:
        self._rest: tuple[int, Camera] | None = None
        self._last: Camera | None = None
        self._step: NDArray[np.float64] = np.zeros(2)
        self._jumps: deque[int] = deque(maxlen=_KEPT)
        self._stamp = 0

    def add(self, camera: Camera, stamp: int) -> None:
        """Take in the next pose."""
        if self._last is not None:
            step = np.array([azimuth_difference(camera.azimuth, self._last.azimuth),
                             camera.elevation - self._last.elevation])
            sure = min(np.abs(step).max(), np.abs(self._step).max()) > STILL_ANGLE
            if sure and step @ self._step < 0:
                self._jumps.append(stamp)
            self._step = step
        if self._rest is None or _moved(self._rest[1], camera) > STILL_ANGLE:
            self._rest = stamp, camera
        self._last = camera
        self._stamp = stamp

    @property
    def rested(self) -> float:
        """Seconds for which the camera has stayed near one pose."""
        return 0.0 if self._rest is None else (self._stamp - self._rest[0]) / 1e9

    def is_still(self, settle_time: float = STILL_TIME) -> bool:
        """Whether it has stayed for so many seconds, and its poses did not jump just before."""
        return self.rested >= settle_time and not self.jumps(UNSURE_TIME)

    def jumps(self, seconds: float) -> int:
        """Return how often, in the time before the last pose, the poses jumped."""
        return sum(stamp > self._stamp - seconds * 1e9 for stamp in self._jumps)


def _moved(a: Camera, b: Camera) -> float:
    """Return the larger of the angle moved, as seen from the object, and the angle turned."""
    shift = float(np.linalg.norm(a.position - b.position)) / a.distance
    cosine = (np.trace(a.pose[:3, :3].T @ b.pose[:3, :3]) - 1) / 2
    return max(shift, float(np.arccos(np.clip(cosine, -1, 1))))
