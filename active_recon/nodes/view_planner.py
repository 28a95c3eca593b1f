"""ROS shell of the planner: after every view, where to look next, or that it is enough."""

import math
import time

from active_recon.errors import ActiveReconError
from active_recon.geometry.cameras import (
    Camera,
    CANONICAL_DISTANCE,
    CANONICAL_ELEVATION,
    orbit_camera,
)
from active_recon.models.weights_files import find_weights
from active_recon.nodes.loop.goal_publisher import GoalPublisher
from active_recon.nodes.loop.view_synchronizer import HeardView, HeardViews
from active_recon.nodes.runtime.awaited_inputs import AwaitedInputs
from active_recon.nodes.runtime.clock import AHEAD_S, STEADY
from active_recon.nodes.runtime.life_cycle import ManagedNode, run_managed_node
from active_recon.nodes.runtime.parameters import Commit, Parameters
from active_recon.nodes.runtime.qos import HEARD, LATCHED
from active_recon.nodes.runtime.run import one_line
from active_recon.nodes.runtime.topic_names import tell_names
from active_recon.parameters.view_planner import ViewPlannerSettings
from active_recon.planner import Decision, Goal, Planner
from active_recon.policies import load_policy, POLICIES, Policy, PolicyOptions
from geometry_msgs.msg import PoseStamped
from msg_tools.cameras import pose_from_msg
from msg_tools.episodes import done_to_msg, Episode, episode_from_msg
from msg_tools.stamps import nanoseconds_from_stamp
import numpy as np
from std_msgs.msg import Header
from std_srvs.srv import Trigger

REPEAT_S = 1.0
"""So often a goal whose view has not come is sent again."""
FIND_CAMERA_S = 1.0
"""So long after an episode was heard, nobody who publishes the camera's pose is waited for."""
_STEEPEST = 1.5  # rad, of a first view
TOPICS = ('camera/pose', 'view', 'latent', 'entropy', 'probabilities', 'episode', 'next_view',
          'next_azimuth', 'azimuth_scores', 'done')
"""What the node hears and publishes."""


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
        tell_names(self, TOPICS)
        self._policy = self._load(settings)
        self._planner = self._planner_of(settings, self._policy)
        self._goals = GoalPublisher(self, self._frame)
        self._done_pub = self.create_publisher(Header, 'done', LATCHED)
        self._diagnostics.measure('views', 'goals')
        self.create_service(Trigger, 'plan', self._on_plan)
        self.create_service(Trigger, 'stop_episode', self._on_stop)

    def activate(self) -> None:
        """Hear the reconstructor, and go on from what is latched."""
        self._episode: Episode | None = None
        self._begun_at = self.get_clock().now().nanoseconds
        self._forget()
        inputs = AwaitedInputs(self, self._diagnostics)
        self.on_undo(inputs.forget)
        hear_camera = (inputs.hear if math.isnan(self._settings.now.start_azimuth)
                       else self.create_subscription)
        self._cameras = hear_camera(PoseStamped, 'camera/pose', self._on_camera, HEARD)
        self._views = HeardViews(self, self._frame, self._diagnostics, self._decide)
        if self._planner.wants_volume:
            self._views.hear_volume(self._settings.now.object_size)
        inputs.hear(Header, 'episode', self._on_episode, LATCHED)
        self.create_timer(0.1, self._ask_first, clock=STEADY)
        self.create_timer(0.1, self._give_up_late, clock=STEADY)
        self.create_timer(REPEAT_S, self._goals.repeat, clock=STEADY)

    def _load(self, settings: ViewPlannerSettings) -> Policy:
        return load_policy(settings.policy, PolicyOptions(
            np.random.default_rng(settings.seed), settings.max_views,
            find_weights(settings.weights or None), threads=settings.threads))

    def _planner_of(self, settings: ViewPlannerSettings, policy: Policy) -> Planner:
        return Planner(
            policy, settings.max_views, settings.entropy_tolerance, settings.object_yaw,
            settings.limits(), settings.motion_weight,
            None if math.isnan(settings.elevation) else settings.elevation,
            CANONICAL_DISTANCE * settings.object_size if math.isnan(settings.distance)
            else settings.distance)

    def _change(self, settings: ViewPlannerSettings) -> Commit | None:
        """Return what puts settings into effect that changed while the node runs."""
        if not self.is_configured:
            return None
        before = self._settings.now
        is_same = all(getattr(before, name) == getattr(settings, name)
                      for name in ('policy', *POLICIES[settings.policy].parameters))
        policy = self._policy if is_same else self._load(settings)
        planner = self._planner_of(settings, policy)
        planner.go_on_from(self._planner)

        def commit() -> None:
            self._policy, self._planner = policy, planner
            if not self.is_active:
                return
            if planner.wants_volume:
                self._views.hear_volume(settings.object_size)
            asked = self._goals.camera
            if asked is not None and not settings.limits().allows(asked.azimuth):
                self._follow(planner.next_goal(), self.get_clock().now().nanoseconds)

        return commit

    def _forget(self) -> None:
        """Begin with no camera, no goal and no view."""
        self._planner.reset()
        self._goals.close()
        self._camera: Camera | None = None
        self._started = False
        self._done = False

    def _on_episode(self, msg: Header) -> None:
        with self._diagnostics.refusing():
            episode = episode_from_msg(msg)
            if self._episode is not None and episode.id == self._episode.id:
                return
            self._forget()
            self._views.begin(episode.begin)
            self._episode, self._heard_at = episode, time.monotonic()
            self._diagnostics.count('episodes')
            self._diagnostics.tell('Episode', episode.id)
            self._tell_done(episode.begin, '')
            if self._views.last is not None:
                self._decide(self._views.last)

    def clock_went_back(self, how: str) -> None:
        """Wait for the episode of the new time, unless it came before the new time was heard."""
        now = self.get_clock().now().nanoseconds
        self._begun_at = min(self._begun_at, now)
        self._goals.forget_stamps()
        self._diagnostics.count('clock_jumps')
        self.get_logger().warning(f'{how}: a new episode is awaited')
        if self._episode is not None and self._episode.begin > now + AHEAD_S * 1e9:
            self._episode = None
            self._views.forget()
            self._forget()
        elif self._goals.camera is not None:
            self._ask(self._planner.plan())  # under a stamp of the new time

    def _on_camera(self, msg: PoseStamped) -> None:
        with self._diagnostics.refusing():
            camera = Camera(pose_from_msg(msg, self._frame))
            if self._episode and nanoseconds_from_stamp(msg.header.stamp) >= self._episode.begin:
                self._camera = camera
        self._ask_first()

    def _ask_first(self) -> None:
        """Ask for the first view, once, where the camera or the parameter says."""
        if self._episode is None or self._started:
            return
        if self._episode.begin < self._begun_at and not self._views.would_be_here():
            return  # an episode older than this node may have views already
        first = self._first_camera()
        if first is not None:
            self._ask(self._planner.first_goal(first))

    def _first_camera(self) -> Camera | None:
        """Return where the first view is to be taken, None while that is not known yet."""
        settings = self._settings.now
        if math.isnan(settings.start_azimuth):
            return self._camera
        elevation = settings.elevation
        if math.isnan(elevation) and self._camera is not None:
            elevation = min(max(self._camera.elevation, -_STEEPEST), _STEEPEST)
        if math.isnan(elevation):  # it is the camera's, where there is one
            if (time.monotonic() - self._heard_at < FIND_CAMERA_S
                    or self.count_publishers(self._cameras.topic_name)):
                return None
            elevation = CANONICAL_ELEVATION
        return orbit_camera(settings.start_azimuth, elevation)

    def _decide(self, view: HeardView) -> None:
        if self._episode is None:
            return
        decision = self._planner.add_view(view.latent, view.camera, view.entropy, view.volume)
        self._started = True
        self._diagnostics.count('views')
        self._follow(decision, view.stamp)
        if decision.goal is not None:
            self._diagnostics.took_since(view.stamp)

    def _follow(self, decision: Decision, stamp: int) -> None:
        """Ask for the goal, or say that the episode is done, at a stamp in nanoseconds."""
        if decision.goal is not None:
            self._ask(decision.goal)
            return
        self._goals.close()
        self._started = True
        self._done = True
        self._tell_done(stamp, decision.reason)
        self.get_logger().info(f'done: {decision.reason}')

    def _tell_done(self, stamp: int, reason: str) -> None:
        """Say why the episode is done, as of the stamp of a view; '' that it is not yet."""
        self._done_pub.publish(done_to_msg(stamp, reason))
        self._diagnostics.tell('Done', reason or 'not yet')

    def _ask(self, goal: Goal) -> None:
        self._goals.ask(goal)
        self._started = True
        self._diagnostics.count('goals')

    def _give_up_late(self) -> None:
        """Ask for the next best goal where one has been open for too long."""
        timeout, failed = self._settings.now.goal_timeout, self._goals.camera
        if timeout == 0 or failed is None or not self._goals.waited > timeout:
            return
        decision = self._planner.give_up(failed, self._camera)
        instead = ('nothing that can be reached is left' if decision.goal is None else
                   f'the next best is {math.degrees(decision.goal.camera.azimuth):.1f} degrees')
        self._diagnostics.warn('goal_timeout', (
            f'expected a view from {math.degrees(failed.azimuth):.1f} degrees within '
            f'{timeout:g} s, got none: left out for this episode, {instead}'))
        self._follow(decision, self.get_clock().now().nanoseconds)

    def _on_plan(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Ask for the goal after the views so far under a new stamp; answer with its azimuth."""
        if not self.is_active:
            response.message = 'expected an active node to plan; this one is inactive'
            return response
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
        response.message = f'{goal.camera.azimuth:.6f}'
        return response

    def _on_stop(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """End the episode; the next one goes on as usual."""
        if not self.is_active or self._episode is None:
            response.message = 'expected an episode to stop; there is none'
            return response
        response.success = True
        response.message = 'already done' if self._done else 'stopped'
        if not self._done:
            self._follow(self._planner.stop(), self.get_clock().now().nanoseconds)
        return response


def main(args: list[str] | None = None) -> None:
    """Run the view planner until it is asked to stop."""
    run_managed_node(ViewPlannerNode, args)


if __name__ == '__main__':
    main()
