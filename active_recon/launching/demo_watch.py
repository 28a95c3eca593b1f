"""The demo's own node: it follows the loop from outside and asks for the mesh and the bag."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
import time

from active_recon.geometry.cameras import Camera
from active_recon.launching.loop_watch import joined_domain, LoopWatch
from active_recon.nodes.runtime.qos import LATCHED
from active_recon.seen_view import SeenView
from active_recon.volumes.voxels import iou, VoxelGrid
from geometry_msgs.msg import PoseStamped
from msg_tools.cameras import pose_from_msg
from msg_tools.episodes import done_from_msg
from msg_tools.goals import view_goal_from_msg
from msg_tools.images import image_from_msg
from msg_tools.joins import StampJoiner
from msg_tools.stamps import nanoseconds_from_stamp
from msg_tools.voxels import voxel_grid_from_msg
import numpy as np
from numpy.typing import NDArray
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import Image, PointCloud2
from std_msgs.msg import Header

_IMAGES_KEPT = 64


class DemoWatch(LoopWatch):
    """
    What has been seen of the loop so far.

    `views` grows as the loop goes on; `azimuth` is where the camera is (radians), `goal` the
    camera of the next view (None before they are known); `truth` gives the object's true cells at
    so many a side; `done` is the reason for the end, '' before it.
    """

    def __init__(self, node: Node, executor: SingleThreadedExecutor,
                 truth: Callable[[int], NDArray[np.bool_]]) -> None:
        super().__init__(node, executor)
        self.views: list[SeenView] = []
        self.azimuth: float | None = None
        self.goal: Camera | None = None
        self.done = ''
        self._truth = truth
        self._images: dict[int, NDArray[np.uint8]] = {}
        self._joiner = StampJoiner(('view', 'occupancy', 'probabilities'))
        for kind, topic, callback, qos in (
                (Image, 'camera/image_raw', self._on_image, qos_profile_sensor_data),
                (PoseStamped, 'camera/pose', self._on_pose, qos_profile_sensor_data),
                (PoseStamped, 'next_view', self._on_goal, LATCHED),
                (PoseStamped, 'view', self._on_view, LATCHED),
                (PointCloud2, 'occupancy', self._on_occupancy, LATCHED),
                (PointCloud2, 'probabilities', self._on_probabilities, LATCHED),
                (Header, 'done', self._on_done, LATCHED)):
            node.create_subscription(kind, topic, callback, qos)

    def has_views(self, count: int) -> bool:
        """Return whether as many views have been seen."""
        return len(self.views) >= count

    def _on_image(self, msg: Image) -> None:
        self._images[nanoseconds_from_stamp(msg.header.stamp)] = image_from_msg(msg)
        while len(self._images) > _IMAGES_KEPT:
            del self._images[min(self._images)]

    def _on_pose(self, msg: PoseStamped) -> None:
        self.azimuth = Camera(pose_from_msg(msg)).azimuth

    def _on_goal(self, msg: PoseStamped) -> None:
        self.goal = view_goal_from_msg(msg)

    def _on_view(self, msg: PoseStamped) -> None:
        self._join('view', msg.header, Camera(pose_from_msg(msg)).azimuth)

    def _on_occupancy(self, msg: PointCloud2) -> None:
        stamp = nanoseconds_from_stamp(msg.header.stamp)
        self._join('occupancy', msg.header,
                   (voxel_grid_from_msg(msg), (time.time_ns() - stamp) / 1e9))

    def _on_probabilities(self, msg: PointCloud2) -> None:
        self._join('probabilities', msg.header, voxel_grid_from_msg(msg))

    def _on_done(self, msg: Header) -> None:
        _, self.done = done_from_msg(msg)

    def _join(self, name: str, header: Header, part: object) -> None:
        stamp = nanoseconds_from_stamp(header.stamp)
        parts = self._joiner.add(name, stamp, part)
        if parts is None:
            return
        grid: VoxelGrid = parts['probabilities']
        cloud, latency = parts['occupancy']
        occupied = cloud.as_fine_as(grid)
        truth = self._truth(len(occupied.occupancy))
        self.views.append(SeenView(
            len(self.views) + 1, parts['view'], self._images.get(stamp), occupied,
            grid.entropy(), float(iou(occupied.occupied(0), truth)), latency))


@contextmanager
def watching(truth: Callable[[int], NDArray[np.bool_]]) -> Iterator[DemoWatch]:
    """Join the domain that the environment names, `truth` as DemoWatch has it."""
    with joined_domain('_demo') as (node, executor):
        yield DemoWatch(node, executor, truth)
