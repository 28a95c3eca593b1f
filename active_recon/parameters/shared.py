"""Parameters that several nodes have, and that mean the same in each."""

from dataclasses import dataclass
import math

from active_recon.geometry.cameras import OBJECT_FRAME
from active_recon.parameters.declaration import parameter


@dataclass(frozen=True)
class ManagedSettings:
    """Of a life-cycle node."""

    autostart: bool = parameter(
        True, 'whether the node configures and activates itself; else it waits to be told')


@dataclass(frozen=True)
class NetworkSettings:
    """Of a node that runs a network."""

    weights: str = parameter(
        '', 'a weights file, or a model whose weights ship; empty for those of the default')
    threads: int = parameter(1, 'CPU threads of the network', low=1, high=256)


@dataclass(frozen=True)
class CubeSettings:
    """Of a node that knows the cube in which the object stands."""

    object_size: float = parameter(1.0, 'side of the voxel grid, m', low=0.001, high=1000.0)
    object_frame: str = parameter(
        OBJECT_FRAME, 'the frame of the object, in which poses count')


@dataclass(frozen=True)
class FrontSettings:
    """Of a node that knows where the object's front stands."""

    object_yaw: float = parameter(
        0.0, "azimuth of the object's front, rad", low=-2 * math.pi, high=2 * math.pi)
