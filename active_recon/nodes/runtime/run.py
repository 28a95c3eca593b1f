"""Start, spin and stop a node: the part every executable shares."""

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

_NOTICED_WITHIN_S = 0.1
_CLOSED_WITHIN_S = 15.0


def run_node(make_node: Callable[[], Node], args: list[str] | None = None) -> None:
    """
    Spin the node until the process is asked to stop, by SIGINT or SIGTERM.

    A node that cannot start (a parameter out of range, a weights file that is missing) says why
    in one line and the process exits with code 1, as does one that cannot be closed in time.
    With `--help` the executable says what the node does, and no node is made.
    """
    if is_help_wanted(sys.argv[1:] if args is None else args):
        sys.stdout.write(usage(Path(sys.argv[0]).stem) + '\n')
        return
    # rclpy's own handlers tear its context down wherever the signal finds it, which while a node
    # starts or closes its files ends in a traceback, or is not heard at all.
    asked_to_stop: list[int] = []
    for request in (signal.SIGINT, signal.SIGTERM):
        signal.signal(request, lambda number, _frame: asked_to_stop.append(number))
    make_room()
    node = None
    try:
        _init(args)
        node = make_node()
        executor = SingleThreadedExecutor()
        executor.add_node(node)
        while not asked_to_stop:
            executor.spin_once(timeout_sec=_NOTICED_WITHIN_S)
    except ActiveReconError as error:
        get_logger('active_recon').fatal(one_line(error))
        raise SystemExit(1) from None
    finally:
        # Whoever supervises the node must not wait for ever for a middleware that does not let
        # go: after that time the process says where each thread stands, and ends with code 1.
        faulthandler.dump_traceback_later(_CLOSED_WITHIN_S, exit=True)
        if node is not None:
            node.destroy_node()
        rclpy.try_shutdown()


def _init(args: list[str] | None) -> None:
    """Read the arguments; ConfigError where ROS cannot, as a parameters file that is no YAML."""
    given = sys.argv[1:] if args is None else args
    for option, file in pairwise(given):
        if option == '--params-file':
            check_yaml(Path(file))
    try:
        rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    except RuntimeError as error:
        raise ConfigError(f'cannot start: {error}') from error


def one_line(error: Exception) -> str:
    """Return the error's text without line breaks, as a log line needs it."""
    return ' '.join(str(error).split())
