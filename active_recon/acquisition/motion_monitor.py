"""What a camera's poses show over time: that they jump, or that it does not go to its goal."""

from active_recon.acquisition.stillness import Stillness
from active_recon.acquisition.stream_monitor import CLOCK_BACK_S
from active_recon.geometry.cameras import Camera, view_distance
import numpy as np

_JUMPS, _JUMPS_S = 3, 1.0


class MotionWatch:
    """
    Told of every pose, tells what is wrong with the camera's motion; stamps are nanoseconds.

    A camera has stalled that stands for `stall_timeout` seconds while an open goal is more than
    `goal_tolerance` radians away.
    """

    def __init__(self, goal_tolerance: float, stall_timeout: float) -> None:
        self.goal_tolerance = goal_tolerance
        self.stall_timeout = stall_timeout
        self.clear()

    def clear(self) -> None:
        """Begin anew, as if no pose had come yet."""
        self._stillness = Stillness()
        self._last = 0
        self._goal: Camera | None = None
        self._goal_since = 0
        self._away = 0.0

    def heard(self, camera: Camera, stamp: int, goal: Camera | None) -> None:
        """Note where the camera is, and its open goal; older poses are passed by."""
        if stamp < self._last - CLOCK_BACK_S * 1e9:
            self.clear()
        if stamp <= self._last:
            return
        self._last = stamp
        self._stillness.add(camera, stamp)
        if goal is not self._goal:
            self._goal, self._goal_since = goal, stamp
        self._away = 0.0 if goal is None else view_distance(camera, goal)

    def found(self) -> dict[str, str]:
        """Return what is wrong since the last pose: a short word of each fault, and a sentence."""
        found = {}
        jumps = self._stillness.jumps(_JUMPS_S)
        if jumps >= _JUMPS:
            found['noisy_poses'] = (
                f'expected poses of a camera that moves and rests, they jumped {jumps} times in '
                f'{_JUMPS_S:g} s; no view is taken until they are steady')
        stood = min(self._stillness.rested, (self._last - self._goal_since) / 1e9)
        if self._away > self.goal_tolerance and stood >= self.stall_timeout:
            found['stalled'] = (
                f'expected the camera to move to its goal, {np.degrees(self._away):.0f} degrees '
                f'away, it has stood still for {stood:.1f} s; does the motor turn?')
        return found
