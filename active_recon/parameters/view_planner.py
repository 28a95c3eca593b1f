"""The parameters of the view planner."""

from dataclasses import dataclass
import math

from active_recon.acquisition.motion import MotionLimits
from active_recon.geometry.cameras import TURN
from active_recon.parameters.declaration import parameter
from active_recon.parameters.shared import (
    CubeSettings,
    FrontSettings,
    ManagedSettings,
    NetworkSettings,
)
from active_recon.policies import DEFAULT_POLICY, POLICIES


@dataclass(frozen=True)
class ViewPlannerSettings(FrontSettings, CubeSettings, NetworkSettings, ManagedSettings):
    """What the view planner is told."""

    policy: str = parameter(
        DEFAULT_POLICY, 'how the next view is chosen; attention is learned, and takes weights '
        'that bring it, such as those of 2d3d-attention', choices=tuple(POLICIES),
        changeable=True)
    seed: int = parameter(0, 'of the policy random', low=0, high=2**32 - 1, changeable=True)
    max_views: int = parameter(
        5, 'views after which an episode is done', low=1, high=1000, changeable=True)
    entropy_tolerance: float = parameter(
        0.01, 'share by which the entropy may still change, twice in a row, when it has settled; '
        '0 to go on until max_views', low=0.0, high=0.99, changeable=True)
    azimuth_range: tuple[float, ...] = parameter(
        (0.0, TURN), 'low and high, counter-clockwise, between which the camera can go, rad',
        low=-2 * TURN, high=2 * TURN, changeable=True)
    forbidden_sectors: tuple[float, ...] = parameter(
        (), 'low, high, low, high, ... of where the camera must not go, rad',
        low=-2 * TURN, high=2 * TURN, changeable=True)
    reachable_azimuths: tuple[float, ...] = parameter(
        (), 'the only azimuths that there are, rad; empty for any', low=-2 * TURN, high=2 * TURN,
        changeable=True)
    motion_weight: float = parameter(
        0.0, 'what half a turn costs, beside 1 between the worst and the best azimuth in the '
        "policy's eyes", low=0.0, high=1000.0, changeable=True)
    goal_timeout: float = parameter(
        0.0, 's after which a goal without a view is left out for the next best; 0 for never',
        low=0.0, high=86400.0, changeable=True)
    start_azimuth: float = parameter(
        math.nan, 'of the first view, rad; nan for where the camera is',
        low=-2 * math.pi, high=2 * math.pi)
    elevation: float = parameter(
        math.nan, "of the goals' cameras, rad; nan for that of the camera", low=-1.5, high=1.5)
    distance: float = parameter(
        math.nan, "of the goals' cameras, m; nan for 2.1 object_size", low=0.001, high=10000.0)

    def __post_init__(self) -> None:
        """Refuse limits that leave the camera nowhere to go."""
        self.limits()

    def limits(self) -> MotionLimits:
        """Return where the camera can go; raises ConfigError."""
        return MotionLimits(self.azimuth_range, self.forbidden_sectors, self.reachable_azimuths)
