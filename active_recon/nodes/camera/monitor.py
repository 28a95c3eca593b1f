"""Reports faults of a camera's streams and motion in its node's diagnostics."""

import time

from active_recon.acquisition.motion_monitor import MotionMonitor
from active_recon.acquisition.stream_monitor import StreamMonitor
from active_recon.geometry.cameras import Camera
from active_recon.nodes.runtime.diagnostics import Diagnostics


class CameraMonitor:
    """Raises a warning for each fault of a camera, and clears it when the fault is over."""

    def __init__(self, diagnostics: Diagnostics, goal_tolerance: float,
                 stall_timeout: float) -> None:
        self._diagnostics = diagnostics
        self._streams = StreamMonitor()
        self._motion = MotionMonitor(goal_tolerance, stall_timeout)
        self._active: set[str] = set()

    def set_limits(self, goal_tolerance: float, stall_timeout: float) -> None:
        """Set the limits of the camera's motion, radians and seconds."""
        self._motion.goal_tolerance = goal_tolerance
        self._motion.stall_timeout = stall_timeout

    @property
    def sees(self) -> bool:
        """Whether the camera has sent anything that could now be missing."""
        return self._streams.has_begun

    def add_message(self, stream: str, stamp: int) -> None:
        """Note a message of a stream of `StreamMonitor`, whether or not it can be used."""
        self._streams.add(stream, stamp, time.monotonic())

    def add_lost(self) -> None:
        """Note that images were published and not received."""
        self._streams.add_lost(time.monotonic())

    def add_pose(self, camera: Camera, stamp: int, goal: Camera | None) -> None:
        """Note where the camera is, and the camera of its open goal."""
        self._motion.add(camera, stamp, goal)

    def update(self) -> None:
        """Raise and clear the warnings; to be called several times a second."""
        self._set({**self._streams.faults(time.monotonic()), **self._motion.faults()})

    def reset(self) -> None:
        """Forget all messages and clear the warnings."""
        self._streams.clear()
        self._motion.clear()
        self._set({})

    def _set(self, faults: dict[str, str]) -> None:
        for kind in self._active - faults.keys():
            self._diagnostics.clear_warning(kind)
        for kind, message in faults.items():
            self._diagnostics.raise_warning(kind, message)
        self._active = set(faults)
