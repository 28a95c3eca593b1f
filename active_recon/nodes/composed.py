"""Nodes that can share a process, by their names, in one process and one executor."""

from collections.abc import Callable, Sequence
from functools import partial
from importlib import import_module
import sys

from active_recon.errors import ConfigError
from active_recon.nodes.runtime.composable import COMPOSABLE
from active_recon.nodes.runtime.life_cycle import managed, ManagedNode
from active_recon.nodes.runtime.run import run_nodes
from active_recon.nodes.runtime.usage import is_help_wanted
from rclpy.node import Node
from rclpy.utilities import remove_ros_args


def main(args: list[str] | None = None) -> None:
    """Run the composable nodes that the arguments name until asked to stop."""
    given = sys.argv[1:] if args is None else args
    if is_help_wanted(given):
        sys.stdout.write(f'usage: composed NODE [NODE ...] [--ros-args ...]\n\n{__doc__}\n\n'
                         f'nodes: {", ".join(COMPOSABLE)}\n')
        return
    run_nodes(lambda: _makers(remove_ros_args(given)), args)


def _makers(names: Sequence[str]) -> list[Callable[[], Node]]:
    """Return what makes each of some nodes; raises ConfigError on others or on none."""
    if not names or len(set(names)) < len(names) or not set(names) <= COMPOSABLE.keys():
        raise ConfigError(f'which nodes: expected names out of {", ".join(COMPOSABLE)}, each '
                          f'once, got {", ".join(names) or "none"}')
    return [partial(_made, name) for name in names]


def _made(name: str) -> Node:
    """Return a node, started as in a process of its own."""
    kind = getattr(import_module(f'active_recon.nodes.{name}'), COMPOSABLE[name])
    made: Node = managed(kind)() if issubclass(kind, ManagedNode) else kind()
    return made


if __name__ == '__main__':
    main()
