"""Parameters that several nodes share, with the same meaning."""

from dataclasses import dataclass
import math

from active_recon.geometry.cameras import OBJECT_FRAME
from active_recon.parameters.declaration import parameter
from active_recon.runtimes import AUTO, PRECISIONS, RUNTIME_CHOICES


@dataclass(frozen=True)
class ManagedParameters:
    """Parameters of a lifecycle node."""

    autostart: bool = parameter(
        True, 'whether the node configures and activates itself')
    activate_at_start: bool = parameter(
        True, 'whether autostart activates the node, too; false: configured, with its network in '
        'memory, it waits to be activated')


@dataclass(frozen=True)
class NetworkParameters:
    """Parameters of a node that runs a network."""

    weights: str = parameter(
        '', 'weights file, or a model whose weights ship; empty for the default model',
        path=True)
    threads: int = parameter(2, 'number of CPU threads of the network', low=1, high=256)
    runtime: str = parameter(
        AUTO, 'library that runs the network; auto is openvino where its weights are exported, '
        'else torch', choices=RUNTIME_CHOICES)
    precision: str = parameter(
        'auto', 'numbers that the network computes with; auto is bf16 where the processor has it, '
        'else f32; int8 is the fastest',
        choices=PRECISIONS)


@dataclass(frozen=True)
class CubeParameters:
    """Parameters of a node that uses the voxel grid."""

    object_size: float = parameter(1.0, 'side of the voxel grid, m', low=0.001, high=1000.0)
    object_frame: str = parameter(
        OBJECT_FRAME, 'frame of the object, in which poses are given', needed=True)


@dataclass(frozen=True)
class FrontParameters:
    """Parameters of a node that uses the object's front."""

    object_yaw: float = parameter(
        0.0, "azimuth of the object's front, rad", low=-2 * math.pi, high=2 * math.pi)
