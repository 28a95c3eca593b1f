"""Starts and stops the nodes of a parameters file, without ros2 launch."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
import re
import time

from active_recon.errors import ConfigError
from active_recon.interrupts import held_interrupts
from active_recon.launching.processes import NodeProcesses
from active_recon.nodes.runtime.composable import COMPOSABLE
from active_recon.parameters.params_file import (
    check_reach,
    nodes_left_out,
    read_params_file,
)

_CHECK_EVERY_S = 0.1


@dataclass(frozen=True)
class Start:
    """
    The nodes to start: a parameters file that names them, and options that hold for all.

    `remaps` are of the form `from:=to`. With `single_process`, those that can share a process do.
    """

    params_file: Path
    namespace: str = ''
    remaps: Sequence[str] = ()
    log_level: str = 'info'
    single_process: bool = False

    def arguments(self) -> list[str]:
        """Return the command-line arguments of every node."""
        return ['--params-file', str(self.params_file.absolute()), '--log-level', self.log_level,
                *(word for rule in self.remaps for word in ('-r', rule))]


def run_up(start: Start, say: Callable[[str], None]) -> None:
    """
    Start the nodes and wait for Ctrl-C; they are stopped in any case.

    Raises ConfigError on an invalid file, NodeError where a node ends by itself.
    """
    namespace = f'/{start.namespace.strip("/")}'.rstrip('/')
    _check_names(namespace, start.remaps)
    names = list(read_params_file(start.params_file))
    check_reach(start.params_file, namespace)
    together = [name for name in names if name in COMPOSABLE] if start.single_process else []
    for left_out in nodes_left_out(start.params_file):
        say(f"{left_out} is not one of the package's nodes: start it yourself, with the same file "
            '(examples/ has one)')
    say(f'starting {", ".join(names)}; Ctrl-C stops them')
    with (suppress(KeyboardInterrupt), held_interrupts() as raise_if_asked,
          NodeProcesses() as nodes):
        if together:
            nodes.start('composed', {}, namespace, start.arguments(), together)
        for name in names:
            if name not in together:
                nodes.start(name, {}, namespace, start.arguments())
        while True:
            raise_if_asked()
            nodes.check()
            time.sleep(_CHECK_EVERY_S)
    say('the nodes are stopped')


def _check_names(namespace: str, remaps: Sequence[str]) -> None:
    """Raise ConfigError on what ROS takes for no namespace, and on rules that rename nodes."""
    if not re.fullmatch(r'(/[A-Za-z_]\w*)*', namespace, re.ASCII):
        raise ConfigError(f'--namespace {namespace}: no namespace of ROS: expected letters '
                          'without accents, digits and _, no digit first, and / between parts')
    for rule in remaps:
        if re.match(r'[^:]*:?__(ns|name|node):=', rule):
            raise ConfigError(f'-r {rule}: another name for nodes, which would get nothing of '
                              'their parameters: expected a topic or a service; a namespace is '
                              'given by --namespace')
