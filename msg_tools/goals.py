"""Goals of the view planner to and from their messages."""

from collections.abc import Sequence
import math

from active_recon.errors import MessageError
from active_recon.geometry.cameras import Camera, OBJECT_FRAME, wrap_azimuth
from geometry_msgs.msg import PoseStamped
from msg_tools.cameras import pose_from_msg, pose_to_msg
from msg_tools.clouds import cloud_from_msg, cloud_to_msg
import numpy as np
from numpy.typing import NDArray
from sensor_msgs.msg import JointState, PointCloud2
from std_msgs.msg import Header

JOINT = 'camera_azimuth'
SCORE_FIELDS = ('x', 'y', 'z', 'azimuth', 'score')


def view_goal_from_msg(msg: PoseStamped, frame: str = OBJECT_FRAME) -> Camera:
    """Return the goal's camera; raises MessageError as `pose_from_msg` does."""
    return Camera(pose_from_msg(msg, frame))


def view_goal_to_msg(camera: Camera, header: Header) -> PoseStamped:
    """Return the pose of a goal's camera; the header's frame is the object's."""
    return pose_to_msg(camera.pose, header)


def azimuth_goal_from_msg(msg: JointState) -> float:
    """
    Return the goal's azimuth in [0, 2 pi); the joint may have any name.

    Raises MessageError unless there is exactly one position, and it is finite.
    """
    if len(msg.position) != 1:
        raise MessageError('invalid azimuth goal: expected one position, '
                           f'got {len(msg.position)}', 'goal')
    azimuth = float(msg.position[0])
    if not math.isfinite(azimuth):
        raise MessageError(f'azimuth goal not finite: expected radians, got {azimuth}', 'goal')
    return wrap_azimuth(azimuth)


def joint_position_from_msg(msg: JointState, joint: str = '') -> float:
    """
    Return the position of the joint of that name, or of the only joint for ''.

    Raises MessageError if the message does not have it.
    """
    if joint and joint in msg.name and msg.name.index(joint) < len(msg.position):
        return float(msg.position[msg.name.index(joint)])
    if joint or len(msg.position) != 1:
        hint = '; name the turntable with joint_name' if not joint and len(msg.position) else ''
        raise MessageError(f'no joint position: expected one of {joint or "a single joint"}, got '
                           f'{len(msg.position)} of {", ".join(msg.name) or "no names"}{hint}',
                           'joint')
    return float(msg.position[0])


def azimuth_goal_to_msg(azimuth: float, header: Header) -> JointState:
    """Return an azimuth of the camera, radians, as the position of a joint at rest."""
    # Some readers outside ROS fail on empty sequences, so none is left empty
    return JointState(
        header=header, name=[JOINT], position=[wrap_azimuth(azimuth)],
        velocity=[0.0], effort=[0.0])


def scores_from_msg(msg: PointCloud2) -> tuple[
        NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]:
    """Return the candidates' positions (N, 3) in metres, azimuths (N,) and scores (N,)."""
    table = cloud_from_msg(msg, SCORE_FIELDS)
    return table[:, :3], table[:, 3], table[:, 4]


def scores_to_msg(candidates: Sequence[Camera], scores: NDArray[np.float32],
                  header: Header) -> PointCloud2:
    """Return N candidates and their scores, (N,), at the cameras' positions."""
    return score_table_to_msg(
        np.array([camera.position for camera in candidates]).reshape(-1, 3),
        np.array([camera.azimuth for camera in candidates]), scores, header)


def score_table_to_msg(positions: NDArray[np.floating], azimuths: NDArray[np.floating],
                       scores: NDArray[np.floating], header: Header) -> PointCloud2:
    """Return candidates by their positions (N, 3), azimuths (N,) and scores (N,)."""
    table = np.column_stack([positions, azimuths, scores]).astype(np.float32)
    return cloud_to_msg(table, SCORE_FIELDS, header)
