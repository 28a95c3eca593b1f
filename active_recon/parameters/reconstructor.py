"""The parameters of the reconstructor."""

from dataclasses import dataclass
import math

from active_recon.acquisition.stillness import STILL_TIME
from active_recon.acquisition.view_gate import GOAL_TOLERANCE, TAKE_VIEWS
from active_recon.parameters.background import BackgroundSettings
from active_recon.parameters.camera_pose import CameraPoseSettings
from active_recon.parameters.declaration import parameter
from active_recon.parameters.shared import (
    CubeSettings,
    FrontSettings,
    ManagedSettings,
    NetworkSettings,
)
from active_recon.volumes.voxels import MESH_FORMATS


@dataclass(frozen=True)
class ReconstructorSettings(BackgroundSettings, CameraPoseSettings, FrontSettings, CubeSettings,
                            NetworkSettings, ManagedSettings):
    """What the reconstructor is told."""

    device: str = parameter('cpu', 'where the network runs', choices=('cpu', 'cuda'))
    threshold: float = parameter(
        math.nan, "occupancy above which a cell is occupied; nan for the weights' own",
        low=0.01, high=0.99, changeable=True)
    take_views: str = parameter(
        'auto', 'which images become views', choices=TAKE_VIEWS, changeable=True)
    goal_tolerance: float = parameter(
        GOAL_TOLERANCE, 'rad from a goal that still reach it', low=0.0, high=math.pi,
        changeable=True)
    min_view_separation: float = parameter(
        0.2, 'rad between views while there are no goals', low=0.0, high=math.pi, changeable=True)
    settle_time: float = parameter(
        STILL_TIME, 's that the camera stands still before an image may be a view', low=0.0,
        high=60.0, changeable=True)
    max_pose_gap: float = parameter(
        0.1, 's from an image to a pose that is interpolated', low=0.0, high=10.0,
        changeable=True)
    stall_timeout: float = parameter(
        1.0, 's for which a camera may stand away from its goal before the motion is called '
        'stalled', low=0.1, high=3600.0, changeable=True)
    output_dir: str = parameter('.', 'where meshes are saved')
    mesh_format: str = parameter(
        'ply', 'the format of saved meshes', choices=MESH_FORMATS, changeable=True)
