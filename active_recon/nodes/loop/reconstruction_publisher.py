"""Publishes the reconstruction after each view, all messages with the stamp of its image."""

from collections import deque

from active_recon.nodes.runtime.qos import LATCHED_QOS
from active_recon.reconstructor import Reconstruction
from active_recon.volumes.voxels import PUBLISHED_FLOOR
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseArray, PoseStamped
from msg_tools.cameras import pose_to_msg, poses_to_msg
from msg_tools.entropy import entropy_to_msg
from msg_tools.images import image_to_msg, latent_to_msg
from msg_tools.quality import quality_to_msg
from msg_tools.stamps import stamp_from_nanoseconds
from msg_tools.voxels import voxel_grid_to_msg
import numpy as np
from numpy.typing import NDArray
from rclpy.node import Node
from sensor_msgs.msg import Image, JointState, PointCloud2
from std_msgs.msg import Header

MOST_VIEWS = 64
"""How many views of an episode, the last ones, `views` tells of."""


class ReconstructionPublisher:
    """
    Publishes `occupancy`, `probabilities`, `latent`, `entropy`, `view`, its images and `views`.

    And `quality`, where the network `judges_quality`: elsewhere nobody is to wait for it. It tells
    the SHA-256 of the network's weights.
    """

    def __init__(self, node: Node, frame: str, judges_quality: bool,
                 weights_sha256: str) -> None:
        self._frame, self._weights = frame, weights_sha256
        self._view_pub = node.create_publisher(PoseStamped, 'view', LATCHED_QOS)
        self._views_pub = node.create_publisher(PoseArray, 'views', LATCHED_QOS)
        self._poses: deque[NDArray[np.float64]] = deque(maxlen=MOST_VIEWS)
        self._view_image_pub = node.create_publisher(Image, 'view_image', LATCHED_QOS)
        self._network_image_pub = node.create_publisher(Image, 'network_image', LATCHED_QOS)
        self._occupancy_pub = node.create_publisher(PointCloud2, 'occupancy', LATCHED_QOS)
        self._probabilities_pub = node.create_publisher(PointCloud2, 'probabilities', LATCHED_QOS)
        self._latent_pub = node.create_publisher(Image, 'latent', LATCHED_QOS)
        self._entropy_pub = node.create_publisher(JointState, 'entropy', LATCHED_QOS)
        self._quality_pub = node.create_publisher(
            DiagnosticArray, 'quality', LATCHED_QOS) if judges_quality else None

    def begin_episode(self, stamp: int) -> None:
        """Publish that the episode which begins at a stamp in nanoseconds has no views."""
        self._poses.clear()
        self._views_pub.publish(poses_to_msg([], self._header(stamp)))

    def publish_occupancy(self, stamp: int, reconstruction: Reconstruction,
                          threshold: float) -> None:
        """Publish the occupied cells, at the stamp of the view in nanoseconds."""
        self._occupancy_pub.publish(
            voxel_grid_to_msg(reconstruction.grid, threshold, self._header(stamp)))

    def publish_view(self, stamp: int, pose: NDArray[np.float64], reconstruction: Reconstruction,
                     cleared_image: NDArray[np.uint8] | None) -> None:
        """
        Publish all the rest, at the stamp of the view in nanoseconds.

        - pose: (4, 4), of the view's camera in the object frame
        - cleared_image: (H, W, 3) uint8 RGB, the image without its background; None: unchanged
        """
        header = self._header(stamp)
        self._poses.append(pose)
        self._views_pub.publish(poses_to_msg(self._poses, header))
        self._latent_pub.publish(latent_to_msg(reconstruction.latent, header))
        self._view_pub.publish(pose_to_msg(pose, header))
        grid = reconstruction.grid
        self._probabilities_pub.publish(voxel_grid_to_msg(grid, PUBLISHED_FLOOR, header))
        self._entropy_pub.publish(entropy_to_msg(grid.entropy(), header))
        # While this judges, the planner reads what came before; then come images, for people
        if self._quality_pub is not None and reconstruction.quality is not None:
            self._quality_pub.publish(
                quality_to_msg(reconstruction.quality, header, self._weights, grid.size))
        if cleared_image is not None:
            self._view_image_pub.publish(image_to_msg(cleared_image, header))
        if reconstruction.image is not None:
            self._network_image_pub.publish(image_to_msg(reconstruction.image[..., :3], header))

    def _header(self, stamp: int) -> Header:
        return Header(stamp=stamp_from_nanoseconds(stamp), frame_id=self._frame)
