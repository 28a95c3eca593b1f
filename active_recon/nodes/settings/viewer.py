"""The parameters of the viewer."""

from dataclasses import dataclass
import math

from active_recon.nodes.parameters import parameter
from active_recon.viewer.address import DEFAULT_PORT, HIGHEST_PORT


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
