"""Joins the reconstructor's messages of one view on their stamp, for the planner."""

from collections.abc import Callable
import time
from typing import Any

from active_recon.geometry.cameras import Camera
from active_recon.nodes.loop.refused_views import NO_GOAL, refusing_views
from active_recon.nodes.runtime.diagnostics import Diagnostics
from active_recon.nodes.runtime.life_cycle import ManagedNode
from active_recon.nodes.runtime.qos import LATCHED_QOS
from active_recon.policies.planner_views import PlannerView
from active_recon.quality.quality import Quality
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseArray, PoseStamped
from msg_tools.cameras import pose_from_msg, poses_from_msg
from msg_tools.entropy import entropy_from_msg
from msg_tools.images import latent_from_msg
from msg_tools.joins import StampJoiner
from msg_tools.quality import judged_size, judging_weights, quality_from_msg
from msg_tools.stamps import nanoseconds_from_stamp
from msg_tools.voxels import voxel_grid_from_msg
from sensor_msgs.msg import Image, JointState, PointCloud2

FIND_VIEWS_S = 0.5
"""Time for latched messages to arrive after their publishers were discovered."""


class ViewSynchronizer:
    """
    Joins `latent`, `view` and `entropy`, which arrive in any order while the node is active.

    With them goes the `quality` of their stamp, for which they wait while it has a publisher, and
    with the first likewise, from `views`, the cameras of those before it: a planner that is
    started again knows where they were taken.
    `on_waiting` is called with the last view when it begins to wait, and `on_camera` with its
    camera, which arrives before. `on_judge` is called with what a quality tells of the
    reconstructor: the SHA-256 of the network's weights, or '', and the side of the cube in metres,
    or None.
    `on_view` is called with the stamp (nanoseconds) and the view when all parts have arrived,
    unless it is older than the episode. `last` keeps the last one: it may arrive before the
    message of the episode that it belongs to. A part that cannot be read, and a view on which
    `on_view` raises ActiveReconError, is rejected in the diagnostics with the warning `NO_GOAL`,
    which `on_view` is to clear.
    """

    def __init__(self, node: ManagedNode, frame: str, diagnostics: Diagnostics,
                 on_view: Callable[[int, PlannerView], None],
                 on_waiting: Callable[[PlannerView], None],
                 on_camera: Callable[[Camera], None],
                 on_judge: Callable[[str, float | None], None]) -> None:
        self._node = node
        self._diagnostics = diagnostics
        node.add_cleanup(lambda: diagnostics.clear_warning(NO_GOAL, log=False))
        self._on_view, self._on_waiting, self._on_camera = on_view, on_waiting, on_camera
        self._on_judge = on_judge
        self._joiner = StampJoiner(['latent', 'camera', 'entropy'])
        self._has_volume = False
        self._frame = frame
        self._begin, self._heard, self._taken_up = 0, -1, -1
        self._matched_at: float | None = None
        self.last: tuple[int, PlannerView] | None = None
        self._inputs = [node.create_subscription(kind, topic, self._on(name, read), LATCHED_QOS)
                       for kind, topic, name, read in (
            (Image, 'latent', 'latent', latent_from_msg),
            (PoseStamped, 'view', 'camera', lambda msg: Camera(pose_from_msg(msg, frame))),
            (JointState, 'entropy', 'entropy', entropy_from_msg))]
        self._waiting: dict[int, dict[str, Any]] = {}
        self._qualities: dict[int, Quality] = {}
        self._quality = node.create_subscription(
            DiagnosticArray, 'quality', self._on_quality, LATCHED_QOS)
        self._listed = 0, PoseArray()
        self._views = node.create_subscription(PoseArray, 'views', self._on_views, LATCHED_QOS)

    def subscribe_volume(self, object_size: float) -> None:
        """Join the probabilities, too, of a voxel grid of that side in metres, for the policy."""
        if self._has_volume:
            return
        self._has_volume = True
        self._joiner.expect('volume')
        for stamp, parts in self._waiting.items():  # what is latched completes the last of them
            for name, part in parts.items():
                self._joiner.add(name, stamp, part)
        self._waiting.clear()
        self._inputs.append(self._node.create_subscription(
            PointCloud2, 'probabilities',
            self._on('volume', lambda msg: voxel_grid_from_msg(msg, object_size)), LATCHED_QOS))

    def begin_episode(self, stamp: int) -> None:
        """Drop what is stamped before the begin of an episode, nanoseconds."""
        # Where the clock jumped back, later stamps are older
        if stamp < self._begin or self._node.clock_monitor.is_ahead(self._heard):
            self.clear()
        self._begin = stamp
        self._joiner.forget_before(stamp)
        for parts in (self._waiting, self._qualities):
            for old in [each for each in parts if each < stamp]:
                del parts[old]
        if self.last is not None and self.last[0] < stamp:
            self.last = None
        self._taken_up = self._heard

    def clear(self) -> None:
        """Forget the messages and the episode."""
        self._begin, self._heard, self._taken_up = 0, -1, -1
        self._joiner.clear()
        self._waiting.clear()
        self._qualities.clear()
        self._listed = 0, PoseArray()
        self.last = None

    def has_taken_up_after(self, stamp: float) -> bool:
        """Whether a view from before the episode's message is stamped after a time, ns."""
        return self._taken_up > stamp

    def is_caught_up(self) -> bool:
        """Whether any view latched before this node started has been handed over by now."""
        if self._heard >= self._begin and (self.last is None or self.last[0] < self._heard):
            return False  # a part of a view is there, the others are on their way
        if not all(each.get_publisher_count() for each in self._inputs):
            return False
        now = time.monotonic()
        self._matched_at = now if self._matched_at is None else self._matched_at
        return now - self._matched_at >= FIND_VIEWS_S

    def _on(self, name: str, read: Callable[[Any], Any]) -> Callable[[Any], None]:
        def on_msg(msg: Any) -> None:
            with refusing_views(self._diagnostics):
                self._join(name, nanoseconds_from_stamp(msg.header.stamp), read(msg))
        return on_msg

    def _join(self, name: str, stamp: int, part: Any) -> None:
        if self._node.clock_monitor.is_ahead(stamp):
            return
        if stamp < self._begin:
            self._diagnostics.count('dropped/last_episode')
            return
        self._heard = max(self._heard, stamp)
        if name == 'camera':
            self._on_camera(part)
        parts = self._joiner.add(name, stamp, part)
        if parts is not None:
            self._waiting[stamp] = parts
            self._hand_over()
            if stamp in self._waiting and stamp == max(self._waiting):
                self._on_waiting(PlannerView(**parts))

    def _on_quality(self, msg: DiagnosticArray) -> None:
        with refusing_views(self._diagnostics):
            stamp = nanoseconds_from_stamp(msg.header.stamp)
            if stamp >= self._begin and not self._node.clock_monitor.is_ahead(stamp):
                self._qualities[stamp] = quality_from_msg(msg)
                self._on_judge(judging_weights(msg), judged_size(msg))
                self._hand_over()

    def _on_views(self, msg: PoseArray) -> None:
        with refusing_views(self._diagnostics):
            stamp = nanoseconds_from_stamp(msg.header.stamp)
            if not self._node.clock_monitor.is_ahead(stamp):
                self._listed = stamp, msg
                self._heard = max(self._heard, stamp if msg.poses else -1)
                self._hand_over()

    def _hand_over(self) -> None:
        """Pass on the complete views whose quality is there, or will not come."""
        for stamp in sorted(self._waiting):
            if stamp == max(self._waiting) and self._awaits(stamp):
                return  # a later view shows that it was lost
            parts = self._waiting.pop(stamp)
            self.last = stamp, PlannerView(**parts, quality=self._qualities.get(stamp),
                                           earlier=self._cameras_before(stamp))
            for old in [each for each in self._qualities if each <= stamp]:
                del self._qualities[old]
            self._on_view(*self.last)

    def _awaits(self, stamp: int) -> bool:
        """Whether a message of a complete view is still to come."""
        return (self._quality.get_publisher_count() > 0 and stamp not in self._qualities
                or self.last is None and self._views.get_publisher_count() > 0
                and self._listed[0] < stamp)

    def _cameras_before(self, stamp: int) -> list[Camera]:
        """Return the cameras of an episode's views before the first that this planner hears of."""
        listed, msg = self._listed
        if self.last is None and listed == stamp:
            with refusing_views(self._diagnostics):
                return [Camera(pose) for pose in poses_from_msg(msg, self._frame)[:-1]]
        return []
