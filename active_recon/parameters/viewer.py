"""The parameters of the viewer."""

from dataclasses import dataclass
import math

from active_recon.parameters.declaration import parameter

DEFAULT_PORT = 8080
HIGHEST_PORT = 65000  # with room for the next free one


@dataclass(frozen=True)
class ViewerSettings:
    """What the viewer is told."""

    object_size: float = parameter(
        math.nan, 'side of the voxel grid, m; nan for what the loop says', low=0.001, high=1000.0)
    object_frame: str = parameter(
        '', 'the frame of the object, in which poses count; empty for what the loop says')
    port: int = parameter(
        DEFAULT_PORT, 'where the page is served, if it is free; 0 for any that is',
        low=0, high=HIGHEST_PORT)
