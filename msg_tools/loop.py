"""The messages that the loop's nodes publish for one view and for one goal, by topic name."""

from typing import Any

from active_recon.geometry.cameras import Camera, OBJECT_FRAME
from active_recon.policies.reasons import GoalReason
from active_recon.quality.quality import Quality
from active_recon.volumes.depth_images import DepthImage
from active_recon.volumes.voxels import VoxelGrid
from msg_tools.cameras import camera_to_msgs, pose_to_msg
from msg_tools.entropy import entropy_to_msg
from msg_tools.goals import azimuth_goal_to_msg, score_table_to_msg, view_goal_to_msg
from msg_tools.images import depth_to_msg, image_to_msg, latent_to_msg
from msg_tools.quality import quality_to_msg
from msg_tools.reasons import goal_reason_to_msg
from msg_tools.stamps import stamp_from_nanoseconds
from msg_tools.voxels import voxel_grid_to_msg
import numpy as np
from numpy.typing import NDArray
from std_msgs.msg import Header

CAMERA_FRAME = 'camera_optical_frame'


def image_to_msgs(stamp: int, image: NDArray[np.uint8], camera: Camera,
                  object_frame: str = OBJECT_FRAME) -> dict[str, Any]:
    """Return a camera's messages for an image, (H, W, 3) uint8 RGB, at a stamp in ns."""
    header = _header(stamp, CAMERA_FRAME)
    info, pose = camera_to_msgs(camera, header, object_frame)
    return {'camera/pose': pose, 'camera/camera_info': info,
            'camera/image_raw': image_to_msg(image, header)}


def depth_to_msgs(stamp: int, depth: DepthImage) -> dict[str, Any]:
    """Return a depth camera's messages at a stamp in ns; aligned depth has no camera info."""
    header = _header(stamp, CAMERA_FRAME)
    messages: dict[str, Any] = {'camera/depth/image_raw': depth_to_msg(depth.metres, header)}
    if depth.camera is not None:
        messages['camera/depth/camera_info'], _ = camera_to_msgs(depth.camera, header)
    return messages


def view_to_msgs(stamp: int, camera: Camera, probabilities: VoxelGrid | None,
                 occupied: VoxelGrid | None, latent: NDArray[np.float32] | None,
                 entropy: float | None, quality: Quality | None = None,
                 object_frame: str = OBJECT_FRAME) -> dict[str, Any]:
    """
    Return the reconstructor's messages for a view, at the stamp of its image in ns.

    Cells that are 0 in the grids are not published; nor is anything that is None.
    """
    header = _header(stamp, object_frame)
    messages: dict[str, Any] = {}
    if occupied is not None:
        messages['occupancy'] = voxel_grid_to_msg(occupied, 0, header)
    if latent is not None:
        messages['latent'] = latent_to_msg(latent, header)
    messages['view'] = pose_to_msg(camera.pose, header)
    if probabilities is not None:
        messages['probabilities'] = voxel_grid_to_msg(probabilities, 0, header)
    if entropy is not None:
        messages['entropy'] = entropy_to_msg(entropy, header)
    if quality is not None:
        messages['quality'] = quality_to_msg(quality, header)
    return messages


def goal_to_msgs(
        stamp: int, camera: Camera,
        scores: tuple[NDArray[np.floating], NDArray[np.floating], NDArray[np.floating]] | None,
        reason: GoalReason | None = None, object_frame: str = OBJECT_FRAME) -> dict[str, Any]:
    """
    Return the planner's messages for a goal at a stamp in ns: camera, candidates and reason.

    `scores` are the candidates' positions (N, 3), azimuths (N,) and scores (N,); None omits them,
    and the reason.
    """
    header = _header(stamp, object_frame)
    messages: dict[str, Any] = {}
    if scores is not None:
        messages['azimuth_scores'] = score_table_to_msg(*scores, header)
    messages['next_view'] = view_goal_to_msg(camera, header)
    messages['next_azimuth'] = azimuth_goal_to_msg(camera.azimuth, header)
    if reason is not None:
        messages['goal_reason'] = goal_reason_to_msg(reason, header)
    return messages


def _header(stamp: int, frame: str) -> Header:
    return Header(stamp=stamp_from_nanoseconds(stamp), frame_id=frame)
