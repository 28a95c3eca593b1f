"""What a way costs: relative to the scores of a policy, or by the seconds that it takes."""

from collections.abc import Sequence
from dataclasses import dataclass
import math

from active_recon.acquisition.motion import MotionLimits
from active_recon.errors import ConfigError
from active_recon.geometry.cameras import azimuth_difference, Camera
import numpy as np
from numpy.typing import NDArray

Scores = NDArray[np.float32]


@dataclass(frozen=True)
class TimedMotion:
    """
    The time that a view takes, and what a second of it costs.

    - azimuth_speed, elevation_speed: of the camera around the object, rad/s; both axes move at
      once, a change of distance takes no time
    - view_time: what a view takes once the camera is there, s
    - motion_cost: of one second, in units of the scores where they are expected gains, else of
      scores that are scaled to [0, 1]

    Raises ConfigError on values out of range.
    """

    azimuth_speed: float = 1.0
    elevation_speed: float = 1.0
    view_time: float = 0.0
    motion_cost: float = 0.0

    def __post_init__(self) -> None:
        """Reject values out of range."""
        for name in ('azimuth_speed', 'elevation_speed'):
            if not 0 < getattr(self, name) < math.inf:
                raise ConfigError(f'{name}: out of range: expected rad/s above 0, got '
                                  f'{getattr(self, name)}')
        for name in ('view_time', 'motion_cost'):
            if not 0 <= getattr(self, name) < math.inf:
                raise ConfigError(
                    f'{name}: out of range: expected 0 or more, got {getattr(self, name)}')

    def seconds(self, camera: Camera, goals: Sequence[Camera],
                limits: MotionLimits) -> NDArray[np.float64]:
        """
        Return the time to each of N goals and of the view there, (N,), from where a camera is.

        The way around is `MotionLimits.way`: it avoids what is forbidden.
        """
        around = limits.way(camera.azimuth, [goal.azimuth for goal in goals])
        climb = np.abs(np.array([goal.elevation for goal in goals]) - camera.elevation)
        return np.asarray(np.maximum(around / self.azimuth_speed, climb / self.elevation_speed)
                          + self.view_time)


@dataclass(frozen=True)
class MotionCost:
    """
    What motion costs beside a policy's scores; by default nothing.

    - motion_weight: of half a turn, the short way round, beside scores scaled to [0, 1];
      elevations do not count
    - timed: the cost of the time, instead

    Raises ConfigError on values out of range, and where motion is counted twice.
    """

    motion_weight: float = 0.0
    timed: TimedMotion = TimedMotion()

    def __post_init__(self) -> None:
        """Reject values out of range, and both costs together."""
        if not 0 <= self.motion_weight < math.inf:
            raise ConfigError('motion_weight: out of range: expected 0 or more, got '
                              f'{self.motion_weight}')
        if self.motion_weight and self.timed.motion_cost:
            raise ConfigError('motion_weight, motion_cost: both given: expected one of them above '
                              f'0, got {self.motion_weight:g} and {self.timed.motion_cost:g}')

    def utility(self, scores: Scores, is_gain: bool, camera: Camera, goals: Sequence[Camera],
                limits: MotionLimits) -> Scores:
        """
        Return what N goals are worth, (N,): a policy's scores less the cost of the way to them.

        `is_gain` as in `Choice`; `camera` is where the way begins. Where motion costs nothing the
        scores are returned unchanged.
        """
        if self.motion_weight:
            travel = azimuth_difference([goal.azimuth for goal in goals], camera.azimuth)
            return utility(scores, np.abs(travel), self.motion_weight)
        if not self.timed.motion_cost:
            return scores
        return self.less_time(scores if is_gain else scaled(scores), camera, goals, limits)

    def less_time(self, values: NDArray[np.floating], camera: Camera, goals: Sequence[Camera],
                  limits: MotionLimits) -> Scores:
        """Return what N goals are worth (N,), less `motion_cost` of the seconds to their views."""
        if not self.timed.motion_cost:
            return np.asarray(values, np.float32)
        seconds = self.timed.seconds(camera, goals, limits)
        return np.asarray(values - self.timed.motion_cost * seconds, np.float32)


def utility(scores: Scores, travel: NDArray[np.float64], motion_weight: float) -> Scores:
    """
    Return the utility of candidates, (N,): a policy's scores less the cost of `travel` (radians).

    The scores are scaled to [0, 1], and half a turn costs `motion_weight`, so that one weight
    means the same for every policy. With 0 the scores are returned unchanged.
    """
    if motion_weight == 0:
        return scores
    return np.asarray(scaled(scores) - motion_weight * travel / math.pi, np.float32)


def scaled(scores: Scores) -> NDArray[np.float64]:
    """Return scores from 0, the worst, to 1, the best; all 0 where they are alike."""
    spread = max(float(np.ptp(scores)), 1e-9)
    return np.asarray((scores - scores.min()).astype(np.float64) / spread)
