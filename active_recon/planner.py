"""A policy and the state of one episode: the core of the view planner's node."""

from dataclasses import dataclass
import math
from pathlib import Path
from typing import Any

from active_recon.cameras import azimuth_difference, AZIMUTHS, TURN, wrap_azimuth
from active_recon.errors import ConfigError, ViewError
from active_recon.policies import Choice, load_policy, Policy
import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Goal:
    """Where to look next, and what the policy thinks of every candidate (more is better)."""

    azimuth: float
    candidates: NDArray[np.float64]
    scores: NDArray[np.float32]


@dataclass(frozen=True)
class Decision:
    """A goal, or the reason why none is needed: max_views or entropy_settled."""

    goal: Goal | None
    reason: str = ''


class Planner:
    """
    Decides after every view of an episode: where next, or that it is enough.

    Azimuths come and go in the object frame. `object_yaw` is the azimuth of the object's front
    (radians): a learned policy thinks relative to the front.
    """

    def __init__(self, policy: Policy, max_views: int = 5, entropy_tolerance: float = 0.01,
                 object_yaw: float = 0.0) -> None:
        if max_views < 1:
            raise ConfigError(f'max_views: expected 1 or more, got {max_views}')
        if not 0 <= entropy_tolerance < 1:
            raise ConfigError(f'entropy_tolerance: expected a share in [0, 1), got '
                              f'{entropy_tolerance}')
        if not math.isfinite(object_yaw):
            raise ConfigError(f'object_yaw: expected finite radians, got {object_yaw}')
        self._policy = policy
        self._max_views = max_views
        self._entropy_tolerance = entropy_tolerance
        self._yaw = object_yaw
        self._candidates = (AZIMUTHS + object_yaw) % TURN
        self.reset()

    @classmethod
    def load(cls, policy: str = 'attention', weights: Path | None = None, seed: int = 0,
             max_views: int = 5, entropy_tolerance: float = 0.01, object_yaw: float = 0.0,
             device: str = 'cpu') -> 'Planner':
        """Build the planner of a policy's name; raises ConfigError and WeightsError."""
        rng = np.random.default_rng(seed)
        return cls(load_policy(policy, weights, rng, max_views, device), max_views,
                   entropy_tolerance, object_yaw)

    def reset(self) -> None:
        """Forget the episode."""
        self._taken: list[float] = []
        self._entropies: list[float] = []
        self._state: Any = None
        self._goal: Goal | None = None

    def first_goal(self, azimuth: float) -> Goal:
        """Return the goal of the view that no policy chooses: the first."""
        if not math.isfinite(azimuth):
            raise ViewError(f'expected a finite azimuth, got {azimuth}', 'azimuth')
        away = azimuth_difference(self._candidates, azimuth)
        self._goal = Goal(wrap_azimuth(azimuth), self._candidates,
                          -np.abs(away).astype(np.float32))
        return self._goal

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
        choice, self._state = self._policy.choose(
            latent[None], np.array([taken]) - self._yaw, self._state)
        self._taken = taken
        self._entropies.append(entropy)
        self._goal = self._in_object_frame(choice)
        if len(self._taken) >= self._max_views:
            return Decision(None, 'max_views')
        if self._settled():
            return Decision(None, 'entropy_settled')
        return Decision(self._goal)

    def plan(self) -> Goal:
        """Return the goal after the views so far, whether or not the episode is done."""
        if self._goal is None:
            raise ViewError('expected a view before a plan; this episode has none yet', 'plan')
        return self._goal

    def _in_object_frame(self, choice: Choice) -> Goal:
        return Goal(wrap_azimuth(float(choice.azimuth[0]) + self._yaw), self._candidates,
                    choice.scores[0])

    def _settled(self) -> bool:
        """Whether the last two views each changed the entropy by no more than the tolerance."""
        if self._entropy_tolerance == 0 or len(self._entropies) < 3:
            return False
        recent = np.array(self._entropies[-3:])
        change = np.abs(np.diff(recent)) / np.maximum(recent[:-1], 1e-9)
        return bool((change <= self._entropy_tolerance).all())
