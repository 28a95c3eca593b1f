"""The parameters of the simulated turntable."""

from dataclasses import dataclass
import math

from active_recon.errors import ConfigError
from active_recon.parameters.declaration import parameter
from active_recon.parameters.shared import CubeSettings


@dataclass(frozen=True)
class TurntableCameraSettings(CubeSettings):
    """What the simulated turntable is told; ConfigError where its object is not clear."""

    mesh: str = parameter('', 'what to show: the name of a model that ships, or a mesh file')
    dataset: str = parameter('', 'a folder of rendered objects to show, instead of a mesh')
    up: str = parameter('', "the mesh file's axis that is up; empty for its format's")
    front: str = parameter('', "the mesh file's axis of the front; empty for its format's")
    background: float = parameter(255.0, 'grey behind the object', low=0.0, high=255.0)
    start_azimuth: float = parameter(
        0.0, 'of the camera at start, rad', low=-2 * math.pi, high=2 * math.pi)
    speed: float = parameter(
        1.0, 'of the turntable, rad/s', low=0.001, high=100.0, changeable=True)
    time_scale: float = parameter(
        1.0, 'how much faster than the clock it turns', low=0.001, high=1000.0, changeable=True)
    rate: float = parameter(10.0, 'of the stream, Hz', low=0.1, high=1000.0, changeable=True)
    camera_frame: str = parameter('camera_optical_frame', 'the frame of the images')
    faults: tuple[str, ...] = parameter(
        (), 'what goes wrong, each as NAME:AMOUNT, such as drop_images:0.3', changeable=True)
    faults_seed: int = parameter(
        0, 'of what goes wrong by chance', low=0, high=2**32 - 1)

    def __post_init__(self) -> None:
        """Refuse what contradicts itself."""
        if bool(self.mesh) == bool(self.dataset):
            raise ConfigError('parameters mesh, dataset: expected one of them, got '
                              f'{"both" if self.mesh else "neither"}')
