"""
Cameras to and from CameraInfo, PoseStamped and PoseArray.

A pose is that of the camera's optical frame in the object frame. Pixel coordinates of the core
begin at the image's corner (the first pixel's centre is 0.5), those of ROS at that centre (0).
"""

from collections.abc import Iterable
import math

from active_recon.errors import MessageError, ViewError
from active_recon.geometry.cameras import Camera, Intrinsics, OBJECT_FRAME
from active_recon.geometry.lenses import Distortion, MODELS
from active_recon.geometry.rotations import pose_from_quaternion, quaternion_from_matrix
from geometry_msgs.msg import Point, Pose, PoseArray, PoseStamped, Quaternion
import numpy as np
from numpy.typing import NDArray
from sensor_msgs.msg import CameraInfo
from std_msgs.msg import Header

_LARGEST = 1e9  # metres or pixels: larger values may overflow


def intrinsics_from_msg(msg: CameraInfo) -> Intrinsics:
    """
    Return the lens given by `k` and `d`, for the image after `roi` and `binning`.

    Without distortion coefficients other than 0 it is a pinhole. Raises MessageError if the size
    is 0, a focal length is not finite and above 0, the distortion model is unknown, or the region
    of interest exceeds the sensor.
    """
    fx, cx, fy, cy = (float(msg.k[index]) for index in (0, 2, 4, 5))
    if msg.width == 0 or msg.height == 0:
        raise MessageError('invalid camera info: expected an image size above 0, '
                           f'got {msg.width} x {msg.height}', 'camera_info')
    if not _sensible(fx, fy, cx, cy) or fx <= 0 or fy <= 0:
        raise MessageError('uncalibrated camera info: expected finite focal lengths above 0, '
                           f'got fx {fx}, fy {fy}, cx {cx}, cy {cy}', 'camera_info')
    left, top, width, height = _region(msg)
    across, down = max(int(msg.binning_x), 1), max(int(msg.binning_y), 1)
    if width < across or height < down:
        raise MessageError(f'invalid binning: expected at most {width} x {height}, got '
                           f'binning_x {across}, binning_y {down}', 'camera_info')
    return Intrinsics(fx / across, fy / down, (cx + 0.5 - left) / across, (cy + 0.5 - top) / down,
                      width // across, height // down, _distortion(msg))


def intrinsics_to_msg(intrinsics: Intrinsics, header: Header) -> CameraInfo:
    """Return a lens as the CameraInfo of a camera without cropping and binning."""
    fx, fy, cx, cy = intrinsics.fx, intrinsics.fy, intrinsics.cx - 0.5, intrinsics.cy - 0.5
    bent = intrinsics.distortion
    return CameraInfo(
        header=header, width=intrinsics.width, height=intrinsics.height,
        distortion_model=bent.model if bent else 'plumb_bob',
        d=list(bent.coefficients) if bent else [0.0] * 5,
        k=[fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0],
        r=[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        p=[fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0])


def _region(msg: CameraInfo) -> tuple[int, int, int, int]:
    """Return left, top, width and height of the region of interest on the sensor."""
    roi = msg.roi
    left, top = int(roi.x_offset), int(roi.y_offset)
    width = int(roi.width) or int(msg.width) - left
    height = int(roi.height) or int(msg.height) - top
    if min(width, height) <= 0 or left + width > msg.width or top + height > msg.height:
        raise MessageError(
            f'invalid region of interest: expected one within {msg.width} x {msg.height}, got '
            f'{roi.width} x {roi.height} at {left}, {top}', 'camera_info')
    return left, top, width, height


def _distortion(msg: CameraInfo) -> Distortion | None:
    coefficients = tuple(float(value) for value in msg.d)
    if not any(coefficients) and msg.distortion_model in ('', *MODELS):
        return None
    most = max(MODELS.get(msg.distortion_model, (len(coefficients),)))
    if not any(coefficients[most:]):  # OpenCV has 14, of which calibrations set some to 0
        coefficients = coefficients[:most]
    try:
        return Distortion(msg.distortion_model, coefficients)
    except ViewError as error:
        raise MessageError(str(error), error.kind) from error


def pose_from_msg(msg: PoseStamped, frame: str = OBJECT_FRAME, advice: str = '',
                  at_origin: bool = False) -> NDArray[np.float64]:
    """
    Return the pose, (4, 4), object from optical frame; its quaternion is normalised.

    Raises MessageError if the pose is in another frame, which ends with the `advice` for that
    case, not finite, a million kilometres away or at the frame's origin, or its quaternion is
    zero. With `at_origin` the object is not there, and the camera may be.
    """
    _check_frame(msg.header, frame, advice)
    return _matrix(msg.pose, at_origin)


def poses_from_msg(msg: PoseArray, frame: str = OBJECT_FRAME) -> list[NDArray[np.float64]]:
    """Return the poses, (4, 4) each; raises MessageError as `pose_from_msg` does."""
    _check_frame(msg.header, frame)
    return [_matrix(pose) for pose in msg.poses]


def _check_frame(header: Header, frame: str, advice: str = '') -> None:
    if header.frame_id != frame:
        raise MessageError(f'wrong frame of a camera pose: expected {frame!r}, '
                           f'got {header.frame_id!r}{advice and "; "}{advice}', 'frame')


def _matrix(pose: Pose, at_origin: bool = False) -> NDArray[np.float64]:
    position, quaternion = numbers_from_msgs(pose.position, pose.orientation, 'camera pose')
    if math.hypot(*position) < 1e-6 and not at_origin:
        raise MessageError("invalid camera pose: it is at the object's centre", 'pose')
    return pose_from_quaternion(position, quaternion)


def numbers_from_msgs(point: Point, turn: Quaternion,
                      what: str) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """
    Return a position (3,), and a quaternion (4,), x, y, z, w, of any length.

    Raises MessageError, in which `what` names them, if they are not finite, a million kilometres
    away, or the quaternion is zero.
    """
    position = float(point.x), float(point.y), float(point.z)
    quaternion = float(turn.x), float(turn.y), float(turn.z), float(turn.w)
    if not _sensible(*position, *quaternion):
        raise MessageError(f'{what} not finite: got position {list(position)} and '
                           f'quaternion {list(quaternion)}', 'pose')
    if math.hypot(*quaternion) < 1e-6:
        raise MessageError(f'invalid {what}: expected a unit quaternion, '
                           f'got {list(quaternion)}', 'quaternion')
    return position, quaternion


def pose_to_msg(pose: NDArray[np.float64], header: Header) -> PoseStamped:
    """Return a pose, (4, 4), as a message; the header names the object frame."""
    return PoseStamped(header=header, pose=_pose_msg(pose))


def poses_to_msg(poses: Iterable[NDArray[np.float64]], header: Header) -> PoseArray:
    """Return poses, (4, 4) each, as a message; the header names the object frame."""
    return PoseArray(header=header, poses=[_pose_msg(pose) for pose in poses])


def _pose_msg(pose: NDArray[np.float64]) -> Pose:
    x, y, z, w = quaternion_from_matrix(pose[:3, :3])
    px, py, pz = pose[:3, 3].tolist()
    return Pose(position=Point(x=px, y=py, z=pz), orientation=Quaternion(x=x, y=y, z=z, w=w))


def pose_through_msg(pose: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a pose, (4, 4), converted to a message and back, which rounds its rotation."""
    return pose_from_msg(pose_to_msg(pose, Header(frame_id=OBJECT_FRAME)))


def camera_from_msgs(info: CameraInfo, pose: PoseStamped, frame: str = OBJECT_FRAME) -> Camera:
    """Return the camera given by both messages; raises MessageError."""
    return Camera(pose_from_msg(pose, frame), intrinsics_from_msg(info))


def camera_to_msgs(camera: Camera, stamp: Header, frame: str = OBJECT_FRAME
                   ) -> tuple[CameraInfo, PoseStamped]:
    """Return both messages of a camera; `stamp` has the stamp and the camera's own frame."""
    return (intrinsics_to_msg(camera.intrinsics, stamp),
            pose_to_msg(camera.pose, Header(stamp=stamp.stamp, frame_id=frame)))


def _sensible(*values: float) -> bool:
    """Return whether all values are finite and of a plausible size."""
    return all(abs(value) < _LARGEST for value in values)
