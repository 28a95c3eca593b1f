"""A policy and the state of one episode: the core of the view planner's node."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
import math
from pathlib import Path

from active_recon.acquisition.goal_places import goal_places
from active_recon.acquisition.goals import best_goal, Goal, Wanted
from active_recon.acquisition.motion import MotionLimits
from active_recon.acquisition.motion_cost import MotionCost, TimedMotion
from active_recon.acquisition.view_gate import GOAL_TOLERANCE
from active_recon.errors import ConfigError, ViewError
from active_recon.geometry.cameras import Camera, CANONICAL_DISTANCE, OrbitCamera
from active_recon.geometry.view_distance import on_one_ring, view_distance, view_distances
from active_recon.policies import (
    AUTO_POLICY,
    Choice,
    load_policy,
    Observation,
    Policy,
    PolicyOptions,
)
from active_recon.policies.automatic import SWEEP
from active_recon.policies.checked import begun_by, chosen, telling_failures
from active_recon.policies.planner_views import (
    cameras_of,
    observation,
    PlannerView,
    policy_poses,
)
from active_recon.policies.reasons import goal_reason, GoalReason
from active_recon.policies.stopping import StoppingRule
from active_recon.quality.quality import Quality
from active_recon.runtimes import AUTO, State
from active_recon.volumes.voxels import VoxelGrid
import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Decision:
    """
    A goal, or the reason why there is none.

    That is max_views, entropy_settled, target_reached, target_out_of_reach, gain_too_small,
    no_reachable_azimuth or stopped.
    """

    goal: Goal | None
    reason: str = ''


class Planner:
    """
    Decides after every view of an episode: where next, or that it is enough.

    Goals are cameras in the object frame that look at its centre, upright. They stand at
    `elevation` (radians; None: that of the camera's last view) and `distance` (metres), or
    anywhere in `elevation_range`, or at the `reachable_views`: see `goal_places`. `object_yaw` is
    the azimuth of the object's front (radians): a policy that was learned with a network that
    needs it thinks relative to the front. A goal is what the policy chooses, or the best of the
    candidates where the camera cannot go there, was there already, or has too long a way:
    `motion_weight` is what half a turn costs, beside 1 for what lies between the policy's worst
    and best candidate, and `motion` what a second costs instead. No view is asked for again, nor a
    goal whose view was taken, however roughly it was reached: the episode ends when none is left.

    `max_views`, `entropy_tolerance`, `target_quality` and `min_gain` end an episode: see
    `StoppingRule`. While views are flagged as unusual, their quality ends nothing, and an even
    sweep takes the place of the policy.
    """

    def __init__(self, policy: Policy, max_views: int = 5, entropy_tolerance: float = 0.01,
                 object_yaw: float = 0.0, limits: MotionLimits | None = None,
                 motion_weight: float = 0.0, elevation: float | None = None,
                 distance: float = CANONICAL_DISTANCE, elevation_range: Sequence[float] = (),
                 reachable_views: Sequence[float] = (),
                 motion: TimedMotion | None = None,
                 target_quality: float = 0.0, min_gain: float = 0.0) -> None:
        if not math.isfinite(object_yaw):
            raise ConfigError(f'object_yaw: not finite: expected radians, got {object_yaw}')
        self._stopping = StoppingRule(max_views, entropy_tolerance, target_quality, min_gain)
        self._sweep = load_policy(SWEEP, PolicyOptions(views=max_views))
        self._policy = policy
        self._yaw = object_yaw
        self._limits = limits or MotionLimits()
        self._cost = MotionCost(motion_weight, motion or TimedMotion())
        self._places = goal_places(self._limits, object_yaw, elevation, distance, elevation_range,
                                   reachable_views)
        self.reset()

    @classmethod
    def load(cls, policy: str = AUTO_POLICY, weights: Path | None = None, seed: int = 0,
             max_views: int = 5, entropy_tolerance: float = 0.01, object_yaw: float = 0.0,
             device: str = 'cpu', limits: MotionLimits | None = None,
             motion_weight: float = 0.0, elevation: float | None = None,
             distance: float = CANONICAL_DISTANCE, elevation_range: Sequence[float] = (),
             reachable_views: Sequence[float] = (), motion: TimedMotion | None = None,
             threads: int | None = None, target_quality: float = 0.0, min_gain: float = 0.0,
             runtime: str = AUTO, precision: str = 'auto') -> 'Planner':
        """Build the planner of a policy's name; raises ConfigError and WeightsError."""
        if seed < 0:
            raise ConfigError(f'seed: negative: expected 0 or more, got {seed}')
        options = PolicyOptions(np.random.default_rng(seed), max_views, weights, runtime, device,
                                threads, precision)
        return cls(load_policy(policy, options), max_views, entropy_tolerance, object_yaw, limits,
                   motion_weight, elevation, distance, elevation_range, reachable_views, motion,
                   target_quality, min_gain)

    @property
    def wants_volume(self) -> bool:
        """Whether the policy looks at the reconstruction, and not at its latent alone."""
        return self._policy.wants_volume

    @property
    def provenance(self) -> Mapping[str, str]:
        """What diagnostics tell of what runs the policy; empty where it is not learned."""
        provenance: Mapping[str, str] = getattr(self._policy, 'provenance', {})
        return provenance

    def reset(self) -> None:
        """Forget the episode; raises ViewError where a policy of one's own fails."""
        self._views: list[PlannerView] = []
        self._state = begun_by(self._policy)
        self._choice: Choice | None = None
        self._first: Camera | None = None
        self._wanted: Wanted | None = None
        self._candidates: list[OrbitCamera] = []
        self._failed: list[Camera] = []
        self._reached: list[Camera] = []
        self._stopped = False
        self._goal: Goal | None = None
        self._early: tuple[PlannerView, Choice, State] | None = None

    def go_on_from(self, other: 'Planner') -> None:
        """
        Take over what another planner has seen of the episode, as if it had always been this one.

        Volumes before the last are not kept, so a policy that looks at them chooses after the last
        alone. Where that has none, since no policy wanted it, an even sweep chooses once more.
        Raises ViewError where this planner's policy cannot use what was seen, and then is good for
        nothing.
        """
        self._views = list(other._views)
        self._failed, self._reached = list(other._failed), list(other._reached)
        self._stopped = other._stopped
        if self._views:
            self._look_from(self._views[-1].camera)
            if (self._policy is other._policy and self._yaw == other._yaw
                    and self._places == other._places):
                self._choice, self._state = other._choice, other._state
            elif self._policy.wants_volume and self._views[-1].volume is None:
                self._choice, _ = self._sweep.choose(observation(
                    self._views, self._candidates, self._yaw, False, self._limits), {})
            else:
                whole = len(self._views)
                for count in range(whole if self._policy.wants_volume else 1, whole + 1):
                    self._choose(self._views[:count])
            self._aim(self._views[-1].camera)
        elif other._first is not None:
            self._aim_first(other._first)

    def first_goal(self, camera: Camera) -> Goal:
        """
        Return the goal of the view that no policy chooses: a camera's, or as near as can be.

        Raises ViewError where none is left that was not given up.
        """
        self._aim_first(camera)
        return self.plan()

    def expect_camera(self, camera: Camera, size: float) -> None:
        """
        Let the policy prepare for the view of a camera before its reconstruction is known.

        `size` is the side of the volume to come, metres. Nothing is decided: a policy that has
        something to compute of the cameras alone offers `prepare`, with their poses as in an
        Observation, and keeps what it finds. Raises ViewError where one of your own fails.
        """
        prepare = getattr(self._policy, 'prepare', None)
        if prepare is None:
            return
        # A ViewError is told by `add_view`
        with telling_failures('policy: prepare'), suppress(ViewError):
            prepare(policy_poses([camera], self._yaw, 1 / size)[0],
                    policy_poses(self._places.candidates(camera), self._yaw, 1 / size))

    def expect_view(self, latent: NDArray[np.float32], camera: Camera,
                    volume: VoxelGrid | None = None) -> None:
        """
        Let the policy choose after a view before all of it is known, for `add_view` to take up.

        The arguments are those of `add_view`, and the same objects are to be given to it; then it
        decides as it would have without this. Policies that look at the latent alone are quick,
        and some draw numbers: they choose in `add_view`.
        """
        self._early = None
        if not self._policy.wants_volume:
            return
        view = PlannerView(latent, camera, math.nan, volume)
        try:
            candidates = self._places.candidates(camera)
            choice, state = chosen(
                self._policy, self._observed([*self._views, view], candidates), self._state)
        except ViewError:
            return  # which `add_view` tells
        self._early = view, choice, state

    def add_view(self, latent: NDArray[np.float32], camera: Camera, entropy: float,
                 volume: VoxelGrid | None = None, quality: Quality | None = None,
                 earlier: Sequence[Camera] = ()) -> Decision:
        """
        Take in a view and decide.

        The arguments are those of `PlannerView`; of an episode's views before its first, which
        are `earlier`, a planner knows the cameras alone. They count and are not asked for again.
        Raises ViewError, and then nothing has changed.
        """
        if not (math.isfinite(entropy) and np.isfinite(latent).all()):
            raise ViewError('latent or entropy not finite: expected finite numbers, got entropy '
                            f'{entropy}', 'latent')
        before = self._candidates
        if earlier and not self._views:
            self._early = None  # chosen without them
        self._look_from(camera)
        # A volume takes a megabyte, and only the last is looked at
        views = [*self._views[:-1], *(replace(view, volume=None) for view in self._views[-1:]),
                 PlannerView(latent, camera, entropy, volume, quality,
                             () if self._views else tuple(earlier))]
        try:
            self._choose(views)
        except ViewError:
            self._candidates = before
            raise
        self._views = views
        if (self._goal is not None
                and view_distance(self._goal.camera, camera) <= GOAL_TOLERANCE):
            self._reached.append(self._goal.camera)
        self._aim(camera)
        if self._stopped:
            return self.stop()
        worth = None if self._goal is None else self._goal.worth
        entropies = [*[math.nan] * len(views[0].earlier), *(view.entropy for view in views)]
        reason = self._stopping.reason(entropies, quality, worth,
                                       bool(self.provenance) and self._goes_around)
        return Decision(None, reason) if reason else self.next_goal()

    def give_up(self, goal: Camera, camera: Camera | None = None) -> Decision:
        """
        Leave a goal's view out for the episode and decide on the next best, or to end it.

        `camera` is where it is, None: where the last view was taken. Raises ViewError where
        nothing was asked for yet.
        """
        if self._wanted is None:
            raise ViewError('no goal to give up: expected one before it is given up, got none',
                            'plan')
        self._failed.append(goal)
        if camera is None:
            camera = self._views[-1].camera if self._views else goal
        self._goal = self._best(camera)
        reason = self._stopping.reason_of_gain(None if self._goal is None else self._goal.worth)
        return Decision(None, reason) if reason else self.next_goal()

    def stop(self) -> Decision:
        """End the episode for a reason from outside; `plan` still tells where next."""
        self._stopped = True
        return Decision(None, 'stopped')

    def plan(self) -> Goal:
        """Return the goal after the views so far, whether or not the episode is done."""
        if self._goal is None:
            raise ViewError(
                'no view is left: every one that can be reached was taken or given up'
                if self._wanted else
                'no view in this episode yet: expected one before a plan', 'plan')
        return self._goal

    @property
    def lacks_gains(self) -> bool:
        """Whether the policy's last scores are no expected gains, which `min_gain` needs."""
        return not self.sweeps and self._choice is not None and not self._choice.is_gain

    @property
    def _goes_around(self) -> bool:
        """Whether all candidates are of a turntable, where the learned policy has own promises."""
        return on_one_ring(np.stack([camera.position for camera in self._candidates]))

    @property
    def sweeps(self) -> bool:
        """Whether an even sweep chooses in the policy's place: the last view is unusual."""
        last = self._views[-1].quality if self._views else None
        return last is not None and bool(last.suspect)

    def reason(self) -> GoalReason | None:
        """Return why the goal is worth its view; None without probabilities after a view."""
        last = self._views[-1] if self._views else None
        if last is None or last.volume is None or self._goal is None:
            return None
        if self.sweeps:
            return GoalReason('next of an even sweep, since the views are unusual')
        poses = np.stack([camera.scaled(1 / last.volume.size).pose for camera in (
            self._goal.camera, *cameras_of(self._views))])
        return goal_reason(Observation(last.latent[None], poses[None, 1:], poses[None, :1],
                                       last.volume.occupancy[None]), poses[0], self._goal.gain)

    def next_goal(self) -> Decision:
        """Return the goal after the views so far, or that none can be reached."""
        return Decision(self._goal, '' if self._goal else 'no_reachable_azimuth')

    def _look_from(self, camera: Camera) -> None:
        """Place the candidates, where their elevation is the camera's."""
        self._candidates = self._places.candidates(camera)

    def _choose(self, views: Sequence[PlannerView]) -> None:
        """Let the policy choose after the last of some views."""
        last, early = views[-1], self._early
        self._early = None
        seen = self._observed(views, self._candidates)
        if early is not None and early[0].is_of(last):
            _, self._choice, self._state = early
        else:
            self._choice, self._state = chosen(self._policy, seen, self._state)
        if last.quality is not None and last.quality.suspect:
            self._choice, _ = self._sweep.choose(seen, {})

    def _observed(self, views: Sequence[PlannerView],
                  candidates: Sequence[OrbitCamera]) -> Observation:
        """Return what the policy sees after the last of some views."""
        return observation(
            views, candidates, self._yaw, self._policy.wants_volume, self._limits)

    def _aim_first(self, camera: Camera) -> None:
        """Make the best of a camera that no policy chose."""
        self._first = camera
        self._look_from(camera)
        away = view_distances(self._candidates, [camera])[:, 0].astype(np.float32)
        self._wanted = Wanted(self._places.goal(camera.azimuth, camera), -away)
        self._goal = self._best(camera)

    def _aim(self, camera: Camera) -> None:
        """Make the best of the policy's choice for a camera."""
        assert self._choice is not None
        proposed = np.nan if self._choice.azimuth is None else float(self._choice.azimuth[0])
        self._wanted = Wanted(
            None if math.isnan(proposed) else self._places.goal(proposed + self._yaw, camera),
            self._choice.scores[0], self._choice.is_gain)
        self._goal = self._best(camera)

    def _best(self, camera: Camera) -> Goal | None:
        """Return the best goal for a camera that is somewhere; None where none is left."""
        assert self._wanted is not None
        return best_goal(
            self._wanted, self._candidates, camera, [*cameras_of(self._views), *self._reached],
            self._failed, self._limits, self._cost if self._views else MotionCost())
