"""A simulated camera that goes around an object and up and down: its place over time."""

import math

from active_recon.geometry.cameras import azimuth_difference, Camera, CANONICAL_ELEVATION
from active_recon.simulation.turntable import Turntable

STEEPEST = math.radians(89)
"""The camera goes no higher, radians, and no lower than this below the horizon."""


class Orbit:
    """
    The camera's azimuth and elevation; times are in seconds of any one clock.

    Both change at once, each at `speed` radians per second, `time_scale` times as fast as the
    clock, the azimuth the shorter way. Errors as in `Turntable`.
    """

    def __init__(self, azimuth: float = 0.0, elevation: float = CANONICAL_ELEVATION,
                 speed: float = 1.0, time_scale: float = 1.0) -> None:
        self._around = Turntable(azimuth, speed, time_scale)
        self._up = Turntable(elevation, speed, time_scale)  # never crosses its half turn

    def set_speed(self, speed: float, time_scale: float, now: float) -> None:
        """Continue at another speed from where the camera is at `now`; see Turntable."""
        self._around.set_speed(speed, time_scale, now)
        self._up.set_speed(speed, time_scale, now)

    def turn_to(self, azimuth: float, now: float) -> None:
        """Set a goal azimuth, radians, at the time `now`; the elevation's goal stays."""
        self._around.turn_to(azimuth, now)

    def go_to(self, camera: Camera, now: float) -> None:
        """Set a camera's azimuth and elevation as the goal at the time `now`."""
        self._around.turn_to(camera.azimuth, now)
        self._up.turn_to(min(max(camera.elevation, -STEEPEST), STEEPEST), now)

    def at(self, now: float) -> tuple[float, float]:
        """Return azimuth, in [0, 2 pi), and elevation at a time, radians."""
        return (self._around.azimuth_at(now),
                float(azimuth_difference(self._up.azimuth_at(now), 0.0)))
