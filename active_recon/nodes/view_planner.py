"""ROS shell of the planner: after every view, where to look next, or that it is enough."""

import math
from pathlib import Path
import time
from typing import Any

from active_recon.cameras import Camera, CANONICAL_DISTANCE
from active_recon.errors import ActiveReconError
from active_recon.nodes.clock import AHEAD_S, STEADY
from active_recon.nodes.life_cycle import ManagedNode, run_managed_node
from active_recon.nodes.parameters import Commit, Parameters
from active_recon.nodes.qos import HEARD, LATCHED
from active_recon.nodes.run import one_line
from active_recon.nodes.settings.view_planner import ViewPlannerSettings
from active_recon.planner import Goal, Planner
from active_recon.policies import load_policy, Policy
from geometry_msgs.msg import PoseStamped
from msg_tools.cameras import pose_from_msg
from msg_tools.episodes import done_to_msg, Episode, episode_from_msg
from msg_tools.goals import azimuth_goal_to_msg, scores_to_msg, view_goal_to_msg
from msg_tools.images import latent_from_msg
from msg_tools.joins import StampJoiner
from msg_tools.stamps import nanoseconds_from_stamp, stamp_from_nanoseconds
from msg_tools.voxels import voxel_grid_from_msg
import numpy as np
from sensor_msgs.msg import Image, JointState, PointCloud2
from std_msgs.msg import Header
from std_srvs.srv import Trigger

FIND_VIEWS_S = 0.5
"""An episode older than this node may have views already: for so long they may come first."""
REPEAT_S = 1.0
"""A goal whose view has not come is sent again, with its stamp: it may not have been heard."""


MADE_OF = {'random': ('seed',), 'uniform': ('max_views',)}
"""The parameters that a policy is made of, and that may change while the node runs."""


class ViewPlannerNode(ManagedNode):
    """Ask for the first view of an episode, then for the next after each one, until done."""

    def __init__(self) -> None:
        super().__init__('view_planner')
        self._settings = Parameters(self, ViewPlannerSettings)
        self._settings.on_change(self._change)

    def configure(self) -> None:
        """Load the policy, and offer its goals."""
        settings = self._settings.now
        self._frame = settings.object_frame
        self._distance = (CANONICAL_DISTANCE * settings.object_size
                          if math.isnan(settings.distance) else settings.distance)
        self._policy = self._load(settings)
        self._planner = self._planner_of(settings, self._policy)
        self._joiner = StampJoiner(('latent', 'view', 'probabilities'))
        self._last_goal_stamp = 0
        self._next_view_pub = self.create_publisher(PoseStamped, 'next_view', LATCHED)
        self._next_azimuth_pub = self.create_publisher(JointState, 'next_azimuth', LATCHED)
        self._scores_pub = self.create_publisher(PointCloud2, 'azimuth_scores', LATCHED)
        self._done_pub = self.create_publisher(Header, 'done', LATCHED)
        self._diagnostics.measure('views', 'goals')
        self.create_service(Trigger, 'plan', self._on_plan)

    def activate(self) -> None:
        """Hear the reconstructor, and go on from what is latched."""
        self._episode: Episode | None = None
        self._early: tuple[int, dict[str, Any]] | None = None
        self._begun_at = self.get_clock().now().nanoseconds
        self._forget()
        self.create_subscription(PoseStamped, 'camera/pose', self._on_camera, HEARD)
        self.create_subscription(Image, 'latent', self._on_latent, LATCHED)
        self.create_subscription(PoseStamped, 'view', self._on_view, LATCHED)
        self.create_subscription(PointCloud2, 'probabilities', self._on_probabilities, LATCHED)
        self.create_subscription(Header, 'episode', self._on_episode, LATCHED)
        self.create_timer(0.1, self._ask_first, clock=STEADY)
        self.create_timer(REPEAT_S, self._repeat, clock=STEADY)

    def _load(self, settings: ViewPlannerSettings) -> Policy:
        if settings.policy == 'attention':  # only this one needs torch, and the time to load it
            import torch
            torch.set_num_threads(settings.threads)
        return load_policy(
            settings.policy, Path(settings.weights) if settings.weights else None,
            np.random.default_rng(settings.seed), settings.max_views)

    def _planner_of(self, settings: ViewPlannerSettings, policy: Policy) -> Planner:
        return Planner(
            policy, settings.max_views, settings.entropy_tolerance, settings.object_yaw)

    def _change(self, settings: ViewPlannerSettings) -> Commit | None:
        """Return what puts settings into effect that changed while the node runs."""
        if not self.is_configured:
            return None
        before = self._settings.now
        is_same = all(getattr(before, name) == getattr(settings, name)
                      for name in ('policy', *MADE_OF.get(settings.policy, ())))
        policy = self._policy if is_same else self._load(settings)
        planner = self._planner_of(settings, policy)
        planner.go_on_from(self._planner)

        def commit() -> None:
            self._policy, self._planner = policy, planner

        return commit

    def _forget(self) -> None:
        """Begin with no camera, no goal and no view."""
        self._planner.reset()
        self._joiner.clear()
        self._camera_azimuth = math.nan
        self._asked: tuple[PoseStamped, JointState] | None = None
        self._started = False
        self._done = False

    def _on_episode(self, msg: Header) -> None:
        with self._diagnostics.refusing():
            episode = episode_from_msg(msg)
            if self._episode is not None and episode.id == self._episode.id:
                return
            self._forget()
            self._episode = episode
            self._heard_at = time.monotonic()
            self._diagnostics.count('episodes')
            self._diagnostics.tell('Episode', episode.id)
            self._tell_done(episode.begin, '')
            if self._early is not None:
                self._decide(*self._early, episode)
                self._early = None

    def clock_went_back(self, how: str) -> None:
        """Wait for the episode of the new time, unless it came before the new time was heard."""
        now = self.get_clock().now().nanoseconds
        self._begun_at = min(self._begun_at, now)
        self._last_goal_stamp = 0
        self._diagnostics.count('clock_jumps')
        self.get_logger().warning(f'{how}: a new episode is awaited')
        if self._episode is not None and self._episode.begin > now + AHEAD_S * 1e9:
            self._episode = None
            self._forget()
        elif self._asked is not None:
            self._ask(self._planner.plan())  # under a stamp of the new time

    def _on_camera(self, msg: PoseStamped) -> None:
        with self._diagnostics.refusing():
            pose = pose_from_msg(msg, self._frame)
            if self._episode and nanoseconds_from_stamp(msg.header.stamp) >= self._episode.begin:
                self._camera_azimuth = Camera(pose).azimuth
        self._ask_first()

    def _ask_first(self) -> None:
        """Ask for the first view, once, where the camera or the parameter says."""
        if self._episode is None or self._started:
            return
        older = self._episode.begin < self._begun_at
        if older and time.monotonic() - self._heard_at < FIND_VIEWS_S:
            return
        start = self._settings.now.start_azimuth
        azimuth = self._camera_azimuth if math.isnan(start) else start
        if not math.isnan(azimuth):
            self._ask(self._planner.first_goal(azimuth))

    def _on_latent(self, msg: Image) -> None:
        with self._diagnostics.refusing():
            self._join('latent', msg.header, latent_from_msg(msg))

    def _on_view(self, msg: PoseStamped) -> None:
        with self._diagnostics.refusing():
            self._join('view', msg.header, Camera(pose_from_msg(msg, self._frame)).azimuth)

    def _on_probabilities(self, msg: PointCloud2) -> None:
        with self._diagnostics.refusing():
            grid = voxel_grid_from_msg(msg, self._settings.now.object_size)
            self._join('probabilities', msg.header, grid.entropy())

    def _join(self, name: str, header: Header, part: Any) -> None:
        """Decide once all parts of a view are there, and its episode is known."""
        stamp = nanoseconds_from_stamp(header.stamp)
        if self.clock_watch.is_ahead(stamp):
            return
        parts = self._joiner.add(name, stamp, part)
        if parts is None:
            return
        if self._episode is None:  # a latched view may be heard before its latched episode
            self._early = stamp, parts
        else:
            self._decide(stamp, parts, self._episode)

    def _decide(self, stamp: int, parts: dict[str, Any], episode: Episode) -> None:
        if stamp < episode.begin:
            return
        decision = self._planner.add_view(parts['latent'], parts['view'], parts['probabilities'])
        self._started = True
        self._diagnostics.count('views')
        if decision.goal is not None:
            self._ask(decision.goal)
            self._diagnostics.took_since(stamp)
            return
        self._asked = None
        self._done = True
        self._tell_done(stamp, decision.reason)
        self.get_logger().info(f'done: {decision.reason}')

    def _tell_done(self, stamp: int, reason: str) -> None:
        """Say why the episode is done, as of the stamp of a view; '' that it is not yet."""
        self._done_pub.publish(done_to_msg(stamp, reason))
        self._diagnostics.tell('Done', reason or 'not yet')

    def _ask(self, goal: Goal) -> None:
        """Publish a goal under a stamp of its own, its identity."""
        now = self.get_clock().now().nanoseconds
        # A paused clock would give two goals one identity
        self._last_goal_stamp = max(now, self._last_goal_stamp + 1)
        header = Header(stamp=stamp_from_nanoseconds(self._last_goal_stamp), frame_id=self._frame)
        self._asked = (
            view_goal_to_msg(goal.azimuth, self._settings.now.elevation, self._distance, header),
            azimuth_goal_to_msg(goal.azimuth, header))
        self._started = True
        self._diagnostics.count('goals')
        self._scores_pub.publish(scores_to_msg(
            goal.candidates, goal.scores, self._settings.now.elevation, self._distance, header))
        self._repeat()

    def _repeat(self) -> None:
        if self._asked is not None:
            next_view, next_azimuth = self._asked
            self._next_view_pub.publish(next_view)
            self._next_azimuth_pub.publish(next_azimuth)

    def _on_plan(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Ask for the goal after the views so far under a new stamp; answer with its azimuth."""
        try:
            goal = self._planner.plan()
        except ActiveReconError as error:
            response.message = one_line(error)
            return response
        if self._done and self._episode is not None:
            self._done = False
            self._tell_done(self._episode.begin, '')
        self._ask(goal)
        response.success = True
        response.message = f'{goal.azimuth:.6f}'
        return response


def main(args: list[str] | None = None) -> None:
    """Run the view planner until it is asked to stop."""
    run_managed_node(ViewPlannerNode, args)


if __name__ == '__main__':
    main()
