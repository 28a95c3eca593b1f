"""Start, spin and stop a node: shared by every executable."""

from collections.abc import Callable
import faulthandler
from itertools import pairwise
from pathlib import Path
import signal
import sys

from active_recon.errors import ActiveReconError, ConfigError
from active_recon.nodes.runtime.shared_memory import make_room
from active_recon.nodes.runtime.usage import is_help_wanted, usage
from active_recon.parameters.params_file import check_yaml
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.logging import get_logger
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

_STOP_CHECK_S = 0.1
_CLOSE_TIMEOUT_S = 15.0


def run_node(make_node: Callable[[], Node], args: list[str] | None = None) -> None:
    """
    Spin the node until the process is asked to stop, by SIGINT or SIGTERM.

    Where a node cannot start (a parameter out of range, a missing weights file) the process logs
    the reason in one line and exits with code 1, as it does where a node does not close in time.
    With `--help` the executable prints what the node does and its parameters, and no node starts.
    """
    if is_help_wanted(sys.argv[1:] if args is None else args):
        program = Path(sys.argv[0])
        name = program.parent.name if program.stem == '__main__' else program.stem
        sys.stdout.write(usage(name) + '\n')
        return
    # rclpy's own handlers shut its context down at any time: while a node starts or closes its
    # files that ends in a traceback, or the signal is lost.
    stop_requests: list[int] = []
    for request in (signal.SIGINT, signal.SIGTERM):
        signal.signal(request, lambda number, _frame: stop_requests.append(number))
    make_room()
    node = None
    try:
        _init(args)
        node = make_node()
        executor = SingleThreadedExecutor()
        executor.add_node(node)
        while not stop_requests:
            executor.spin_once(timeout_sec=_STOP_CHECK_S)
    except ActiveReconError as error:
        get_logger('active_recon').fatal(one_line(error))
        raise SystemExit(1) from None
    finally:
        # A middleware that does not shut down must not block the process for ever: after the
        # timeout it prints the stack of each thread and exits with code 1.
        faulthandler.dump_traceback_later(_CLOSE_TIMEOUT_S, exit=True)
        if node is not None:
            node.destroy_node()
        rclpy.try_shutdown()


def _init(args: list[str] | None) -> None:
    """Parse the arguments; ConfigError where ROS cannot, as on a params file that is no YAML."""
    given = sys.argv[1:] if args is None else args
    for option, file in pairwise(given):
        if option == '--params-file':
            check_yaml(Path(file))
    try:
        rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    except RuntimeError as error:
        raise ConfigError(f'cannot start: {error}') from error


def one_line(error: Exception) -> str:
    """Return the error's text without line breaks, for a log line."""
    return ' '.join(str(error).split())
