"""Detects whether a camera is at rest, and whether its poses are reliable."""

from collections import deque
import math

from active_recon.geometry.cameras import azimuth_difference, Camera
import numpy as np
from numpy.typing import NDArray

STILL_ANGLE = 0.01
"""Largest motion of a camera at rest, radians as seen from the object or turned in place."""
STILL_TIME = 0.08
"""Time without motion until a camera is at rest, seconds: two images at 10 Hz."""
UNSURE_TIME = 0.5
"""Time after a jump of the poses for which the camera is not at rest, seconds."""
_KEPT = 16


class Stillness:
    """
    Follows a camera's poses in the order of their stamps, nanoseconds.

    A moving camera comes to rest before it reverses. Poses that reverse from one to the next,
    each step larger than `STILL_ANGLE`, are no motion but jumps.
    """

    def __init__(self) -> None:
        self._rest: tuple[int, Camera] | None = None
        self._last: Camera | None = None
        self._step: NDArray[np.float64] = np.zeros(2)
        self._jumps: deque[int] = deque(maxlen=_KEPT)
        self._stamp = 0

    def add(self, camera: Camera, stamp: int) -> None:
        """Add the next pose."""
        if self._last is not None:
            # As seen from the object: above it, a tremble is a large difference of azimuths
            across = math.cos(max(abs(camera.elevation), abs(self._last.elevation)))
            step = np.array([azimuth_difference(camera.azimuth, self._last.azimuth) * across,
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
        """Whether it has rested for `settle_time` seconds, and its poses did not jump recently."""
        return self.rested >= settle_time and not self.jumps(UNSURE_TIME)

    def jumps(self, seconds: float) -> int:
        """Return the number of jumps in the given seconds before the last pose."""
        return sum(stamp > self._stamp - seconds * 1e9 for stamp in self._jumps)


def _moved(a: Camera, b: Camera) -> float:
    """Return the larger of the angle moved, as seen from the object, and the angle turned."""
    shift = float(np.linalg.norm(a.position - b.position)) / a.distance
    cosine = (np.trace(a.pose[:3, :3].T @ b.pose[:3, :3]) - 1) / 2
    return max(shift, float(np.arccos(np.clip(cosine, -1, 1))))
