"""What is wrong with a camera as a whole, in the diagnostics of the node that hears it."""

import time

from active_recon.acquisition.motion_monitor import MotionWatch
from active_recon.acquisition.stream_monitor import StreamWatch
from active_recon.geometry.cameras import Camera
from active_recon.nodes.runtime.diagnostics import Diagnostics


class CameraWatch:
    """Told of all that a camera sends, warns of each fault from when it shows until it is over."""

    def __init__(self, diagnostics: Diagnostics, goal_tolerance: float,
                 stall_timeout: float) -> None:
        self._diagnostics = diagnostics
        self._streams = StreamWatch()
        self._motion = MotionWatch(goal_tolerance, stall_timeout)
        self._found: set[str] = set()

    def change(self, goal_tolerance: float, stall_timeout: float) -> None:
        """Judge the camera's motion by other limits, radians and seconds."""
        self._motion.goal_tolerance = goal_tolerance
        self._motion.stall_timeout = stall_timeout

    def heard(self, stream: str, stamp: int) -> None:
        """Note a message of a stream of `StreamWatch`, whether or not it can be used."""
        self._streams.heard(stream, stamp, time.monotonic())

    def lost(self) -> None:
        """Note that images were published that did not come."""
        self._streams.lost(time.monotonic())

    def stands(self, camera: Camera, stamp: int, goal: Camera | None) -> None:
        """Note where the camera is, and the camera of its open goal."""
        self._motion.heard(camera, stamp, goal)

    def tell(self) -> None:
        """Warn of what is wrong now, and take back what no longer is; called again and again."""
        self._tell({**self._streams.found(time.monotonic()), **self._motion.found()})

    def forget(self) -> None:
        """Begin anew, with nothing wrong."""
        self._streams.clear()
        self._motion.clear()
        self._tell({})

    def _tell(self, found: dict[str, str]) -> None:
        for kind in self._found - found.keys():
            self._diagnostics.end_trouble(kind)
        for kind, message in found.items():
            self._diagnostics.begin_trouble(kind, message)
        self._found = set(found)
