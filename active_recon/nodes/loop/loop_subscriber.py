"""Subscribes to all topics of a loop, and keeps the state that the page and the demo show."""

from collections.abc import Callable
from functools import partial
import time
from typing import Any

from active_recon.geometry.cameras import Camera, CANONICAL_INTRINSICS
from active_recon.nodes.camera.images import IMAGE_SUFFIXES, IMAGE_TOPIC
from active_recon.nodes.loop.followed_loop import Loop
from active_recon.nodes.loop.problem_monitor import ProblemMonitor
from active_recon.nodes.loop.reconstruction_publisher import MOST_VIEWS
from active_recon.nodes.runtime.diagnostics import Diagnostics
from active_recon.nodes.runtime.polled import PolledCallbackGroup, take_messages
from active_recon.nodes.runtime.qos import LATCHED_POLLED_QOS, SENSOR_QOS
from active_recon.nodes.runtime.transport_selector import TransportSelector
from active_recon.viewer.link import TopicLink
from active_recon.viewer.state import Observer, Scores, thumbnail
from active_recon.viewer.view_result import Surface, ViewResult
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseArray, PoseStamped
from msg_tools.camera_images import pixels_from_msg
from msg_tools.cameras import intrinsics_from_msg, pose_from_msg
from msg_tools.episodes import done_from_msg, episode_from_msg
from msg_tools.goals import scores_from_msg
from msg_tools.images import image_from_msg
from msg_tools.joins import StampJoiner
from msg_tools.markers import surface_from_msg
from msg_tools.quality import quality_from_msg
from msg_tools.reasons import goal_reason_from_msg
from msg_tools.stamps import nanoseconds_from_stamp
from msg_tools.voxels import voxel_grid_from_msg
import numpy as np
from numpy.typing import NDArray
from rclpy.node import Node
from rclpy.subscription import Subscription
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, PointCloud2
from std_msgs.msg import Header
from visualization_msgs.msg import Marker

_ROLES = {'image': IMAGE_TOPIC, 'view': 'view', 'occupancy': 'occupancy', 'goal': 'next_view'}
_IMAGES_KEPT = 64


class LoopSubscriber:
    """
    Subscribes to a loop and keeps its state in `observer`; messages are read by `update` only.

    A message that cannot be read is rejected in the node's diagnostics.
    """

    def __init__(self, node: Node, loop: Loop, diagnostics: Diagnostics,
                 observer: Observer | None = None) -> None:
        self._node = node
        self._loop = loop
        self._diagnostics = diagnostics
        self.observer = observer or Observer()
        self._problems = ProblemMonitor(node.get_fully_qualified_name())
        self._joiner = StampJoiner(('view', 'occupancy', 'probabilities'))
        self._images: dict[int, NDArray[np.uint8]] = {}
        self._selector = TransportSelector()
        self._intrinsics = CANONICAL_INTRINSICS
        self._received_at: dict[str, float] = {}
        self._message_received = 0  # nanoseconds
        self._polled = PolledCallbackGroup()
        self._subscriptions: list[tuple[str, Subscription]] = []
        for image, suffix in IMAGE_SUFFIXES.items():
            self._subscribe(image, IMAGE_TOPIC, partial(self._on_image, suffix), SENSOR_QOS,
                            suffix)
        self._subscribe(CameraInfo, 'camera/camera_info', self._on_camera_info, SENSOR_QOS)
        self._subscribe(PoseStamped, 'camera/pose', self._on_camera, SENSOR_QOS)
        self._subscribe(DiagnosticArray, '/diagnostics', self._on_diagnostics, 100)
        for kind, name, callback in (
                (PoseStamped, 'view', self._on_view),
                (PoseArray, 'views', self._on_views),
                (PointCloud2, 'occupancy', self._on_occupancy),
                (PointCloud2, 'probabilities', self._on_probabilities),
                (DiagnosticArray, 'quality', self._on_quality),
                (Marker, 'mesh', self._on_mesh),
                (Image, 'network_image', self._on_network_image),
                (PoseStamped, 'next_view', self._on_goal),
                (PointCloud2, 'azimuth_scores', self._on_scores),
                (DiagnosticArray, 'goal_reason', self._on_reason),
                (Header, 'done', self._on_done), (Header, 'episode', self._on_episode)):
            self._subscribe(kind, name, callback, LATCHED_POLLED_QOS)

    def update(self) -> None:
        """Read the messages received since the last call."""
        for name, subscription in self._subscriptions:
            for msg, self._message_received in take_messages(subscription):
                self._received_at[name] = time.monotonic()
                self._diagnostics.count(name)
                with self._diagnostics.rejecting():
                    subscription.callback(msg)

    def links(self) -> dict[str, TopicLink]:
        """Return the state of the topics that matter, by their role."""
        now = time.monotonic()
        return {role: TopicLink(
            self._loop.full_name(name), self._publishers(name),
            now - self._received_at[name] if name in self._received_at else None)
            for role, name in _ROLES.items()}

    def problems(self) -> dict[str, str]:
        """Return the problems that nodes report, by their names."""
        return self._problems.current(time.monotonic())

    def close(self) -> None:
        """Unsubscribe from all topics."""
        for _, subscription in self._subscriptions:
            self._node.destroy_subscription(subscription)

    def _subscribe(self, kind: type, name: str, callback: Callable[[Any], None], qos: Any,
                   suffix: str = '') -> None:
        """Subscribe to a topic by its name in the loop, with the suffix of its transport."""
        self._subscriptions.append((name, self._node.create_subscription(
            kind, f'{self._loop.full_name(name)}{suffix}', callback, qos,
            callback_group=self._polled)))

    def _publishers(self, name: str) -> int:
        """Return the number of publishers of a topic, on any transport."""
        return sum(self._node.count_publishers(subscription.topic_name)
                   for each, subscription in self._subscriptions if each == name)

    def _on_image(self, suffix: str, msg: Image | CompressedImage) -> None:
        if not self._selector.accepts(suffix or 'raw', time.monotonic()):
            return
        picture = thumbnail(pixels_from_msg(msg))
        self._images[nanoseconds_from_stamp(msg.header.stamp)] = picture
        while len(self._images) > _IMAGES_KEPT:
            del self._images[next(iter(self._images))]  # the first that came: stamps may go back
        self.observer.set_camera(picture=picture)

    def _on_network_image(self, msg: Image) -> None:
        self.observer.set_network_image(
            nanoseconds_from_stamp(msg.header.stamp), image_from_msg(msg))

    def _on_diagnostics(self, msg: DiagnosticArray) -> None:
        self._problems.add(msg, self._loop.namespace, time.monotonic())

    def _on_camera_info(self, msg: CameraInfo) -> None:
        self._intrinsics = intrinsics_from_msg(msg)

    def _camera(self, msg: PoseStamped) -> Camera:
        return Camera(pose_from_msg(msg, self._loop.object_frame), self._intrinsics)

    def _on_camera(self, msg: PoseStamped) -> None:
        self.observer.set_camera(self._camera(msg))

    def _on_view(self, msg: PoseStamped) -> None:
        self._join('view', msg.header, self._camera(msg))

    def _on_views(self, msg: PoseArray) -> None:
        if len(msg.poses) < MOST_VIEWS:  # there may be more
            self.observer.set_count(nanoseconds_from_stamp(msg.header.stamp), len(msg.poses))

    def _on_occupancy(self, msg: PointCloud2) -> None:
        if not self._loop.has_size:  # it is latched: the next subscriber receives it again
            return
        latency = (self._message_received - nanoseconds_from_stamp(msg.header.stamp)) / 1e9
        grid = voxel_grid_from_msg(msg, self._loop.object_size)
        self._join('occupancy', msg.header, (grid, latency))

    def _on_probabilities(self, msg: PointCloud2) -> None:
        if self._loop.has_size:
            self._join(
                'probabilities', msg.header, voxel_grid_from_msg(msg, self._loop.object_size))

    def _on_quality(self, msg: DiagnosticArray) -> None:
        self.observer.set_quality(nanoseconds_from_stamp(msg.header.stamp), quality_from_msg(msg))

    def _on_mesh(self, msg: Marker) -> None:
        surface = None
        if msg.action == Marker.ADD:
            triangles, colors = surface_from_msg(msg)
            surface = None if colors is None else Surface(triangles, colors)
        self.observer.set_surface(nanoseconds_from_stamp(msg.header.stamp), surface)

    def _join(self, name: str, header: Header, part: object) -> None:
        stamp = nanoseconds_from_stamp(header.stamp)
        parts = self._joiner.add(name, stamp, part)
        if parts is not None:
            grid = parts['probabilities']
            occupied, latency = parts['occupancy']
            view = ViewResult(
                stamp, parts['view'], self._images.get(stamp), grid.entropy(), latency)
            self.observer.add_view(view, grid, occupied)

    def _on_goal(self, msg: PoseStamped) -> None:
        self.observer.set_goal(nanoseconds_from_stamp(msg.header.stamp), self._camera(msg))

    def _on_scores(self, msg: PointCloud2) -> None:
        positions, _, scores = scores_from_msg(msg)
        self.observer.set_scores(
            nanoseconds_from_stamp(msg.header.stamp), Scores(positions, scores))

    def _on_reason(self, msg: DiagnosticArray) -> None:
        self.observer.set_goal_reason(
            nanoseconds_from_stamp(msg.header.stamp), goal_reason_from_msg(msg))

    def _on_done(self, msg: Header) -> None:
        self.observer.set_done(*done_from_msg(msg))

    def _on_episode(self, msg: Header) -> None:
        episode = episode_from_msg(msg)
        self.observer.begin_episode(episode.id, episode.begin)
