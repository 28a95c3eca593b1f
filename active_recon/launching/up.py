"""The nodes of a parameters file, started and stopped together, where launch is missing."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
import time

from active_recon.interrupts import held_interrupts
from active_recon.launching.processes import NodeProcesses
from active_recon.parameters.params_file import read_params_file

_LOOK_EVERY_S = 0.1


@dataclass(frozen=True)
class Start:
    """
    What to start: a file that names the nodes, and what holds for all of them.

    `remaps` are of the form `from:=to`.
    """

    params_file: Path
    namespace: str = ''
    remaps: Sequence[str] = ()
    log_level: str = 'info'

    def arguments(self) -> list[str]:
        """Return what every node is told on its command line."""
        return ['--params-file', str(self.params_file.absolute()), '--log-level', self.log_level,
                *(word for rule in self.remaps for word in ('-r', rule))]


def run_up(start: Start, say: Callable[[str], None]) -> None:
    """
    Start the nodes and wait for Ctrl-C; however it ends, they are stopped.

    Raises ConfigError on a file that cannot be used, NodeError where a node ends by itself.
    """
    namespace = f'/{start.namespace.strip("/")}' if start.namespace else ''
    names = list(read_params_file(start.params_file))
    say(f'starting {", ".join(names)}; Ctrl-C stops them')
    with (suppress(KeyboardInterrupt), held_interrupts() as raise_if_asked,
          NodeProcesses() as nodes):
        for name in names:
            nodes.start(name, {}, namespace, start.arguments())
        while True:
            raise_if_asked()
            nodes.check()
            time.sleep(_LOOK_EVERY_S)
    say('the nodes are stopped')
