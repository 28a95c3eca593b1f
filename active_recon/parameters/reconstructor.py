"""The parameters of the reconstructor."""

from dataclasses import dataclass
import math

from active_recon.acquisition.stillness import STILL_TIME
from active_recon.acquisition.view_gate import GOAL_TOLERANCE, TAKE_VIEWS
from active_recon.meshes.files import MESH_FORMATS
from active_recon.parameters.background import BackgroundParameters
from active_recon.parameters.camera_pose import CameraPoseParameters
from active_recon.parameters.declaration import parameter
from active_recon.parameters.shared import (
    CubeParameters,
    FrontParameters,
    ManagedParameters,
    NetworkParameters,
)


@dataclass(frozen=True)
class ReconstructorParameters(BackgroundParameters, CameraPoseParameters, FrontParameters,
                              CubeParameters, NetworkParameters, ManagedParameters):
    """Parameters of the reconstructor."""

    device: str = parameter('cpu', 'device of the network', choices=('cpu', 'cuda'))
    threshold: float = parameter(
        math.nan, 'probability above which a cell is occupied; nan for that of the weights',
        low=0.01, high=0.99, dynamic=True)
    take_views: str = parameter(
        'auto', 'which images become views', choices=TAKE_VIEWS, dynamic=True)
    goal_tolerance: float = parameter(
        GOAL_TOLERANCE, 'largest distance of a view from its goal, rad', low=0.0, high=math.pi,
        dynamic=True)
    min_view_separation: float = parameter(
        0.2, 'smallest distance between views without goals, rad', low=0.0, high=math.pi,
        dynamic=True)
    settle_time: float = parameter(
        STILL_TIME, 'time that the camera rests before an image can be a view, s', low=0.0,
        high=60.0, dynamic=True)
    max_pose_gap: float = parameter(
        0.1, 'largest time from an image to the poses it is interpolated from, s', low=0.0,
        high=10.0, dynamic=True)
    use_depth: bool = parameter(
        False, 'whether views take in what camera/depth/image_raw measures')
    max_depth_gap: float = parameter(
        0.02, 'largest time between an image and its depth image, s', low=0.0, high=1.0)
    stall_timeout: float = parameter(
        1.0, 'time that the camera may rest away from its goal before a warning that it has '
        'stalled, s', low=0.1, high=3600.0, dynamic=True)
    output_dir: str = parameter(
        '.', 'folder of saved meshes and states', dynamic=True, path=True)
    mesh_format: str = parameter(
        'ply', 'format of saved meshes', choices=MESH_FORMATS, dynamic=True)
    publish_mesh: bool = parameter(
        False, 'whether the coloured surface is published as a Marker, at most once a second')
    state_file: str = parameter(
        '', 'file that load_state goes on from, relative to output_dir', dynamic=True, path=True)
