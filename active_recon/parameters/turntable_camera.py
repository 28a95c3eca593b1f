"""The parameters of the simulated turntable."""

from dataclasses import dataclass
import math

from active_recon.errors import ConfigError
from active_recon.parameters.declaration import parameter
from active_recon.parameters.shared import CubeParameters


@dataclass(frozen=True)
class TurntableCameraParameters(CubeParameters):
    """Parameters of the simulated turntable; ConfigError where its object is ambiguous."""

    mesh: str = parameter(
        '', 'mesh to show: the name of a model that ships, or a mesh file', path=True)
    dataset: str = parameter(
        '', 'folder of rendered objects to show instead of a mesh', path=True)
    up: str = parameter('', 'up axis of the mesh file; empty for that of its format')
    front: str = parameter('', 'front axis of the mesh file; empty for that of its format')
    background: float = parameter(255.0, 'gray value of the background', low=0.0, high=255.0)
    start_azimuth: float = parameter(
        0.0, 'azimuth of the camera at the start, rad', low=-2 * math.pi, high=2 * math.pi)
    follows: str = parameter(
        'azimuth', 'goals that the camera goes to: those on next_azimuth by turning, or those on '
        'next_view, up and down too', choices=('azimuth', 'view'))
    speed: float = parameter(
        1.0, 'speed of the turntable, and of the camera up and down, rad/s', low=0.001,
        high=100.0, dynamic=True)
    time_scale: float = parameter(
        1.0, 'how many times faster than the clock it turns', low=0.001, high=1000.0, dynamic=True)
    rate: float = parameter(10.0, 'image rate, Hz', low=0.1, high=1000.0, dynamic=True)
    camera_frame: str = parameter('camera_optical_frame', 'frame of the images', needed=True)
    faults: tuple[str, ...] = parameter(
        (), "simulated faults, each as NAME:AMOUNT in quotes, such as ['drop_images:0.3']",
        dynamic=True)
    faults_seed: int = parameter(
        0, 'seed of random faults', low=0, high=2**32 - 1)

    def __post_init__(self) -> None:
        """Reject contradictory parameters."""
        if bool(self.mesh) == bool(self.dataset):
            raise ConfigError(f'parameters mesh, dataset: {"both" if self.mesh else "neither"} '
                              'given: expected one of them')
