"""Where the camera's poses come from: a topic, the joint of a turntable, or tf2."""

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
from active_recon.nodes.runtime.qos import HEARD_OFTEN, STREAM
from active_recon.parameters.camera_pose import CameraPoseSettings
from geometry_msgs.msg import Point, Pose, PoseStamped
from msg_tools.cameras import pose_to_msg
from msg_tools.goals import joint_position_from_msg
from rclpy.node import Node
from rclpy.time import Time
from sensor_msgs.msg import JointState
from std_msgs.msg import Header

LOOK_UP_EVERY_S = 0.02
TF_PATIENCE_S = 0.5
"""For so long an image waits for its transform."""
_WAITING = 32  # images

Take = Callable[[PoseStamped], None]


class PoseSource(Protocol):
    """
    What hands on the camera's poses in the object frame.

    Every pose but those of the topic itself is published on `camera/pose` as well, for the
    planner, the viewer and the bags.
    """

    def image_came(self, header: Header) -> None:
        """Hear of an image, by its stamp and the frame of its camera."""


def check_pose_source(settings: CameraPoseSettings) -> None:
    """Raise ConfigError where the poses could not be had."""
    if settings.pose_source == 'turntable_joint':
        settings.as_fixed_camera()
    elif settings.pose_source == 'tf':
        _tf2_ros()


def hear_poses(node: Node, settings: CameraPoseSettings, object_frame: str, take: Take,
               diagnostics: Diagnostics, inputs: AwaitedInputs) -> PoseSource:
    """Return what hands the poses to `take` from now on; raises as `check_pose_source`."""
    if settings.pose_source == 'turntable_joint':
        return TurntablePoses(node, take, diagnostics, inputs, settings.as_fixed_camera(),
                              settings.joint_name, object_frame)
    if settings.pose_source == 'tf':
        return TfPoses(node, take, diagnostics, object_frame)
    return TopicPoses(take, inputs)


class TopicPoses:
    """The poses that others publish on `camera/pose`."""

    def __init__(self, take: Take, inputs: AwaitedInputs) -> None:
        inputs.hear(PoseStamped, 'camera/pose', take, HEARD_OFTEN)

    def image_came(self, header: Header) -> None:
        """Leave it to the joiner, which interpolates."""


class TurntablePoses:
    """The poses of a fixed camera around an object that `turntable/joint_states` turns."""

    def __init__(self, node: Node, take: Take, diagnostics: Diagnostics, inputs: AwaitedInputs,
                 camera: FixedCamera, joint: str, object_frame: str) -> None:
        self._take = take
        self._diagnostics = diagnostics
        self._camera = camera
        self._joint = joint
        self._object_frame = object_frame
        self._publisher = node.create_publisher(PoseStamped, 'camera/pose', STREAM)
        inputs.hear(JointState, 'turntable/joint_states', self._on_joint, HEARD_OFTEN)

    def _on_joint(self, msg: JointState) -> None:
        with self._diagnostics.refusing():
            pose = self._camera.pose_at(joint_position_from_msg(msg, self._joint))
            header = Header(stamp=msg.header.stamp, frame_id=self._object_frame)
            told = pose_to_msg(pose, header)
            self._publisher.publish(told)
            self._take(told)

    def image_came(self, header: Header) -> None:
        """Leave it to the joiner, which interpolates."""


class TfPoses:
    """
    The poses that tf2 tells at each image's stamp, of the frame that the image names.

    tf2 interpolates by itself. Raises ConfigError where it is not installed.
    """

    def __init__(self, node: Node, take: Take, diagnostics: Diagnostics,
                 object_frame: str) -> None:
        self._tf = _tf2_ros()
        self._take = take
        self._diagnostics = diagnostics
        self._object_frame = object_frame
        self._waiting: deque[tuple[Header, float]] = deque(maxlen=_WAITING)
        self._publisher = node.create_publisher(PoseStamped, 'camera/pose', STREAM)
        self._buffer = self._tf.Buffer()
        self._listener = self._tf.TransformListener(self._buffer, node)
        node.create_timer(LOOK_UP_EVERY_S, self._look_up, clock=STEADY)

    def image_came(self, header: Header) -> None:
        """Look the image's pose up, now or when its transform has come."""
        self._waiting.append((header, time.monotonic()))
        self._look_up()

    def _look_up(self) -> None:
        waiting, now = list(self._waiting), time.monotonic()
        self._waiting.clear()
        for header, since in waiting:
            try:
                found = self._buffer.lookup_transform(
                    self._object_frame, header.frame_id, Time.from_msg(header.stamp))
            except self._tf.TransformException as error:
                if now - since < TF_PATIENCE_S:
                    self._waiting.append((header, since))
                else:
                    self._diagnostics.refuse(MessageError(
                        f"expected tf to tell the pose of the image's frame {header.frame_id!r} "
                        f'in {self._object_frame!r} at its stamp: {error}', 'tf'))
            else:
                self._tell(found.transform, header)

    def _tell(self, transform: Any, header: Header) -> None:
        place = transform.translation
        told = PoseStamped(
            header=Header(stamp=header.stamp, frame_id=self._object_frame),
            pose=Pose(position=Point(x=place.x, y=place.y, z=place.z),
                      orientation=transform.rotation))
        self._publisher.publish(told)
        self._take(told)


def _tf2_ros() -> Any:
    try:
        return import_module('tf2_ros')  # a full ROS has it, the wheels have not
    except ImportError as error:
        raise ConfigError(
            'parameter pose_source: expected tf2_ros to be installed where it is tf, but there is '
            f'none ({error}); install ros-jazzy-tf2-ros-py, or use topic or turntable_joint'
        ) from error
