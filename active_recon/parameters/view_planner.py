"""The parameters of the view planner."""

from dataclasses import dataclass
import math

from active_recon.acquisition.motion import MotionLimits
from active_recon.geometry.cameras import TURN
from active_recon.parameters.declaration import parameter
from active_recon.parameters.shared import (
    CubeParameters,
    FrontParameters,
    ManagedParameters,
    NetworkParameters,
)
from active_recon.policies import DEFAULT_POLICY, POLICIES


@dataclass(frozen=True)
class ViewPlannerParameters(FrontParameters, CubeParameters, NetworkParameters, ManagedParameters):
    """Parameters of the view planner."""

    policy: str = parameter(
        DEFAULT_POLICY, 'policy that chooses the next view; attention is learned and needs '
        'weights that contain it, such as those of 2d3d-attention', choices=tuple(POLICIES),
        dynamic=True)
    seed: int = parameter(0, 'seed of the policy random', low=0, high=2**32 - 1, dynamic=True)
    max_views: int = parameter(
        5, 'number of views after which an episode is done', low=1, high=1000, dynamic=True)
    entropy_tolerance: float = parameter(
        0.01, 'an episode is done after two views that each change the entropy by at most this '
        'fraction; 0 to continue until max_views', low=0.0, high=0.99, dynamic=True)
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
    goal_timeout: float = parameter(
        0.0, 'time after which a goal without a view is replaced by the next best, s; 0 for never',
        low=0.0, high=86400.0, dynamic=True)
    start_azimuth: float = parameter(
        math.nan, 'azimuth of the first view, rad; nan for that of the camera',
        low=-2 * math.pi, high=2 * math.pi)
    elevation: float = parameter(
        math.nan, 'elevation of the goals, rad; nan for that of the camera', low=-1.5, high=1.5)
    distance: float = parameter(
        math.nan, 'distance of the goals, m; nan for 2.1 object_size', low=0.001, high=10000.0)

    def __post_init__(self) -> None:
        """Reject limits that leave no azimuth."""
        self.limits()

    def limits(self) -> MotionLimits:
        """Return the limits of the camera's motion; raises ConfigError."""
        return MotionLimits(self.azimuth_range, self.forbidden_sectors, self.reachable_azimuths)
