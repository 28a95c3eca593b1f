"""All that is heard of one loop, read into what a page shows."""

from collections.abc import Callable
from functools import partial
import time
from typing import Any

from active_recon.geometry.cameras import Camera, CANONICAL_INTRINSICS
from active_recon.nodes.camera.images import KINDS, NAME
from active_recon.nodes.loop.followed_loop import Loop
from active_recon.nodes.loop.problems import HeardProblems
from active_recon.nodes.runtime.diagnostics import Diagnostics
from active_recon.nodes.runtime.one_form import OneForm
from active_recon.nodes.runtime.polled import Polled, taken
from active_recon.nodes.runtime.qos import HEARD, LATCHED_HEARD_LATE
from active_recon.viewer.link import TopicLink
from active_recon.viewer.state import Observer, own_threshold, Scores, TakenView, thumbnail
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped
from msg_tools.camera_images import pixels_from_msg
from msg_tools.cameras import intrinsics_from_msg, pose_from_msg
from msg_tools.episodes import done_from_msg, episode_from_msg
from msg_tools.goals import scores_from_msg
from msg_tools.images import image_from_msg
from msg_tools.joins import StampJoiner
from msg_tools.stamps import nanoseconds_from_stamp
from msg_tools.voxels import voxel_grid_from_msg
import numpy as np
from numpy.typing import NDArray
from rclpy.node import Node
from rclpy.subscription import Subscription
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, PointCloud2
from std_msgs.msg import Header

_ROLES = {'image': NAME, 'view': 'view', 'occupancy': 'occupancy', 'goal': 'next_view'}
_IMAGES_KEPT = 64


class HeardLoop:
    """
    Hears a loop, and keeps what is known of it in `observer`; nothing is read until `take`.

    Where the nodes of the loop are others than was thought, it is closed, and another is made.
    """

    def __init__(self, node: Node, loop: Loop, diagnostics: Diagnostics) -> None:
        self._node = node
        self._loop = loop
        self._diagnostics = diagnostics
        self.observer = Observer()
        self._problems = HeardProblems(node.get_fully_qualified_name())
        self._joiner = StampJoiner(('view', 'occupancy', 'probabilities'))
        self._images: dict[int, NDArray[np.uint8]] = {}
        self._form = OneForm()
        self._intrinsics = CANONICAL_INTRINSICS
        self._heard_at: dict[str, float] = {}
        self._polled = Polled()
        self._heard: list[tuple[str, Subscription]] = []
        for image, form in KINDS.items():
            self._hear(image, NAME, partial(self._on_image, image.__name__), HEARD, form)
        self._hear(CameraInfo, 'camera/camera_info', self._on_camera_info, HEARD)
        self._hear(PoseStamped, 'camera/pose', self._on_camera, HEARD)
        self._hear(DiagnosticArray, '/diagnostics', self._on_diagnostics, 100)
        for kind, name, callback in (
                (PoseStamped, 'view', self._on_view),
                (PointCloud2, 'occupancy', self._on_occupancy),
                (PointCloud2, 'probabilities', self._on_probabilities),
                (Image, 'network_image', self._on_network_image),
                (PoseStamped, 'next_view', self._on_goal),
                (PointCloud2, 'azimuth_scores', self._on_scores),
                (Header, 'done', self._on_done), (Header, 'episode', self._on_episode)):
            self._hear(kind, name, callback, LATCHED_HEARD_LATE)

    def take(self) -> None:
        """Read what came since the last time."""
        for name, subscription in self._heard:
            for msg in taken(subscription):
                self._heard_at[name] = time.monotonic()
                self._diagnostics.count(name)
                with self._diagnostics.refusing():
                    subscription.callback(msg)

    def links(self) -> dict[str, TopicLink]:
        """Return how things stand with the topics that matter, by their role."""
        now = time.monotonic()
        return {role: TopicLink(
            self._loop.full_name(name), self._publishers(name),
            now - self._heard_at[name] if name in self._heard_at else None)
            for role, name in _ROLES.items()}

    def problems(self) -> dict[str, str]:
        """Return what the nodes say is wrong, by their names."""
        return self._problems.now(time.monotonic())

    def close(self) -> None:
        """Hear nothing more."""
        for _, subscription in self._heard:
            self._node.destroy_subscription(subscription)

    def _hear(self, kind: type, name: str, callback: Callable[[Any], None], qos: Any,
              form: str = '') -> None:
        """Hear a topic, by its name in the loop, in one of its forms."""
        self._heard.append((name, self._node.create_subscription(
            kind, f'{self._loop.full_name(name)}{form}', callback, qos,
            callback_group=self._polled)))

    def _publishers(self, name: str) -> int:
        """Return how many publish a topic, in any of its forms."""
        return sum(self._node.count_publishers(subscription.topic_name)
                   for heard, subscription in self._heard if heard == name)

    def _on_image(self, form: str, msg: Image | CompressedImage) -> None:
        if not self._form.takes(form, time.monotonic()):
            return
        picture = thumbnail(pixels_from_msg(msg))
        self._images[nanoseconds_from_stamp(msg.header.stamp)] = picture
        while len(self._images) > _IMAGES_KEPT:
            del self._images[min(self._images)]
        self.observer.see(picture=picture)

    def _on_network_image(self, msg: Image) -> None:
        self.observer.set_network_image(
            nanoseconds_from_stamp(msg.header.stamp), image_from_msg(msg))

    def _on_diagnostics(self, msg: DiagnosticArray) -> None:
        self._problems.hear(msg, self._loop.namespace, time.monotonic())

    def _on_camera_info(self, msg: CameraInfo) -> None:
        self._intrinsics = intrinsics_from_msg(msg)

    def _camera(self, msg: PoseStamped) -> Camera:
        return Camera(pose_from_msg(msg, self._loop.object_frame), self._intrinsics)

    def _on_camera(self, msg: PoseStamped) -> None:
        self.observer.see(self._camera(msg))

    def _on_view(self, msg: PoseStamped) -> None:
        self._join('view', msg.header, self._camera(msg))

    def _on_occupancy(self, msg: PointCloud2) -> None:
        grid = voxel_grid_from_msg(msg, self._loop.object_size)
        self._join('occupancy', msg.header, own_threshold(grid))

    def _on_probabilities(self, msg: PointCloud2) -> None:
        self._join('probabilities', msg.header, voxel_grid_from_msg(msg, self._loop.object_size))

    def _join(self, name: str, header: Header, part: object) -> None:
        stamp = nanoseconds_from_stamp(header.stamp)
        parts = self._joiner.add(name, stamp, part)
        if parts is not None:
            grid = parts['probabilities']
            view = TakenView(stamp, parts['view'], self._images.get(stamp), grid.entropy())
            self.observer.take_view(view, grid, parts['occupancy'])

    def _on_goal(self, msg: PoseStamped) -> None:
        self.observer.set_goal(nanoseconds_from_stamp(msg.header.stamp), self._camera(msg))

    def _on_scores(self, msg: PointCloud2) -> None:
        _, azimuths, scores = scores_from_msg(msg)
        self.observer.set_scores(
            nanoseconds_from_stamp(msg.header.stamp), Scores(azimuths, scores))

    def _on_done(self, msg: Header) -> None:
        self.observer.set_done(*done_from_msg(msg))

    def _on_episode(self, msg: Header) -> None:
        episode = episode_from_msg(msg)
        self.observer.begin_episode(episode.id, episode.begin)
