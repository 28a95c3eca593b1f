"""ROS shell of the page: it hears the loop as anyone would, and shows it in the browser."""

from collections.abc import Callable
from functools import partial
import os
import time
from typing import Any

from active_recon.cameras import Camera, CANONICAL_INTRINSICS
from active_recon.nodes.diagnostics import Diagnostics
from active_recon.nodes.parameters import Parameters, ReadOnlySaysWhy
from active_recon.nodes.polled import Polled, taken
from active_recon.nodes.qos import HEARD, LATCHED_HEARD_LATE
from active_recon.nodes.qos_warnings import QosWarnings
from active_recon.nodes.run import run_node
from active_recon.nodes.settings.viewer import ViewerSettings
from active_recon.viewer.link import link_words, TopicLink
from active_recon.viewer.page import Page
from active_recon.viewer.state import Observer, own_threshold, Scores, TakenView, thumbnail
from geometry_msgs.msg import PoseStamped
from msg_tools.cameras import intrinsics_from_msg, pose_from_msg
from msg_tools.episodes import done_from_msg, episode_from_msg
from msg_tools.goals import scores_from_msg
from msg_tools.images import image_from_msg
from msg_tools.joins import StampJoiner
from msg_tools.stamps import nanoseconds_from_stamp
from msg_tools.voxels import voxel_grid_from_msg
import numpy as np
from numpy.typing import NDArray
from rclpy.client import Client
from rclpy.subscription import Subscription
from rclpy.task import Future
from sensor_msgs.msg import CameraInfo, Image, PointCloud2
from std_msgs.msg import Header
from std_srvs.srv import Trigger

BUTTONS = {'next_object': ('Next object', 'Show the camera the next object, as a new episode.'),
           'start_episode': ('New episode', 'Forget the object and begin again.')}
_ROLES = {'image': 'camera/image_raw', 'view': 'view', 'occupancy': 'occupancy',
          'goal': 'next_view'}
_FOLLOW_EVERY_S = 1 / 36
_TELL_EVERY_S = 0.5
_IMAGES_KEPT = 64


class ViewerNode(ReadOnlySaysWhy, QosWarnings):
    """Follow the loop from outside and draw what is known of it; ask for what is clicked."""

    def __init__(self) -> None:
        super().__init__('viewer')
        settings = Parameters(self, ViewerSettings).now
        self._size = settings.object_size
        self._frame = settings.object_frame
        self._observer = Observer()
        self._joiner = StampJoiner(('view', 'occupancy', 'probabilities'))
        self._images: dict[int, NDArray[np.uint8]] = {}
        self._intrinsics = CANONICAL_INTRINSICS
        self._heard_at: dict[str, float] = {}
        self._polled = Polled()
        self._heard: dict[str, Subscription] = {}
        self._diagnostics = Diagnostics(self)
        self._page = Page('active_recon, live', self._size, settings.port)
        self._askable: dict[str, Client] = {}
        for service, (label, hint) in BUTTONS.items():
            self._page.add_button(label, hint)
            self._askable[label] = self.create_client(Trigger, service)
        self._hear(Image, _ROLES['image'], self._on_image, HEARD)
        self._hear(CameraInfo, 'camera/camera_info', self._on_camera_info, HEARD)
        self._hear(PoseStamped, 'camera/pose', self._on_camera, HEARD)
        self._hear(PoseStamped, _ROLES['view'], self._on_view, LATCHED_HEARD_LATE)
        self._hear(PointCloud2, _ROLES['occupancy'], self._on_occupancy, LATCHED_HEARD_LATE)
        self._hear(PointCloud2, 'probabilities', self._on_probabilities, LATCHED_HEARD_LATE)
        self._hear(PoseStamped, _ROLES['goal'], self._on_goal, LATCHED_HEARD_LATE)
        self._hear(PointCloud2, 'azimuth_scores', self._on_scores, LATCHED_HEARD_LATE)
        self._hear(Header, 'done', self._on_done, LATCHED_HEARD_LATE)
        self._hear(Header, 'episode', self._on_episode, LATCHED_HEARD_LATE)
        self._tell()
        self.create_timer(_FOLLOW_EVERY_S, self._follow)
        self.create_timer(_TELL_EVERY_S, self._tell)
        if self._page.port_taken:
            self.get_logger().warning(f'port {settings.port} is taken, so the page is at another')
        self.get_logger().info(f'the page is at {self._page.url}')
        self.get_logger().info('ready')

    def _hear(self, kind: type, topic: str, callback: Callable[[Any], None], qos: Any) -> None:
        self._heard[topic] = self.create_subscription(
            kind, topic, callback, qos, callback_group=self._polled)

    def _on_image(self, msg: Image) -> None:
        picture = thumbnail(image_from_msg(msg))
        self._images[nanoseconds_from_stamp(msg.header.stamp)] = picture
        while len(self._images) > _IMAGES_KEPT:
            del self._images[min(self._images)]
        self._observer.see(picture=picture)

    def _on_camera_info(self, msg: CameraInfo) -> None:
        self._intrinsics = intrinsics_from_msg(msg)

    def _camera(self, msg: PoseStamped) -> Camera:
        return Camera(pose_from_msg(msg, self._frame), self._intrinsics)

    def _on_camera(self, msg: PoseStamped) -> None:
        self._observer.see(self._camera(msg))

    def _on_view(self, msg: PoseStamped) -> None:
        self._join('view', msg.header, self._camera(msg))

    def _on_occupancy(self, msg: PointCloud2) -> None:
        self._join('occupancy', msg.header, own_threshold(voxel_grid_from_msg(msg, self._size)))

    def _on_probabilities(self, msg: PointCloud2) -> None:
        self._join('probabilities', msg.header, voxel_grid_from_msg(msg, self._size))

    def _join(self, name: str, header: Header, part: object) -> None:
        stamp = nanoseconds_from_stamp(header.stamp)
        parts = self._joiner.add(name, stamp, part)
        if parts is not None:
            grid = parts['probabilities']
            view = TakenView(stamp, parts['view'], self._images.get(stamp), grid.entropy())
            self._observer.take_view(view, grid, parts['occupancy'])

    def _on_goal(self, msg: PoseStamped) -> None:
        self._observer.set_goal(nanoseconds_from_stamp(msg.header.stamp), self._camera(msg))

    def _on_scores(self, msg: PointCloud2) -> None:
        _, azimuths, scores = scores_from_msg(msg)
        self._observer.set_scores(
            nanoseconds_from_stamp(msg.header.stamp), Scores(azimuths, scores))

    def _on_done(self, msg: Header) -> None:
        self._observer.set_done(*done_from_msg(msg))

    def _on_episode(self, msg: Header) -> None:
        episode = episode_from_msg(msg)
        self._observer.begin_episode(episode.id, episode.begin)

    def _follow(self) -> None:
        """Read and draw what came since the last time."""
        for topic, subscription in self._heard.items():
            for msg in taken(subscription):
                self._heard_at[topic] = time.monotonic()
                self._diagnostics.count(topic)
                with self._diagnostics.refusing():
                    subscription.callback(msg)
        self._draw()

    def _draw(self) -> None:
        for label in self._page.clicks():
            self._askable[label].call_async(Trigger.Request()).add_done_callback(
                partial(self._on_answer, label))
        self._page.draw(self._observer.state)

    def _on_answer(self, label: str, answer: Future) -> None:
        response = answer.result()
        self._page.notify(label if response.success else f'{label}: refused', response.message)

    def _tell(self) -> None:
        now = time.monotonic()
        links = {
            role: TopicLink(self.resolve_topic_name(topic), self.count_publishers(topic),
                            now - self._heard_at[topic] if topic in self._heard_at else None)
            for role, topic in _ROLES.items()}
        self._page.tell(link_words(links, self._observer.state))
        for label, service in self._askable.items():
            self._page.enable(label, service.service_is_ready())

    def destroy_node(self) -> None:
        """Stop serving the page, and end."""
        self._page.close()
        super().destroy_node()


def main(args: list[str] | None = None) -> None:
    """Run the viewer until it is asked to stop."""
    # Where cores are short, who watches gives way to the loop: less of them, and never at once
    os.nice(10)
    os.sched_setscheduler(0, os.SCHED_BATCH, os.sched_param(0))
    run_node(ViewerNode, args)


if __name__ == '__main__':
    main()
