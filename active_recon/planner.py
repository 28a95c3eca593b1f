"""A policy and the state of one episode: the core of the view planner's node."""

from dataclasses import dataclass
import math
from pathlib import Path
from typing import Any

from active_recon.cameras import azimuth_difference, AZIMUTHS, nearest_view, TURN, wrap_azimuth
from active_recon.errors import ConfigError, ViewError
from active_recon.motion import MotionLimits, worth
from active_recon.policies import Choice, load_policy, Policy
import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Goal:
    """
    Where to look next, and what every candidate that can be reached is worth (more is better).

    The azimuth itself may lie between the candidates, (N,); azimuths in radians.
    """

    azimuth: float
    candidates: NDArray[np.float64]
    scores: NDArray[np.float32]


@dataclass(frozen=True)
class Decision:
    """
    A goal, or the reason why there is none.

    That is max_views, entropy_settled, no_reachable_azimuth or stopped.
    """

    goal: Goal | None
    reason: str = ''


class Planner:
    """
    Decides after every view of an episode: where next, or that it is enough.

    Azimuths come and go in the object frame. `object_yaw` is the azimuth of the object's front
    (radians): a learned policy thinks relative to the front. A goal is what the policy chooses,
    or the best of the candidates where the camera cannot go there, was there already, or has too
    long a way: `motion_weight` is what half a turn costs, beside 1 for what lies between the
    policy's worst and best candidate. An azimuth is asked for again only when no other is left.
    """

    def __init__(self, policy: Policy, max_views: int = 5, entropy_tolerance: float = 0.01,
                 object_yaw: float = 0.0, limits: MotionLimits | None = None,
                 motion_weight: float = 0.0) -> None:
        if max_views < 1:
            raise ConfigError(f'max_views: expected 1 or more, got {max_views}')
        if not 0 <= entropy_tolerance < 1:
            raise ConfigError(f'entropy_tolerance: expected a share in [0, 1), got '
                              f'{entropy_tolerance}')
        if not math.isfinite(object_yaw):
            raise ConfigError(f'object_yaw: expected finite radians, got {object_yaw}')
        if not 0 <= motion_weight < math.inf:
            raise ConfigError(f'motion_weight: expected 0 or more, got {motion_weight}')
        self._policy = policy
        self._max_views = max_views
        self._entropy_tolerance = entropy_tolerance
        self._yaw = object_yaw
        self._limits = limits or MotionLimits()
        self._motion_weight = motion_weight
        self._candidates = self._limits.candidates((AZIMUTHS + object_yaw) % TURN)
        self.reset()

    @classmethod
    def load(cls, policy: str = 'attention', weights: Path | None = None, seed: int = 0,
             max_views: int = 5, entropy_tolerance: float = 0.01, object_yaw: float = 0.0,
             device: str = 'cpu', limits: MotionLimits | None = None,
             motion_weight: float = 0.0) -> 'Planner':
        """Build the planner of a policy's name; raises ConfigError and WeightsError."""
        rng = np.random.default_rng(seed)
        return cls(load_policy(policy, weights, rng, max_views, device), max_views,
                   entropy_tolerance, object_yaw, limits, motion_weight)

    def reset(self) -> None:
        """Forget the episode."""
        self._taken: list[float] = []
        self._latents: list[NDArray[np.float32]] = []
        self._entropies: list[float] = []
        self._state: Any = None
        self._choice: Choice | None = None
        self._wanted: tuple[float, NDArray[np.float32]] | None = None
        self._failed: set[int] = set()
        self._stopped = False
        self._goal: Goal | None = None

    def go_on_from(self, other: 'Planner') -> None:
        """
        Take over what another planner has seen of the episode, as if it had always been this one.

        Raises ViewError where this planner's policy cannot use it, and then is good for nothing.
        """
        self._taken, self._latents = list(other._taken), list(other._latents)
        self._entropies, self._stopped = list(other._entropies), other._stopped
        self._failed = {nearest_view(float(other._candidates[each]), self._candidates)
                        for each in other._failed}
        if self._policy is other._policy:
            self._choice, self._state = other._choice, other._state
        else:
            for count, latent in enumerate(self._latents, 1):
                self._choose(latent, self._taken[:count])
        if self._taken:
            self._aim(self._taken[-1])
        elif other._wanted is not None:
            self._aim_first(other._wanted[0])

    def first_goal(self, azimuth: float) -> Goal:
        """
        Return the goal of the view that no policy chooses: there, or as near as can be.

        Raises ViewError where the azimuth is not finite, or none is left that was not given up.
        """
        if not math.isfinite(azimuth):
            raise ViewError(f'expected a finite azimuth, got {azimuth}', 'azimuth')
        self._aim_first(azimuth)
        return self.plan()

    def add_view(self, latent: NDArray[np.float32], azimuth: float, entropy: float) -> Decision:
        """
        Take in a view and decide.

        - latent: (C, h, w), A_t after that view
        - azimuth: of the view that was really taken, radians
        - entropy: of the reconstruction after that view, nats

        Raises ViewError, and then nothing has changed.
        """
        if not (math.isfinite(azimuth) and math.isfinite(entropy) and np.isfinite(latent).all()):
            raise ViewError('expected a finite latent, azimuth and entropy, got azimuth '
                            f'{azimuth} and entropy {entropy}', 'latent')
        taken = [*self._taken, azimuth]
        self._choose(latent, taken)
        self._taken = taken
        self._latents.append(latent)
        self._entropies.append(entropy)
        self._aim(azimuth)
        if self._stopped:
            return self.stop()
        if len(self._taken) >= self._max_views:
            return Decision(None, 'max_views')
        if self._settled():
            return Decision(None, 'entropy_settled')
        return self.next_goal()

    def give_up(self, azimuth: float, camera: float | None = None) -> Decision:
        """
        Leave a goal's azimuth out for the episode and decide on the next best.

        `camera` is the azimuth where it is, None: where the last view was taken; radians. Raises
        ViewError where nothing was asked for yet.
        """
        if self._wanted is None:
            raise ViewError('expected a goal before it is given up, got none', 'plan')
        self._failed.add(nearest_view(azimuth, self._candidates))
        if camera is None:
            camera = self._taken[-1] if self._taken else azimuth
        self._goal = self._best(camera)
        return self.next_goal()

    def stop(self) -> Decision:
        """End the episode for a reason from outside; `plan` still tells where next."""
        self._stopped = True
        return Decision(None, 'stopped')

    def plan(self) -> Goal:
        """Return the goal after the views so far, whether or not the episode is done."""
        if self._goal is None:
            raise ViewError(
                'expected an azimuth that can be reached; every one was given up in this episode'
                if self._wanted else
                'expected a view before a plan; this episode has none yet', 'plan')
        return self._goal

    def next_goal(self) -> Decision:
        """Return the goal after the views so far, or that none can be reached."""
        return Decision(self._goal, '' if self._goal else 'no_reachable_azimuth')

    def _choose(self, latent: NDArray[np.float32], taken: list[float]) -> None:
        """Let the policy choose after a view."""
        self._choice, self._state = self._policy.choose(
            latent[None], np.array([taken]) - self._yaw, self._state)

    def _aim_first(self, azimuth: float) -> None:
        """Make the best of an azimuth that no policy chose."""
        away = azimuth_difference(self._candidates, azimuth)
        self._wanted = wrap_azimuth(azimuth), -np.abs(away).astype(np.float32)
        self._goal = self._best(azimuth)

    def _aim(self, azimuth: float) -> None:
        """Make the best of the policy's choice for a camera that is at an azimuth."""
        assert self._choice is not None
        self._wanted = (wrap_azimuth(float(self._choice.azimuth[0]) + self._yaw),
                        self._at_candidates(self._choice.scores[0]))
        self._goal = self._best(azimuth)

    def _best(self, azimuth: float) -> Goal | None:
        """Return the best goal for a camera that is at an azimuth; None where none is left."""
        assert self._wanted is not None
        choice, scores = self._wanted
        options = np.append(choice, self._candidates)
        nearest = np.array([nearest_view(choice, self._candidates),
                            *range(len(self._candidates))])
        open_ = self._limits.allows(options) & ~np.isin(nearest, list(self._failed))
        taken = [nearest_view(view, self._candidates) for view in self._taken]
        fresh = open_ & ~np.isin(nearest, taken)
        travel = np.abs(azimuth_difference(options, azimuth))
        value = worth(np.append(scores.max(), scores), travel,
                      self._motion_weight if self._taken else 0.0)
        if not open_.any():
            return None
        best = int(np.where(fresh if fresh.any() else open_, value, -np.inf).argmax())
        return Goal(float(options[best]), self._candidates[open_[1:]], value[1:][open_[1:]])

    def _at_candidates(self, scores: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return a policy's scores of its 24 azimuths at the candidates, interpolated."""
        if self._candidates.shape == AZIMUTHS.shape and not self._limits.reachable_azimuths:
            return scores
        return np.interp(self._candidates - self._yaw, AZIMUTHS, scores,
                         period=TURN).astype(np.float32)

    def _settled(self) -> bool:
        """Whether the last two views each changed the entropy by no more than the tolerance."""
        if self._entropy_tolerance == 0 or len(self._entropies) < 3:
            return False
        recent = np.array(self._entropies[-3:])
        change = np.abs(np.diff(recent)) / np.maximum(recent[:-1], 1e-9)
        return bool((change <= self._entropy_tolerance).all())
