"""ROS node of the planner: publishes the next view after each view, or that it is done."""

from collections.abc import Callable
import math

from active_recon.acquisition.goals import Goal
from active_recon.errors import ActiveReconError
from active_recon.geometry.cameras import Camera
from active_recon.nodes.loop.first_view import FirstView
from active_recon.nodes.loop.goal_publisher import GoalPublisher
from active_recon.nodes.loop.goal_words import instead_words, place_words
from active_recon.nodes.loop.other_planner import OtherPlanner
from active_recon.nodes.loop.policy_loader import loaded_policy, tell_policy, tell_reconstructor
from active_recon.nodes.loop.refused_views import NO_GOAL, refusing_views
from active_recon.nodes.loop.target_warning import tell_min_gain, tell_target
from active_recon.nodes.loop.told_runtime import tell_of_runtime
from active_recon.nodes.loop.view_synchronizer import ViewSynchronizer
from active_recon.nodes.runtime.awaited_inputs import AwaitedInputs
from active_recon.nodes.runtime.clock import AHEAD_S, STEADY
from active_recon.nodes.runtime.life_cycle import ManagedNode, run_managed_node
from active_recon.nodes.runtime.parameters import Commit, Parameters
from active_recon.nodes.runtime.qos import LATCHED_QOS
from active_recon.nodes.runtime.resting_timer import RestingTimer
from active_recon.nodes.runtime.run import one_line
from active_recon.nodes.runtime.topic_names import publish_topic_names
from active_recon.parameters.view_planner import ViewPlannerParameters
from active_recon.planner import Decision, Planner
from active_recon.policies import Policy
from active_recon.policies.automatic import SWEEP
from active_recon.policies.planner_views import PlannerView
from msg_tools.episodes import done_to_msg, Episode, episode_from_msg
from std_msgs.msg import Header
from std_srvs.srv import Trigger

REPEAT_S = 1.0
"""Period at which an open goal is published again."""
TOPICS = ('camera/pose', 'view', 'views', 'latent', 'entropy', 'quality', 'probabilities',
          'episode', 'next_view', 'next_azimuth', 'azimuth_scores', 'goal_reason', 'done')
"""Topics that the node subscribes to and publishes."""


class ViewPlannerNode(ManagedNode):
    """Publish the first view of an episode, then the next after each view, until done."""

    def __init__(self) -> None:
        super().__init__('view_planner')
        self._params = Parameters(self, ViewPlannerParameters)
        self._params.on_change(self._change)

    def configure(self) -> None:
        """Load the policy, create publishers and services."""
        params = self._params.values
        self._frame = params.object_frame
        publish_topic_names(self, TOPICS)
        self._loaded = loaded_policy(params)
        self._planner = self._planner_of(params, self._loaded.policy)
        tell_policy(self, self._diagnostics, self._loaded.in_use)
        tell_target(self._diagnostics, params, self._loaded.in_use)
        self.add_cleanup(self._free_policy)
        tell_of_runtime(self._diagnostics, self._planner.provenance)
        self._goals = GoalPublisher(self, self._frame)
        self._done_pub = self.create_publisher(Header, 'done', LATCHED_QOS)
        self._diagnostics.measure_rates('views', 'goals')
        self.create_service(Trigger, 'plan', self._on_plan)
        self.create_service(Trigger, 'skip_goal', self._on_skip)
        self.create_service(Trigger, 'stop_episode', self._on_stop)

    def activate(self) -> None:
        """Subscribe to the reconstructor, and continue from its latched messages."""
        self._episode: Episode | None = None
        # 0 before the first message of a simulation's clock: any episode may then be older
        self._begun_at: float = self.get_clock().now().nanoseconds or math.inf
        inputs = AwaitedInputs(self, self._diagnostics)
        self.add_cleanup(inputs.clear)
        self._first_view = FirstView(self, inputs, self._diagnostics,
                                     lambda: self._params.values, self._on_camera)
        self._reset_episode()
        self._views = ViewSynchronizer(
            self, self._frame, self._diagnostics, self._decide, self._expect, self._prepare,
            lambda *told: tell_reconstructor(self._diagnostics, self._loaded, *told))
        self.add_cleanup(lambda: tell_reconstructor(self._diagnostics, self._loaded, '', None))
        if self._planner.wants_volume:
            self._views.subscribe_volume(self._params.values.object_size)
        inputs.subscribe(Header, 'episode', self._on_episode, LATCHED_QOS)
        self._first_goal_timer = RestingTimer(
            self, 0.1, self._publish_first_goal, self._first_goal_is_due)
        self._timeout_timer = RestingTimer(self, 0.1, self._give_up_timed_out, lambda: (
            self._params.values.goal_timeout > 0 and self._goals.camera is not None))
        self._other_planner = OtherPlanner(self, self._diagnostics)
        self.add_cleanup(self._other_planner.clear)
        self.create_timer(REPEAT_S, self._repeat, clock=STEADY)

    def _free_policy(self) -> None:
        del self._loaded, self._planner

    def _planner_of(self, params: ViewPlannerParameters, policy: Policy) -> Planner:
        return Planner(
            policy, params.max_views, params.entropy_tolerance, params.object_yaw,
            params.limits(), params.motion_weight, params.goal_elevation, params.goal_distance,
            params.elevation_range, params.reachable_views, params.motion(),
            params.target_quality, params.min_gain)

    def _change(self, params: ViewPlannerParameters) -> Commit | None:
        """Return a function that applies a change of parameters."""
        if not self.is_configured:
            return None
        loaded = loaded_policy(params, self._loaded)
        planner = self._planner_of(params, loaded.policy)
        planner.go_on_from(self._planner)

        def commit() -> None:
            if loaded.in_use != self._loaded.in_use:
                tell_policy(self, self._diagnostics, loaded.in_use)
            tell_target(self._diagnostics, params, loaded.in_use)
            self._loaded, self._planner = loaded, planner
            tell_of_runtime(self._diagnostics, planner.provenance)
            self._tell_min_gain(params.min_gain)
            if not self.is_active:
                return
            self._timeout_timer.wake()
            if planner.wants_volume:
                self._views.subscribe_volume(params.object_size)
            if self._undecided is not None:
                with refusing_views(self._diagnostics):
                    self._decide(*self._undecided)
            goal = self._goals.camera
            if goal is not None and not params.limits().allows(goal.azimuth):
                self._follow(planner.next_goal(), self.get_clock().now().nanoseconds)
                self._tell_reason()

        return commit

    def _reset_episode(self) -> None:
        """Forget the camera, the goal and the views."""
        self._planner.reset()
        self._goals.close()
        self._first_view.begin(self._episode)
        self._undecided: tuple[int, PlannerView] | None = None  # the policy failed on this view
        self._started = False
        self._done = False

    def _on_episode(self, msg: Header) -> None:
        with self._diagnostics.rejecting():
            episode = episode_from_msg(msg)
            if self._episode is not None and episode.id == self._episode.id:
                return
            self._episode = episode
            self._reset_episode()
            self._views.begin_episode(episode.begin)
            self._diagnostics.count('episodes')
            self._diagnostics.set_value('Episode', episode.id)
            self._publish_done(episode.begin, '')
            if self._views.last is not None:
                with refusing_views(self._diagnostics):
                    self._decide(*self._views.last)
            self._first_goal_timer.wake()

    def clock_went_back(self, how: str) -> None:
        """Wait for an episode of the new time, unless it has already arrived."""
        now = self.get_clock().now().nanoseconds
        self._begun_at = min(self._begun_at, now)
        self._goals.reset_stamps()
        self._diagnostics.count('clock_jumps')
        self.get_logger().warning(f'{how}: waiting for a new episode')
        ahead = now + AHEAD_S * 1e9
        if self._episode is not None and self._episode.begin > ahead:
            self._episode = None
            self._views.clear()
            self._reset_episode()
        elif self._episode is not None and self._views.has_taken_up_after(ahead):
            self._views.clear()  # but not the episode, which came before the new time
            self._reset_episode()
            self._views.begin_episode(self._episode.begin)
            self._first_goal_timer.wake()
        elif self._goals.camera is not None:
            self._follow(self._planner.next_goal(), now)  # with a stamp of the new time
            self._tell_reason()

    def _on_camera(self) -> None:
        self._publish_first_goal()
        self._first_goal_timer.wake()

    def _first_goal_is_due(self) -> bool:
        """Whether the first goal waits for nothing but time."""
        return (self._episode is not None and not self._started
                and self._first_view.waits_for_time_alone())

    def _publish_first_goal(self) -> None:
        """Publish the goal of the first view, once the camera's pose or the parameter gives it."""
        if self._episode is None or self._started:
            return
        if self._episode.begin < self._begun_at and not self._views.is_caught_up():
            return  # an episode older than this node may already have views
        first = self._first_view.where()
        if first is not None:
            self._publish_goal(self._planner.first_goal(first))

    def _prepare(self, camera: Camera) -> None:
        """Let the policy prepare while the reconstructor makes its clouds."""
        with self._diagnostics.rejecting():  # a policy that fails here may still choose
            self._planner.expect_camera(camera, self._params.values.object_size)

    def _expect(self, view: PlannerView) -> None:
        """Let the policy choose while the reconstructor judges the quality."""
        if self._episode is not None:
            self._planner.expect_view(view.latent, view.camera, view.volume)

    def _decide(self, stamp: int, view: PlannerView) -> None:
        if self._episode is None:
            return
        self._undecided = stamp, view
        decision = self._planner.add_view(view.latent, view.camera, view.entropy, view.volume,
                                          view.quality, view.earlier)
        self._undecided = None
        self._diagnostics.clear_warning(NO_GOAL)
        self._started = True
        self._diagnostics.count('views')
        name = self._loaded.in_use.name
        self._diagnostics.set_value('Policy', (
            f'even sweep instead of {name}: unusual views'
            if self._planner.sweeps and name != SWEEP else name))
        self._tell_min_gain(self._params.values.min_gain)
        self._follow(decision, stamp)
        if decision.goal is not None:
            self._diagnostics.record_latency(stamp)
            self._tell_reason()

    def _follow(self, decision: Decision, stamp: int) -> None:
        """Publish the goal, or that the episode is done, at a stamp in nanoseconds."""
        if decision.goal is not None:
            self._publish_goal(decision.goal)
            return
        self._goals.close()
        self._started = True
        self._done = True
        self._publish_done(stamp, decision.reason)
        self.get_logger().info(f'done: {decision.reason}')

    def _tell_min_gain(self, min_gain: float) -> None:
        tell_min_gain(self._diagnostics, min_gain, self._loaded.in_use.name,
                      self._planner.lacks_gains)

    def _tell_reason(self) -> None:
        """Tell why the goal that was just published is worth its view, where that is known."""
        camera = self._goals.camera
        reason = self._planner.reason() if camera is not None else None
        if camera is None or reason is None:
            return
        self._goals.publish_reason(reason)
        self.get_logger().info(f'goal at {place_words(camera)}: {reason.sentence}')

    def _publish_done(self, stamp: int, reason: str) -> None:
        """Publish why the episode is done, at the stamp of a view; '' while it is not."""
        self._done_pub.publish(done_to_msg(stamp, reason))
        self._diagnostics.set_value('Done', reason or 'not yet')

    def _publish_goal(self, goal: Goal) -> None:
        self._goals.publish(goal, 0 if self._episode is None else self._episode.begin)
        self._started = True
        self._timeout_timer.wake()
        self._diagnostics.count('goals')

    def _repeat(self) -> None:
        """Publish the open goal again, and tell whether another planner does so, too."""
        self._goals.repeat()
        self._other_planner.tell()

    def _give_up_timed_out(self) -> None:
        """Publish the next best goal where one has been open for too long."""
        timeout, failed = self._params.values.goal_timeout, self._goals.camera
        if timeout == 0 or failed is None or not self._goals.open_for > timeout:
            return
        self._give_up(failed, lambda instead: self._diagnostics.warn('goal_timeout', (
            f'no view from {place_words(failed)}: expected one within {timeout:g} s, got none; '
            f'it is left out of this episode, {instead}')))

    def _give_up(self, failed: Camera, tell: Callable[[str], None]) -> Decision:
        """Leave the open goal out of the episode; tell and publish what follows in its place."""
        decision = self._planner.give_up(failed, self._first_view.camera)
        tell(instead_words(decision))
        self._follow(decision, self.get_clock().now().nanoseconds)
        self._tell_reason()
        return decision

    def _on_plan(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Publish the goal after the views so far with a new stamp; answer with its azimuth."""
        if not self.is_active:
            response.message = 'this node is inactive: expected an active one to plan'
            return response
        try:
            goal = self._planner.plan()
        except ActiveReconError as error:
            response.message = one_line(error)
            return response
        if self._done and self._episode is not None:
            self._done = False
            self._publish_done(self._episode.begin, '')
        self._publish_goal(goal)
        self._tell_reason()
        response.success = True
        response.message = f'{goal.camera.azimuth:.6f}'
        return response

    def _on_skip(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Give the open goal up at once; answer with the azimuth of the next, or why none is."""
        goal = self._goals.camera if self.is_active else None
        if goal is None:
            response.message = 'no goal to skip: expected an open one, there is none'
            return response
        decision = self._give_up(goal, lambda instead: self.get_logger().info(
            f'skipped: {place_words(goal)} is left out of this episode, {instead}'))
        response.success = True
        response.message = (decision.reason if decision.goal is None
                            else f'{decision.goal.camera.azimuth:.6f}')
        return response

    def _on_stop(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """End the episode; the next one goes on as usual."""
        if not self.is_active or self._episode is None:
            response.message = 'no episode to stop: expected a running one, there is none'
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
