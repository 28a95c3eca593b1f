"""Processes of nodes: programs, and forks of a process that has imported what all nodes import."""

from collections.abc import Sequence
import inspect
import multiprocessing
import os
from pathlib import Path
import subprocess
import sys

from active_recon.launching.forked import ForkedNode, run_as_program
import pytest

ROOT = Path(__file__).parents[2]
_NODES = ('reconstructor', 'view_planner', 'turntable_camera', 'camera', 'recorder', 'player')
_FORKS = multiprocessing.get_context('forkserver')
# What reconstructors import with their weights, and rclpy with the first message
_LATER = ('active_recon.runtimes.torch', 'active_recon.runtimes.openvino', 'openvino',
          'rosidl_generator_py')
_FORKS.set_forkserver_preload([*(f'active_recon.nodes.{name}' for name in _NODES), *_LATER,
                               __name__])
# The first line that a process logs looks for its module among all: here once, not in each fork
inspect.getmodule(inspect.currentframe())


class Started:
    """A command that runs in a folder; its output goes to a log."""

    def __init__(self, command: Sequence[str], folder: Path, log: Path) -> None:
        with log.open('a') as out:
            self._process = subprocess.Popen(
                command, cwd=folder, stdout=out, stderr=subprocess.STDOUT,
                env=_environment())

    @property
    def pid(self) -> int:
        return self._process.pid

    def wait(self, timeout_s: float) -> int | None:
        """Return the exit code, None if it still runs after that time."""
        try:
            return self._process.wait(timeout_s)
        except subprocess.TimeoutExpired:
            return None


class Forked(ForkedNode):
    """
    A node as `python -m active_recon.nodes.NAME` would run it, with all imports done before.

    These take more computing than most tests: a second for each node, two for a reconstructor.
    """

    def __init__(self, name: str, options: Sequence[str], folder: Path, log: Path) -> None:
        with pytest.MonkeyPatch.context() as patch:  # for the process that is forked
            patch.setenv('PYTHONPATH', f'{ROOT}{os.pathsep}{ROOT / "test"}')
            super().__init__(_FORKS.Process(target=_run, daemon=True, args=(
                name, options, folder, log, _environment())))


def _environment() -> dict[str, str]:
    return {**os.environ, 'PYTHONPATH': str(ROOT)}


def _run(name: str, options: Sequence[str], folder: Path, log: Path,
         environment: dict[str, str]) -> None:
    os.chdir(folder)
    sys.path.insert(0, str(folder))  # as `python -m` has it
    run_as_program(name, options, environment, log)
