"""Where an episode's first view is taken, which no policy chooses."""

from collections.abc import Callable
import math
import time

from active_recon.geometry.cameras import Camera, CANONICAL_ELEVATION, orbit_camera
from active_recon.nodes.runtime.awaited_inputs import AwaitedInputs
from active_recon.nodes.runtime.diagnostics import Diagnostics
from active_recon.nodes.runtime.life_cycle import ManagedNode
from active_recon.nodes.runtime.qos import SENSOR_QOS
from active_recon.parameters.view_planner import ViewPlannerParameters
from geometry_msgs.msg import PoseStamped
from msg_tools.cameras import pose_from_msg
from msg_tools.episodes import Episode
from msg_tools.stamps import nanoseconds_from_stamp

FIND_CAMERA_S = 1.0
"""Time to wait for a publisher of the camera's pose after an episode began."""
_STEEPEST = 1.5  # rad, of a first view


class FirstView:
    """
    Hears where the camera is, and tells where the first view is taken.

    That is where the camera stands or, with `start_azimuth`, at an azimuth and an elevation of the
    parameters'; the camera's elevation, where they name none. `on_camera` is called after each
    pose of the camera.
    """

    def __init__(self, node: ManagedNode, inputs: AwaitedInputs, diagnostics: Diagnostics,
                 params: Callable[[], ViewPlannerParameters],
                 on_camera: Callable[[], object]) -> None:
        self._node, self._diagnostics = node, diagnostics
        self._params, self._on_camera = params, on_camera
        self._frame = params().object_frame
        self._episode: Episode | None = None
        self.camera: Camera | None = None
        """Where the camera was last in this episode."""
        subscribe = (inputs.subscribe if math.isnan(params().start_azimuth)
                     else node.create_subscription)
        self._poses = subscribe(PoseStamped, 'camera/pose', self._on_pose, SENSOR_QOS)

    def begin(self, episode: Episode | None) -> None:
        """Forget where the camera was: an episode begins, or none is known."""
        self._episode, self._received_at = episode, time.monotonic()
        self.camera = None

    def waits_for_time_alone(self) -> bool:
        """Whether what is missing may come without a pose of the camera."""
        return self.camera is not None or not math.isnan(self._params().start_azimuth)

    def where(self) -> Camera | None:
        """Return the camera of the first view, None while it is not known."""
        params = self._params()
        if math.isnan(params.start_azimuth):
            return self.camera
        elevation = params.elevation
        if math.isnan(elevation) and self.camera is not None:
            elevation = min(max(self.camera.elevation, -_STEEPEST), _STEEPEST)
        if math.isnan(elevation):  # then it is the camera's, if one publishes its pose
            if (time.monotonic() - self._received_at < FIND_CAMERA_S
                    or self._node.count_publishers(self._poses.topic_name)):
                return None
            elevation = CANONICAL_ELEVATION
        return orbit_camera(params.start_azimuth, elevation)

    def _on_pose(self, msg: PoseStamped) -> None:
        with self._diagnostics.rejecting():
            camera = Camera(pose_from_msg(msg, self._frame))
            stamp = nanoseconds_from_stamp(msg.header.stamp)
            if (self._episode and stamp >= self._episode.begin
                    and not self._node.clock_monitor.is_ahead(stamp)):
                self.camera = camera
        self._on_camera()
