"""Sources of the camera's poses: a topic, the joint of a turntable, or tf2."""

from collections import deque
from collections.abc import Callable
from importlib import import_module
import time
from typing import Any, Protocol

from active_recon.errors import ConfigError, MessageError
from active_recon.geometry.turntable_pose import FixedCamera
from active_recon.nodes.runtime.awaited_inputs import AwaitedInputs
from active_recon.nodes.runtime.clock import STEADY
from active_recon.nodes.runtime.diagnostics import Diagnostics
from active_recon.nodes.runtime.qos import HIGH_RATE_QOS, STREAM_QOS
from active_recon.parameters.camera_pose import CameraPoseParameters
from geometry_msgs.msg import Point, Pose, PoseStamped
from msg_tools.cameras import pose_to_msg
from msg_tools.goals import joint_position_from_msg
from rclpy.node import Node
from rclpy.time import Time
from sensor_msgs.msg import JointState
from std_msgs.msg import Header

LOOKUP_EVERY_S = 0.02
TF_TIMEOUT_S = 0.5
"""Time to wait for an image's transform."""
_WAITING = 32  # images

OnPose = Callable[[PoseStamped], None]


class PoseSource(Protocol):
    """
    A source of the camera's poses in the object frame.

    Poses that do not come from `camera/pose` are published there, for the planner, the viewer
    and the bags.
    """

    def on_image(self, header: Header) -> None:
        """Note an image, by its stamp and the frame of its camera."""

    def forget(self) -> None:
        """Forget all poses: the clock went back, and what is known is of the time before."""


def check_pose_source(params: CameraPoseParameters) -> None:
    """Raise ConfigError where the poses cannot be obtained."""
    if params.pose_source == 'turntable_joint':
        params.as_fixed_camera()
    elif params.pose_source == 'tf':
        _tf2_ros()


def subscribe_poses(node: Node, params: CameraPoseParameters, object_frame: str, on_pose: OnPose,
                    diagnostics: Diagnostics, inputs: AwaitedInputs) -> PoseSource:
    """Return a source that calls `on_pose` for each pose; raises as `check_pose_source`."""
    if params.pose_source == 'turntable_joint':
        return TurntablePoses(node, on_pose, diagnostics, inputs, params.as_fixed_camera(),
                              params.joint_name, object_frame)
    if params.pose_source == 'tf':
        return TfPoses(node, on_pose, diagnostics, object_frame)
    return TopicPoses(on_pose, inputs)


class TopicPoses:
    """Poses that another node publishes on `camera/pose`."""

    def __init__(self, on_pose: OnPose, inputs: AwaitedInputs) -> None:
        inputs.subscribe(PoseStamped, 'camera/pose', on_pose, HIGH_RATE_QOS)

    def on_image(self, header: Header) -> None:
        """Do nothing: the joiner interpolates."""

    def forget(self) -> None:
        """Do nothing: the joiner keeps the poses."""


class TurntablePoses:
    """Poses of a fixed camera in the frame of an object that `turntable/joint_states` turns."""

    def __init__(self, node: Node, on_pose: OnPose, diagnostics: Diagnostics,
                 inputs: AwaitedInputs, camera: FixedCamera, joint: str,
                 object_frame: str) -> None:
        self._on_pose = on_pose
        self._diagnostics = diagnostics
        self._camera = camera
        self._joint = joint
        self._is_there = False
        self._object_frame = object_frame
        self._publisher = node.create_publisher(PoseStamped, 'camera/pose', STREAM_QOS)
        inputs.subscribe(JointState, 'turntable/joint_states', self._on_joint, HIGH_RATE_QOS)

    def _on_joint(self, msg: JointState) -> None:
        self._is_there |= self._joint in msg.name
        if self._is_there and msg.name and self._joint not in msg.name:
            return  # of another publisher's joints, as an arm's
        with self._diagnostics.rejecting():
            pose = self._camera.pose_at(joint_position_from_msg(msg, self._joint))
            header = Header(stamp=msg.header.stamp, frame_id=self._object_frame)
            camera_pose = pose_to_msg(pose, header)
            self._publisher.publish(camera_pose)
            self._on_pose(camera_pose)

    def on_image(self, header: Header) -> None:
        """Do nothing: the joiner interpolates."""

    def forget(self) -> None:
        """Do nothing: the joiner keeps the poses."""


class TfPoses:
    """
    Poses from tf2, of the frame of each image at its stamp.

    tf2 interpolates. Raises ConfigError where it is not installed.
    """

    def __init__(self, node: Node, on_pose: OnPose, diagnostics: Diagnostics,
                 object_frame: str) -> None:
        self._tf = _tf2_ros()
        self._on_pose = on_pose
        self._diagnostics = diagnostics
        self._object_frame = object_frame
        self._waiting: deque[tuple[Header, float]] = deque(maxlen=_WAITING)
        self._publisher = node.create_publisher(PoseStamped, 'camera/pose', STREAM_QOS)
        self._buffer = self._tf.Buffer()
        self._listener = self._tf.TransformListener(self._buffer, node)
        node.create_timer(LOOKUP_EVERY_S, self._look_up, clock=STEADY)

    def on_image(self, header: Header) -> None:
        """Look up the image's pose, now or when its transform has arrived."""
        self._waiting.append((header, time.monotonic()))
        self._look_up()

    def forget(self) -> None:
        """Forget all transforms that move: tf2 mixes them with earlier ones, or refuses these."""
        self._waiting.clear()
        self._buffer.clear()

    def _look_up(self) -> None:
        waiting, now = list(self._waiting), time.monotonic()
        self._waiting.clear()
        for header, since in waiting:
            try:
                found = self._buffer.lookup_transform(
                    self._object_frame, header.frame_id, Time.from_msg(header.stamp))
            except self._tf.TransformException as error:
                if now - since < TF_TIMEOUT_S:
                    self._waiting.append((header, since))
                else:
                    self._diagnostics.reject(MessageError(
                        f"no pose in tf: expected that of the image's frame {header.frame_id!r} "
                        f'in {self._object_frame!r} at its stamp: {error}', 'tf'))
            else:
                self._publish(found.transform, header)

    def _publish(self, transform: Any, header: Header) -> None:
        place = transform.translation
        msg = PoseStamped(
            header=Header(stamp=header.stamp, frame_id=self._object_frame),
            pose=Pose(position=Point(x=place.x, y=place.y, z=place.z),
                      orientation=transform.rotation))
        self._publisher.publish(msg)
        self._on_pose(msg)


def _tf2_ros() -> Any:
    try:
        return import_module('tf2_ros')  # part of a full ROS, but not of the wheels
    except ImportError as error:
        raise ConfigError(
            'parameter pose_source: tf2_ros is not installed: expected it where pose_source is tf '
            f'({error}); install ros-jazzy-tf2-ros-py, or use topic or turntable_joint'
        ) from error
