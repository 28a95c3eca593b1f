"""A simulated turntable: the camera's azimuth over time, at constant speed, the shortest way."""

import math

from active_recon.errors import ConfigError, ViewError
from active_recon.geometry.cameras import azimuth_difference, wrap_azimuth


class Turntable:
    """
    The camera's azimuth around the object; times are in seconds of any one clock.

    It moves at `speed` radians per second, `time_scale` times as fast as the clock, and stays at
    `azimuth` until it gets a goal. Raises ConfigError where the azimuth is not finite, or speed or
    time scale are not finite and above 0.
    """

    def __init__(self, azimuth: float = 0.0, speed: float = 1.0, time_scale: float = 1.0) -> None:
        if not math.isfinite(azimuth):
            raise ConfigError(f'turntable: azimuth not finite: expected radians, got {azimuth}')
        self._start = wrap_azimuth(azimuth)
        self._way = 0.0
        self._left_at = 0.0
        self.set_speed(speed, time_scale, 0.0)

    def set_speed(self, speed: float, time_scale: float, now: float) -> None:
        """Continue at another speed from the azimuth at `now`; raises ConfigError if invalid."""
        if not (0 < speed < math.inf and 0 < time_scale < math.inf):
            raise ConfigError('turntable: speed or time scale out of range: expected both finite '
                              f'and above 0, got {speed} and {time_scale}')
        if self._way:
            # What is left is not measured anew: half a turn might become one the other way
            left = abs(self._way) - self._turned_at(now)
            self._start, self._left_at = self.azimuth_at(now), now
            self._way = math.copysign(left, self._way)
        self._rate = speed * time_scale

    def turn_to(self, azimuth: float, now: float) -> None:
        """Set a goal azimuth, radians, at the time `now`; raises ViewError if not finite."""
        if not math.isfinite(azimuth):
            raise ViewError(f'azimuth goal not finite: expected radians, got {azimuth}', 'goal')
        self._start = self.azimuth_at(now)
        self._way = float(azimuth_difference(azimuth, self._start))
        self._left_at = now

    def azimuth_at(self, now: float) -> float:
        """Return the camera's azimuth at a time, radians in [0, 2 pi)."""
        return wrap_azimuth(self._start + math.copysign(self._turned_at(now), self._way))

    def _turned_at(self, now: float) -> float:
        """Return how far it has turned towards its goal, radians."""
        return min(max(now - self._left_at, 0.0) * self._rate, abs(self._way))
