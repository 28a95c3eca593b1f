"""A node's diagnostics: counters, values and problems, logged and published."""

from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
import math
import socket
import time

from active_recon.errors import ActiveReconError
from active_recon.nodes.runtime.rates import Durations, Rate
from active_recon.nodes.runtime.resting_timer import RestingTimer
from active_recon.nodes.runtime.run import one_line
from diagnostic_msgs.msg import DiagnosticArray
from msg_tools.diagnostics import diagnostics_to_msg, NodeStatus
from msg_tools.stamps import stamp_from_nanoseconds
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node

LOG_EVERY_S = 10.0
PUBLISH_EVERY_S = 1.0
CHANGES_WITHIN_S = 0.1
PROBLEM_FOR_S = 1.0
"""How long a problem is told that does not persist, so that slow subscribers see it."""
FORGOTTEN_S = 25.0
"""DDS knows a node that was killed for 20 s more: one started anew is not alone meanwhile."""


class Diagnostics:
    """
    Publishes a node's state on `/diagnostics`: once a second, and at once when it changes.

    Rejected messages are counted by kind. The first of a kind is logged at once, further ones
    every `LOG_EVERY_S` seconds, with the number of those that were not logged.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        self.forget_counts()
        self.reset()
        self._failure = ''
        self._host = socket.gethostname()
        self._alone_at = time.monotonic()
        self._publisher = node.create_publisher(DiagnosticArray, '/diagnostics', 10)
        # A steady clock: diagnostics are published while simulation time is paused, too.
        node.create_timer(PUBLISH_EVERY_S, self._publish_regularly,
                          clock=Clock(clock_type=ClockType.STEADY_TIME))
        self._changed = True
        self._changes = RestingTimer(node, CHANGES_WITHIN_S, self._publish, lambda: self._changed)

    def count(self, what: str, by: int = 1) -> None:
        """Increase a counter, for example that of views."""
        self._counts[what] += by
        if what in self._rates:
            self._rates[what].add(time.monotonic())

    def measure_rates(self, *counters: str) -> None:
        """Publish the rates per second of these counters, too."""
        self._rates |= {name: Rate(time.monotonic()) for name in counters}

    def forget_counts(self) -> None:
        """Let all counters begin at 0."""
        self._counts: Counter[str] = Counter()

    def reset(self) -> None:
        """Forget values, rates, latencies and warnings; the counters and an error stay."""
        self._values: dict[str, str] = {}
        self._rates: dict[str, Rate] = {}
        self._latency = Durations()
        self._warnings: dict[str, str] = {}
        self._logged_warnings: set[str] = set()
        self._problems: dict[str, tuple[str, float]] = {}  # by key: the last message, and when
        self._unlogged: Counter[str] = Counter()
        self._logged_at: dict[str, float] = {}

    def record_latency(self, stamp: int) -> None:
        """Record the latency of a message just published, from its stamp in nanoseconds to now."""
        self._latency.add((self._node.get_clock().now().nanoseconds - stamp) / 1e9)

    def set_value(self, key: str, value: str, at_once: bool = True) -> None:
        """Set a value of the node's state; its key begins with a capital letter."""
        before = self._values.get(key)
        self._values[key] = value
        if at_once and before != value:
            self._note_change()

    def drop_value(self, key: str) -> None:
        """Drop a value of the node's state that holds no longer, if there is one."""
        self._values.pop(key, None)

    def reject(self, error: ActiveReconError, log_each: bool = False) -> None:
        """
        Count a rejected input by the error's kind and log the reason in one line.

        `log_each` is for what a person asks for, and never comes in a flood.
        """
        if log_each:
            self._logged_at.pop(f'refused/{error.kind}', None)
        self._record(f'refused/{error.kind}', f'refused: {one_line(error)}')

    def warn(self, kind: str, message: str) -> None:
        """Count an input that was used although it may do harm, and log the reason."""
        self._record(f'warned/{kind}', message)

    def raise_warning(self, kind: str, message: str) -> None:
        """
        Raise a warning that stays until `clear_warning`; it is counted and logged once.

        To be called repeatedly while the condition holds. One that comes and goes is logged,
        with its end, at most every `LOG_EVERY_S` seconds.
        """
        if kind not in self._logged_warnings and self._log(f'warned/{kind}', message):
            self._logged_warnings.add(kind)
        is_new = kind not in self._warnings
        self._warnings[kind] = message
        if is_new:
            self._notice(f'warned/{kind}', message)

    def clear_warning(self, kind: str, log: bool = True) -> None:
        """Clear a warning, and log that it is over if it was logged and `log`."""
        message = self._warnings.pop(kind, None)
        if message is None:
            return
        self._note_change()
        if kind in self._logged_warnings:
            self._logged_warnings.discard(kind)
            if log:  # what was to be done about it is no longer of interest
                self._node.get_logger().info(f'over: {message.partition("; ")[0]}')
        else:
            self._unlogged[f'warned/{kind}'] += 1

    def raise_error(self, kind: str, message: str) -> None:
        """Log an error, the node's state until `clear_error`."""
        self._node.get_logger().error(message)
        self._counts[f'refused/{kind}'] += 1
        self._failure = message
        self._note_change()

    def clear_error(self) -> None:
        """Clear the error: the node works again."""
        if self._failure:
            self._failure = ''
            self._note_change()

    @contextmanager
    def rejecting(self) -> Iterator[None]:
        """Reject the input on which the block raises ActiveReconError, and go on."""
        try:
            yield
        except ActiveReconError as error:
            self.reject(error)

    def _record(self, key: str, message: str) -> None:
        if not self._log(key, message):  # first: who hears of it looks into the log
            self._unlogged[key] += 1
        self._notice(key, message)

    def _notice(self, key: str, message: str) -> None:
        self._counts[key] += 1
        self._problems[key] = message, time.monotonic()
        self._note_change()

    def _log(self, key: str, message: str) -> bool:
        """Log a message unless one of its kind was just logged; return whether it was logged."""
        now = time.monotonic()
        if now - self._logged_at.get(key, -LOG_EVERY_S) < LOG_EVERY_S:
            return False
        unlogged = self._unlogged.pop(key, 0)
        more = f' (and {unlogged} more of this kind before)' if unlogged else ''
        self._logged_at[key] = now
        self._node.get_logger().warning(f'{message}{more}')
        return True

    def _note_change(self) -> None:
        """Publish what has changed soon, together with what else changes until then."""
        self._changed = True
        self._changes.wake()

    def _publish_regularly(self) -> None:
        self._check_name()
        self._publish()

    def _check_name(self) -> None:
        """Warn while another node has this node's name, as one that was left running."""
        own = self._node.get_fully_qualified_name()
        if self._node.get_fully_qualified_node_names().count(own) < 2:
            self._alone_at = time.monotonic()
            self.clear_warning('same_name')
        elif time.monotonic() - self._alone_at > FORGOTTEN_S:
            self.raise_warning('same_name', (
                f'{own}: another node has the same name: expected one, since both answer what is '
                'meant for one of them; stop the other, or start this one in a namespace'))

    def _publish(self) -> None:
        status = self._status(time.monotonic())
        self._publisher.publish(diagnostics_to_msg(
            status, stamp_from_nanoseconds(self._node.get_clock().now().nanoseconds)))
        self._changed = False

    def _status(self, now: float) -> NodeStatus:
        values = dict(self._values)
        for what, rate in self._rates.items():
            values[f'{what.capitalize()} per second'] = f'{rate.per_second(now):.2f}'
        for percent in (50, 99):
            latency = self._latency.percentile(percent)
            if not math.isnan(latency):
                values[f'Latency p{percent} (ms)'] = f'{1e3 * latency:.1f}'
        self._problems = {key: (message, at) for key, (message, at) in self._problems.items()
                          if now - at <= PROBLEM_FOR_S}
        # What still holds stands among the warnings, perhaps in newer words
        problems = dict.fromkeys([*self._warnings.values(), *(
            message for key, (message, _) in self._problems.items()
            if key.removeprefix('warned/') not in self._warnings)])
        return NodeStatus(self._node.get_fully_qualified_name(), self._counts, values,
                          '; '.join(problems), self._failure, self._host)
