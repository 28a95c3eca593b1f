"""Faults of a camera's motion: its poses jump, or it does not move to its goal."""

from active_recon.acquisition.stillness import Stillness
from active_recon.acquisition.stream_monitor import CLOCK_BACK_S
from active_recon.geometry.cameras import Camera
from active_recon.geometry.view_distance import view_distance
import numpy as np

_JUMPS, _JUMPS_S = 3, 1.0


class MotionMonitor:
    """
    Detects faults in a camera's motion from its poses; stamps are in nanoseconds.

    A camera has stalled if it rests for `stall_timeout` seconds while an open goal is more than
    `goal_tolerance` radians away.
    """

    def __init__(self, goal_tolerance: float, stall_timeout: float) -> None:
        self.goal_tolerance = goal_tolerance
        self.stall_timeout = stall_timeout
        self.clear()

    def clear(self) -> None:
        """Forget all poses."""
        self._stillness = Stillness()
        self._last = 0
        self._goal: Camera | None = None
        self._goal_since = 0
        self._away = 0.0

    def add(self, camera: Camera, stamp: int, goal: Camera | None) -> None:
        """Add a pose and the open goal, if any; poses out of order are ignored."""
        if stamp < self._last - CLOCK_BACK_S * 1e9:
            self.clear()
        if stamp <= self._last:
            return
        self._last = stamp
        self._stillness.add(camera, stamp)
        if goal is not self._goal:
            self._goal, self._goal_since = goal, stamp
        self._away = 0.0 if goal is None else view_distance(camera, goal)

    def faults(self) -> dict[str, str]:
        """Return the faults as of the last pose: a description of each, by its kind."""
        faults = {}
        jumps = self._stillness.jumps(_JUMPS_S)
        if jumps >= _JUMPS:
            faults['noisy_poses'] = (
                f'noisy poses: expected a camera that moves and rests, they jumped {jumps} times '
                f'in {_JUMPS_S:g} s, as those of two publishers do; the camera does not count '
                'as at rest until they are steady')
        stood = min(self._stillness.rested, (self._last - self._goal_since) / 1e9)
        if self._away > self.goal_tolerance and stood >= self.stall_timeout:
            faults['stalled'] = (
                'camera stalled: expected it to move to its goal, '
                f'{np.degrees(self._away):.0f} degrees away, but it has stood still for '
                f'{stood:.1f} s; does the motor turn?')
        return faults
