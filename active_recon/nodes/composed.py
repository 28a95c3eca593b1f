"""The nodes of a parameters file that can share a process, in one process and one executor."""

from collections.abc import Callable
from functools import partial
from importlib import import_module
from itertools import pairwise
from pathlib import Path
import sys

from active_recon.errors import ConfigError
from active_recon.nodes.runtime.life_cycle import managed, ManagedNode
from active_recon.nodes.runtime.run import run_nodes
from active_recon.parameters.params_file import read_params_file
from rclpy.node import Node

COMPOSABLE = {'reconstructor': 'ReconstructorNode', 'view_planner': 'ViewPlannerNode',
              'turntable_camera': 'TurntableCameraNode'}
"""
The class of each node that may share a process with others.

The recorder, the player and the viewer may not: they would wait for the network, or it for them.
"""


def main(args: list[str] | None = None) -> None:
    """Run the composable nodes of the file after `--params-file` until asked to stop."""
    given = sys.argv[1:] if args is None else args

    def makers() -> list[Callable[[], Node]]:
        files = [Path(file) for option, file in pairwise(given) if option == '--params-file']
        if len(files) != 1:
            raise ConfigError('which nodes: expected one --params-file that names them, got '
                              f'{len(files)}')
        return [partial(_made, name) for name in read_params_file(files[0]) if name in COMPOSABLE]

    run_nodes(makers, args)


def _made(name: str) -> Node:
    """Return a node, started as in a process of its own."""
    kind = getattr(import_module(f'active_recon.nodes.{name}'), COMPOSABLE[name])
    made: Node = managed(kind)() if issubclass(kind, ManagedNode) else kind()
    return made


if __name__ == '__main__':
    main()
