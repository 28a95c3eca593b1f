"""A node in a fork of this process, which has imported most of what the node needs."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
import gc
from importlib import import_module
import multiprocessing
from multiprocessing.process import BaseProcess
import os
from pathlib import Path
import signal
import sys

from active_recon.interrupts import stop_signals

_FORKS = multiprocessing.get_context('fork')


class ForkedNode:
    """A fork that runs a node, as `subprocess.Popen` has a program; it is started with this."""

    def __init__(self, process: BaseProcess) -> None:
        self._process = process
        self._process.start()

    @property
    def pid(self) -> int:
        """The process id."""
        pid = self._process.pid
        assert pid is not None
        return pid

    def poll(self) -> int | None:
        """Return the exit code, None while it runs."""
        return self._process.exitcode

    def send_signal(self, kind: signal.Signals) -> None:
        """Send a signal to a node that runs."""
        os.kill(self.pid, kind)

    def wait(self, timeout: float | None = None) -> int | None:
        """Return the exit code, None where it still runs after that time, in seconds."""
        self._process.join(timeout)
        return self._process.exitcode


def forked(name: str, arguments: Sequence[str], environment: Mapping[str, str],
           log: Path) -> ForkedNode:
    """
    Start a node as `python -m active_recon.nodes.NAME` would run it, with imports done before.

    `arguments` are its own and, after `--ros-args`, those of ROS; its output goes to the file
    `log`. Fork before this process has threads, of ROS or others: they are missing in the node.
    """
    log.write_bytes(b'')  # now: it is read, too, of a fork that has not begun to write
    return ForkedNode(_FORKS.Process(
        target=run_as_program, args=(name, arguments, environment, log), daemon=True))


def run_as_program(name: str, arguments: Sequence[str], environment: Mapping[str, str],
                   log: Path) -> None:
    """Run a node in a fresh fork as its program would; its output is appended to `log`."""
    for kind in stop_signals():
        signal.signal(kind, signal.SIG_DFL)
    os.setsid()  # it does not receive the terminal's Ctrl-C
    with suppress(OSError):  # what `top` shows; elsewhere than in Linux there is no such file
        Path('/proc/self/comm').write_text(name)
    gc.freeze()  # what was imported is no garbage
    with log.open('ab') as output:
        for descriptor in (1, 2):
            os.dup2(output.fileno(), descriptor)
    os.environ.clear()
    os.environ.update(environment)
    sys.argv = [f'{name}.py', *arguments]
    import rclpy.utilities  # not by who starts programs

    try:
        import_module(f'active_recon.nodes.{name}').main()
    finally:
        # A fork ends without destroying its context, and would leave its shared memory behind
        rclpy.utilities.g_default_context = None
        gc.collect()
