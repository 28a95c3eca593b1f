"""A simulated turntable: the camera's azimuth over time, at a finite speed, the shortest way."""

import math

from active_recon.errors import ConfigError, ViewError
from active_recon.geometry.cameras import azimuth_difference, wrap_azimuth


class Turntable:
    """
    Where the camera stands around the object; times are seconds of any one clock.

    It turns at `speed` radians a second, `time_scale` times as fast as the clock runs, and stands
    at `azimuth` until it is given a goal.
    """

    def __init__(self, azimuth: float = 0.0, speed: float = 1.0, time_scale: float = 1.0) -> None:
        if not math.isfinite(azimuth):
            raise ConfigError(f'turntable: azimuth not finite: expected radians, got {azimuth}')
        self._start = wrap_azimuth(azimuth)
        self._way = 0.0
        self._left_at = 0.0
        self.set_speed(speed, time_scale, 0.0)

    def set_speed(self, speed: float, time_scale: float, now: float) -> None:
        """Go on at another speed from where the camera is now."""
        if not (0 < speed < math.inf and 0 < time_scale < math.inf):
            raise ConfigError('turntable: speed or time scale out of range: expected both finite '
                              f'and above 0, got {speed} and {time_scale}')
        if self._way:
            here = self.azimuth_at(now)
            self._way -= float(azimuth_difference(here, self._start))
            self._start, self._left_at = here, now
        self._rate = speed * time_scale

    def turn_to(self, azimuth: float, now: float) -> None:
        """Leave for an azimuth from where the camera is now; raises ViewError if not finite."""
        if not math.isfinite(azimuth):
            raise ViewError(f'azimuth goal not finite: got {azimuth}', 'goal')
        self._start = self.azimuth_at(now)
        self._way = float(azimuth_difference(azimuth, self._start))
        self._left_at = now

    def azimuth_at(self, now: float) -> float:
        """Return the camera's azimuth, [0, 2 pi)."""
        turned = min(max(now - self._left_at, 0.0) * self._rate, abs(self._way))
        return wrap_azimuth(self._start + math.copysign(turned, self._way))
