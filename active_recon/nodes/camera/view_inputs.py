"""What the camera publishes, joined to views: each image with the pose and lens of its stamp."""

from collections.abc import Callable
from functools import partial
import time

from active_recon.acquisition.view_gate import ViewGate
from active_recon.errors import MessageError
from active_recon.geometry.cameras import Camera
from active_recon.nodes.camera.depth_images import DepthImages
from active_recon.nodes.camera.images import CameraImages
from active_recon.nodes.camera.monitor import CameraMonitor
from active_recon.nodes.camera.pose_sources import subscribe_poses
from active_recon.nodes.camera.reference_capture import ReferenceCapture
from active_recon.nodes.runtime.awaited_inputs import AwaitedInputs
from active_recon.nodes.runtime.diagnostics import Diagnostics
from active_recon.nodes.runtime.life_cycle import ManagedNode
from active_recon.nodes.runtime.qos import SENSOR_QOS
from active_recon.nodes.runtime.resting_timer import RestingTimer
from active_recon.parameters.reconstructor import ReconstructorParameters
from geometry_msgs.msg import PoseStamped
from msg_tools.camera_images import pixels_from_msg
from msg_tools.cameras import intrinsics_from_msg, pose_from_msg
from msg_tools.stamps import nanoseconds_from_stamp
from msg_tools.views import NOT_BEGUN, View, ViewJoiner
from sensor_msgs.msg import CameraInfo, CompressedImage, Image

_ON_ITS_WAY_S = 2.0
"""Longest way of an image of a camera that runs, seconds."""
CLOCK_AHEAD_S = 5.0
"""Time ahead of the node's clock from which an image's stamp is warned of."""


class ViewInputs:
    """
    Joins the camera's messages, gives each view to `on_view`, and watches the camera.

    A message that cannot be used is rejected in the diagnostics. `gate` knows the open goal;
    `capture` gets each image, as it may be that of the empty scene. Made when the node is
    configured; `subscribe` when it is activated.
    """

    def __init__(self, node: ManagedNode, diagnostics: Diagnostics,
                 params: ReconstructorParameters, gate: ViewGate, capture: ReferenceCapture,
                 on_view: Callable[[View], None]) -> None:
        self._node, self._diagnostics = node, diagnostics
        self._gate, self._capture, self._on_view = gate, capture, on_view
        self._takes_masks = params.as_background().how == 'mask'
        self._joiner = ViewJoiner(
            params.max_pose_gap, masks=self._takes_masks,
            max_depth_gap=params.max_depth_gap if params.use_depth else None)
        self._monitor = CameraMonitor(diagnostics, params.goal_tolerance, params.stall_timeout)
        self._begin = 0
        self.depths: DepthImages | None = None

    def subscribe(self, params: ReconstructorParameters,
                  note_message: Callable[[], None]) -> None:
        """Subscribe to all that the parameters name; `note_message` hears of each message."""
        self._note_message, self._object_frame = note_message, params.object_frame
        inputs = AwaitedInputs(self._node, self._diagnostics)
        self._node.add_cleanup(inputs.clear)
        inputs.subscribe(CameraInfo, 'camera/camera_info', self._on_camera_info, SENSOR_QOS)
        if self._takes_masks:
            inputs.subscribe(Image, 'camera/mask', self._on_mask, SENSOR_QOS)
        self.depths = DepthImages(self._node, self._diagnostics, inputs, self._joiner,
                                  self._on_message) if params.use_depth else None
        self._poses = subscribe_poses(self._node, params, self._object_frame, self._on_pose,
                                      self._diagnostics, inputs)
        # Last: a publisher that discovers this subscription has discovered the others
        CameraImages(self._node, self._diagnostics, inputs, self._on_image,
                     self._monitor.add_lost)
        # Images without a pose or camera info are rejected after a time
        self._image_timer = RestingTimer(
            self._node, 0.1, self._join, lambda: self._joiner.is_waiting)
        self._camera_timer = RestingTimer(
            self._node, 0.1, self._monitor.update, lambda: self._monitor.sees)
        self._node.add_cleanup(self._monitor.reset)

    def set_limits(self, params: ReconstructorParameters) -> None:
        """Apply a change of the parameters that may change."""
        self._joiner.max_pose_gap = params.max_pose_gap
        self._monitor.set_limits(params.goal_tolerance, params.stall_timeout)

    def begin_episode(self, stamp: int) -> None:
        """Forget all messages; images from before a stamp in nanoseconds are another episode's."""
        self._begin = stamp
        self._joiner.clear(stamp)

    def clock_went_back(self) -> None:
        """Forget the poses of the time before."""
        self._poses.forget()

    def _on_image(self, msg: Image | CompressedImage) -> None:
        self._diagnostics.count('images')
        with self._diagnostics.rejecting():
            stamp = nanoseconds_from_stamp(msg.header.stamp)
            self._monitor.add_message('images', stamp)
            self._capture.on_image(stamp, partial(pixels_from_msg, msg))
            if stamp == 0 < self._begin:
                raise MessageError(
                    'image without a stamp: expected that of when it was taken, got 0; let its '
                    'publisher fill in header.stamp', 'no_stamp')
            early = self._begin - stamp
            if early > 0 or self._node.clock_monitor.is_ahead(stamp):
                raise MessageError(
                    'image of another episode: expected one of this episode, which began at '
                    f'{self._begin / 1e9:.3f} s, got one of {stamp / 1e9:.3f} s; '
                    + ('it was on its way when that began' if 0 < early < _ON_ITS_WAY_S * 1e9 else
                       'for a recording, play its clock and set use_sim_time'), 'last_episode')
            self._check_clock(stamp)
            self._joiner.add_image(stamp, msg, time.monotonic())
            self._poses.on_image(msg.header)
        self._on_message()

    def _check_clock(self, stamp: int) -> None:
        """Warn of a stamp far ahead of the node's clock: images in time are refused after it."""
        now = self._node.get_clock().now().nanoseconds
        ahead_s = (stamp - now) / 1e9
        if ahead_s <= CLOCK_AHEAD_S and (stamp or now):
            return
        if now == 0:  # before the first message of a simulation's clock; the camera's may be too
            self._diagnostics.warn('no_clock', (
                'use_sim_time is set and no /clock has been received: expected the time of a '
                f'simulation or of a bag, got an image of {stamp / 1e9:.3f} s; start what '
                'publishes /clock, or set use_sim_time to false'))
        else:
            self._diagnostics.warn('clock_ahead', (
                f'an image is stamped {ahead_s:.0f} s from now: expected stamps of this '
                "machine's clock; are the clocks of the machines the same? Images of earlier "
                'stamps will be refused, until a new episode begins'))

    def _on_camera_info(self, msg: CameraInfo) -> None:
        with self._diagnostics.rejecting():
            stamp = nanoseconds_from_stamp(msg.header.stamp)
            self._monitor.add_message('camera_info', stamp)
            self._joiner.add_intrinsics(stamp, intrinsics_from_msg(msg))
        self._on_message()

    def _on_mask(self, msg: Image) -> None:
        with self._diagnostics.rejecting():
            self._joiner.add_mask(nanoseconds_from_stamp(msg.header.stamp), msg)
        self._on_message()

    def _on_pose(self, msg: PoseStamped) -> None:
        self._diagnostics.count('poses')
        with self._diagnostics.rejecting():
            stamp = nanoseconds_from_stamp(msg.header.stamp)
            self._monitor.add_message('poses', stamp)
            pose = pose_from_msg(
                msg, self._object_frame, "give the camera's pose in the object's frame, whose "
                "origin is the cube's centre, or name that frame by object_frame")
            self._monitor.add_pose(Camera(pose), stamp, self._gate.open_goal)
            self._joiner.add_pose(stamp, pose)
        self._on_message()

    def _on_message(self) -> None:
        self._note_message()
        self._join()
        self._image_timer.wake()
        self._camera_timer.wake()

    def _join(self) -> None:
        """Give on every view whose messages have all arrived."""
        for view in self._joiner.joined(time.monotonic()):
            if isinstance(view, View):
                self._on_view(view)
            elif view.kind == NOT_BEGUN:
                self._diagnostics.count('images_unused')
            else:
                self._diagnostics.reject(view)
