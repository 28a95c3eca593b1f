"""Nodes as processes of their own, started and stopped together."""

from collections.abc import Mapping, Sequence
from contextlib import ExitStack, suppress
import json
import os
from pathlib import Path
import random
import signal
import socket
import subprocess
import sys
import time
from types import TracebackType

from active_recon.errors import ActiveReconError
from active_recon.launching.forked import forked, ForkedNode
from active_recon.nodes.runtime.shared_memory import PROFILE

_LAST_LINES = 8
_STOP_S = 5.0  # for a node to close its files
_SIGNAL_AGAIN_S = 1.0
_DOMAINS = range(41, 102)  # low numbers are for users and the tests


class NodeError(ActiveReconError):
    """A node that ended by itself, or that could not be started."""


def private_environment() -> dict[str, str]:
    """Return environment variables for a free ROS domain that is limited to this machine."""
    return {
        'ROS_DOMAIN_ID': str(_free_domain_id()),
        'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST',
        'RMW_IMPLEMENTATION': 'rmw_fastrtps_cpp',
        'FASTRTPS_DEFAULT_PROFILES_FILE': str(PROFILE),
    }


def _free_domain_id() -> int:
    """Return a domain id whose first participant's port is free."""
    for domain in random.sample(_DOMAINS, len(_DOMAINS)):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            try:
                probe.bind(('', 7410 + 250 * domain))  # the DDS standard's numbering
            except OSError:
                continue
            return domain
    raise NodeError(f'no free ROS domain: expected one from {_DOMAINS[0]} to {_DOMAINS[-1]}, but '
                    'other nodes use them all')


class NodeProcesses:
    """
    Starts nodes by their module's name, detects when one ends, and stops them, the last first.

    A node's output goes to a log in `log_folder`, or, without one, to this process's output.
    `environment` is added to this process's.
    """

    def __init__(self, log_folder: Path | None = None,
                 environment: Mapping[str, str] | None = None) -> None:
        self._logs = log_folder
        self._environment = {**os.environ, **(environment or {}), 'PYTHONUNBUFFERED': '1'}
        if log_folder is not None:
            self._environment |= {
                'ROS_LOG_DIR': str(log_folder), 'RCUTILS_COLORIZED_OUTPUT': '0'}
        self._running: dict[str, subprocess.Popen[bytes] | ForkedNode] = {}

    def start(self, node: str, parameters: Mapping[str, object], namespace: str = '',
              arguments: Sequence[str] = (), names: Sequence[str] = ()) -> None:
        """
        Start `active_recon.nodes.<node>` with parameters and further arguments of ROS.

        `names` are its own arguments, before those of ROS: the nodes that `composed` runs.
        In a namespace, for example '/cell_1', it is known here as 'cell_1.<node>'.
        """
        words = [*arguments, *_as_words(parameters)]
        full_name = node
        if namespace:
            words += ['-r', f'__ns:={namespace}']
            full_name = f'{namespace.strip("/").replace("/", ".")}.{node}'
        with ExitStack() as opened:
            log = self._log(full_name)
            output = None if log is None else opened.enter_context(log.open('wb'))
            # In its own session it does not receive the terminal's Ctrl-C: `stop` stops it
            self._running[full_name] = subprocess.Popen(
                [sys.executable, '-m', f'active_recon.nodes.{node}', *names, '--ros-args', *words],
                stdin=subprocess.DEVNULL, stdout=output, stderr=output and subprocess.STDOUT,
                env=self._environment, start_new_session=True)

    def fork(self, node: str, parameters: Mapping[str, object]) -> None:
        """
        Start a node in a fork of this process, which spares it what is imported here.

        This process has no threads yet, of ROS or others, and a log folder.
        """
        log = self._log(node)
        assert log is not None
        self._running[node] = forked(
            node, ['--ros-args', *_as_words(parameters)], self._environment, log)

    def pid(self, node: str) -> int:
        """Return the process id of a node that was started."""
        return self._running[node].pid

    def check(self) -> None:
        """Raise NodeError, with the last lines of its log, where a node has ended."""
        for node, process in self._running.items():
            code = process.poll()
            if code is not None:
                # The kernel tells in no other way that memory ran out, as in a container
                cause = ' (killed: was there enough memory?)' if code == -signal.SIGKILL else ''
                raise self.failure(node, f'ended with code {code}{cause}')

    def failure(self, node: str, what: str) -> NodeError:
        """Return the error that a node did `what`, with the last lines of its log."""
        log = self._log(node)
        if log is None:
            return NodeError(f'{node} {what}')
        lines = log.read_text(errors='replace').splitlines()[-_LAST_LINES:]
        log_lines = '\n  '.join(lines) or '(its log is empty)'
        return NodeError(f'{node} {what}. The end of its log:\n  {log_lines}')

    def stop(self) -> None:
        """Ask the nodes to stop, the last started first, and wait; kill those that do not end."""
        deadline = time.monotonic() + _STOP_S
        while alive := [process for process in reversed(self._running.values())
                        if process.poll() is None]:
            late = time.monotonic() > deadline
            for process in alive:
                # Not SIGINT: an import that it strikes ends in a traceback, or swallows it
                process.send_signal(signal.SIGKILL if late else signal.SIGTERM)
            with suppress(subprocess.TimeoutExpired):
                alive[-1].wait(_SIGNAL_AGAIN_S)
        self._running.clear()

    def _log(self, node: str) -> Path | None:
        return self._logs and self._logs / f'{node}.txt'

    def __enter__(self) -> 'NodeProcesses':
        """Stop the nodes where the block ends, however it ends."""
        return self

    def __exit__(self, kind: type[BaseException] | None, value: BaseException | None,
                 trace: TracebackType | None) -> None:
        """Stop the nodes."""
        self.stop()


def _as_words(parameters: Mapping[str, object]) -> list[str]:
    """Return parameters as ROS takes them on a command line."""
    return [word for name, value in parameters.items()
            for word in ('-p', f'{name}:={_as_yaml(value)}')]


def _as_yaml(value: object) -> str:
    """Return a parameter's value as the command line takes it."""
    if isinstance(value, bool):
        return str(value).lower()
    return (json.dumps(str(value), ensure_ascii=False) if isinstance(value, str | Path)
            else str(value))
