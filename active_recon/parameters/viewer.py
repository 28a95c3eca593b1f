"""The parameters of the viewer."""

from dataclasses import dataclass
import math

from active_recon.parameters.declaration import parameter

DEFAULT_PORT = 8080
HIGHEST_PORT = 65000  # with room for the next free one


@dataclass(frozen=True)
class ViewerParameters:
    """Parameters of the viewer."""

    object_size: float = parameter(
        math.nan, 'side of the voxel grid, m; nan for that of the loop', low=0.001, high=1000.0)
    object_frame: str = parameter(
        '', 'frame of the object, in which poses are given; empty for that of the loop')
    port: int = parameter(
        DEFAULT_PORT, 'port of the page, or the next free one; 0 for any',
        low=0, high=HIGHEST_PORT)
