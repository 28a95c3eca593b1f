"""The parameters of the view planner."""

from dataclasses import dataclass
import math

from active_recon.acquisition.goal_places import goal_places, STEEPEST
from active_recon.acquisition.motion import MotionLimits
from active_recon.acquisition.motion_cost import MotionCost, TimedMotion
from active_recon.geometry.cameras import CANONICAL_DISTANCE, TURN
from active_recon.parameters.declaration import parameter
from active_recon.parameters.shared import (
    CubeParameters,
    FrontParameters,
    ManagedParameters,
    NetworkParameters,
)
from active_recon.policies import AUTO_POLICY, POLICIES


@dataclass(frozen=True)
class ViewPlannerParameters(FrontParameters, CubeParameters, NetworkParameters, ManagedParameters):
    """Parameters of the view planner."""

    policy: str = parameter(
        AUTO_POLICY, 'policy that chooses the next view; attention is learned and needs weights '
        'that have one, such as those of lifting or 2d3d-attention; auto is attention where the '
        'weights have it, else uniform, an even sweep', choices=(AUTO_POLICY, *POLICIES),
        dynamic=True)
    seed: int = parameter(0, 'seed of the policy random', low=0, high=2**32 - 1, dynamic=True)
    max_views: int = parameter(
        5, 'number of views after which an episode is done', low=1, high=1000, dynamic=True)
    entropy_tolerance: float = parameter(
        0.01, 'an episode is done after two views that each change the entropy by at most this '
        'fraction; 0 to continue until max_views', low=0.0, high=0.99, dynamic=True)
    target_quality: float = parameter(
        0.0, 'an episode is done when this IoU with the true shape is promised, in [0, 1), or is '
        'out of reach; 0 for no target. Needs weights with quality tables', low=0.0, high=0.99,
        dynamic=True)
    min_gain: float = parameter(
        0.0, 'an episode is done when no view in reach has an expected gain of IoU as large, less '
        'the motion_cost of its time, in [0, 1); 0 for any gain. Needs a policy whose scores are '
        'expected gains', low=0.0, high=0.99, dynamic=True)
    azimuth_range: tuple[float, ...] = parameter(
        (0.0, TURN), 'low and high end, counter-clockwise, of the azimuths in reach, rad',
        low=-2 * TURN, high=2 * TURN, dynamic=True)
    forbidden_sectors: tuple[float, ...] = parameter(
        (), 'low, high, low, high, ...: azimuths that the camera must not be at, rad',
        low=-2 * TURN, high=2 * TURN, dynamic=True)
    reachable_azimuths: tuple[float, ...] = parameter(
        (), 'the only azimuths that the camera can reach, rad; empty for any', low=-2 * TURN,
        high=2 * TURN, dynamic=True)
    motion_weight: float = parameter(
        0.0, "cost of half a turn, relative to the policy's scores, which are scaled to [0, 1]",
        low=0.0, high=1000.0, dynamic=True)
    motion_cost: float = parameter(
        0.0, 'cost of each second until the view is taken: of IoU where the scores of the policy '
        'are expected gains of it, else of scores scaled to [0, 1]; instead of motion_weight',
        low=0.0, high=1000.0, dynamic=True)
    azimuth_speed: float = parameter(
        1.0, 'speed of the camera around the object, for motion_cost, rad/s', low=0.001,
        high=1000.0, dynamic=True)
    elevation_speed: float = parameter(
        1.0, 'speed of the camera up and down, for motion_cost, rad/s', low=0.001, high=1000.0,
        dynamic=True)
    view_time: float = parameter(
        0.0, 'time of a view once the camera is there, settling included, for motion_cost, s',
        low=0.0, high=3600.0, dynamic=True)
    goal_timeout: float = parameter(
        0.0, 'time after which a goal without a view is replaced by the next best, s; 0 for never',
        low=0.0, high=86400.0, dynamic=True)
    start_azimuth: float = parameter(
        math.nan, 'azimuth of the first view, rad; nan for that of the camera',
        low=-2 * math.pi, high=2 * math.pi)
    elevation: float = parameter(
        math.nan, 'elevation of the goals, rad; nan for that of the camera', low=-STEEPEST,
        high=STEEPEST)
    elevation_range: tuple[float, ...] = parameter(
        (), 'low and high elevation of goals that may stand anywhere between them, rad; empty for '
        'goals at one elevation', low=-STEEPEST, high=STEEPEST)
    reachable_views: tuple[float, ...] = parameter(
        (), 'azimuth (rad), elevation (rad), distance (m; 0 for `distance`), azimuth, ... of the '
        'only views that the camera can reach; empty for any', low=-2 * TURN, high=10000.0)
    distance: float = parameter(
        math.nan, 'distance of the goals, m; nan for 2.1 object_size', low=0.001, high=10000.0)

    def __post_init__(self) -> None:
        """Reject limits that leave no view, and places or costs that contradict each other."""
        goal_places(self.limits(), 0.0, self.goal_elevation, self.goal_distance,
                    self.elevation_range, self.reachable_views)
        MotionCost(self.motion_weight, self.motion())

    @property
    def goal_elevation(self) -> float | None:
        """The elevation of the goals, radians; None: that of the camera."""
        return None if math.isnan(self.elevation) else self.elevation

    @property
    def goal_distance(self) -> float:
        """The distance of the goals, metres."""
        return (CANONICAL_DISTANCE * self.object_size if math.isnan(self.distance)
                else self.distance)

    def limits(self) -> MotionLimits:
        """Return the limits of the camera's motion; raises ConfigError."""
        return MotionLimits(self.azimuth_range, self.forbidden_sectors, self.reachable_azimuths)

    def motion(self) -> TimedMotion:
        """Return the time that views take and its cost; raises ConfigError."""
        return TimedMotion(self.azimuth_speed, self.elevation_speed, self.view_time,
                           self.motion_cost)
