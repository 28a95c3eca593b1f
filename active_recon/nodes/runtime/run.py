"""Start, spin and stop a node: shared by every executable."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
import faulthandler
from itertools import pairwise
from pathlib import Path
import signal
import socket
import sys
import threading

from active_recon.errors import ActiveReconError, ConfigError
from active_recon.interrupts import stop_signals
from active_recon.nodes.runtime.shared_memory import make_room
from active_recon.nodes.runtime.usage import is_help_wanted, usage
from active_recon.parameters.yaml_files import read_yaml
from active_recon.whole_files import writable_folder
import rclpy
from rclpy.executors import Executor, SingleThreadedExecutor
from rclpy.logging import get_logger, get_logging_directory
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import remove_ros_args

_CLOSE_TIMEOUT_S = 15.0
_NO_LOG_FILE = '--disable-external-lib-logs'  # of ROS


def run_node(make_node: Callable[[], Node], args: list[str] | None = None) -> None:
    """
    Spin the node until the process is asked to stop, by one of the `stop_signals`.

    Where a node cannot start (a parameter out of range, a missing weights file) the process logs
    the reason in one line and exits with code 1, as it does where a node does not close in time.
    With `--help` the executable prints what the node does and its parameters, and no node starts.
    """
    if is_help_wanted(sys.argv[1:] if args is None else args):
        program = Path(sys.argv[0])
        name = program.parent.name if program.stem == '__main__' else program.stem
        sys.stdout.write(usage(name) + '\n')
        return
    run_nodes(lambda: _alone(make_node, args), args)


def _alone(make_node: Callable[[], Node], args: list[str] | None) -> list[Callable[[], Node]]:
    """Return what makes the one node of an executable, which has no arguments but ROS's."""
    unknown = remove_ros_args(sys.argv[1:] if args is None else args)
    if unknown:
        raise ConfigError(f'unknown arguments: expected --ros-args before all others, as in '
                          f'--ros-args -p NAME:=VALUE, got {" ".join(unknown)}')
    return [make_node]


def run_nodes(makers: Callable[[], Iterable[Callable[[], Node]]],
              args: list[str] | None = None) -> None:
    """Spin the nodes that `makers` returns functions to make, all in one executor; as above."""
    stop = StopRequests()
    make_room()
    nodes: list[Node] = []
    try:
        _init(args)
        executor = SingleThreadedExecutor()
        for make_node in makers():
            nodes.append(make_node())
            executor.add_node(nodes[-1])
        with stop.waking(executor):
            while not stop.requested:
                executor.spin_once()
    except ActiveReconError as error:
        get_logger('active_recon').fatal(one_line(error))
        raise SystemExit(1) from None
    finally:
        # A middleware that does not shut down must not block the process for ever: after the
        # timeout it prints the stack of each thread and exits with code 1.
        faulthandler.dump_traceback_later(_CLOSE_TIMEOUT_S, exit=True)
        for node in reversed(nodes):
            node.destroy_node()
        rclpy.try_shutdown()


class StopRequests:
    """
    Notes the `stop_signals` from now on; `requested` is whether one came.

    rclpy's own handlers shut its context down at any time: while a node starts or closes its
    files that ends in a traceback, or the signal is lost.
    """

    def __init__(self) -> None:
        self.requested = False
        for request in stop_signals():
            signal.signal(request, self._note)

    @contextmanager
    def waking(self, executor: Executor) -> Iterator[None]:
        """
        Let each request end the executor's wait, while the body runs.

        Python handles a signal only between its own instructions, so a thread waits for its byte:
        an executor that looked several times a second would use more than all else when idle.
        """
        received, written = socket.socketpair()
        written.setblocking(False)
        signal.set_wakeup_fd(written.fileno(), warn_on_full_buffer=False)

        def wake_at_each() -> None:
            with received:
                while received.recv(1):
                    executor.create_task(lambda: None)  # a wait ends for work only

        thread = threading.Thread(target=wake_at_each, daemon=True)
        thread.start()
        try:
            yield
        finally:
            signal.set_wakeup_fd(-1)
            written.close()
            thread.join()

    def _note(self, _number: int, _frame: object) -> None:
        self.requested = True


def _init(args: list[str] | None) -> None:
    """
    Parse the arguments, and begin the log.

    Raises ConfigError where ROS cannot, as on a params file that is no YAML, or for a user
    without a home.
    """
    given = sys.argv[1:] if args is None else args
    for file in params_files(given):
        read_yaml(file)
    if _NO_LOG_FILE not in given:
        _check_log_folder()
    try:
        rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    except RuntimeError as error:
        raise ConfigError(f'cannot start: {error}') from error


def _check_log_folder() -> None:
    """Raise ConfigError where ROS cannot write its log: its own errors name no remedy."""
    try:
        folder = get_logging_directory()
    except RuntimeError as error:
        raise ConfigError("ROS's log: no folder: expected HOME or ROS_LOG_DIR to name one, got "
                          'neither') from error
    try:
        writable_folder(folder)
    except ConfigError as error:
        raise ConfigError(f"ROS's log: {error}; set ROS_LOG_DIR to another folder") from error


def params_files(args: Sequence[str]) -> list[Path]:
    """Return the parameters files that arguments name."""
    return [Path(file) for option, file in pairwise(args) if option == '--params-file']


def one_line(error: Exception) -> str:
    """Return the error's text without line breaks, for a log line."""
    return ' '.join(str(error).split())
