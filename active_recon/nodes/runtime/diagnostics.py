"""What a node did, refused and found wrong: counted, said in the log, told on `/diagnostics`."""

from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
import math
import socket
import time

from active_recon.errors import ActiveReconError
from active_recon.nodes.runtime.rates import Durations, Rate
from active_recon.nodes.runtime.run import one_line
from diagnostic_msgs.msg import DiagnosticArray
from msg_tools.diagnostics import diagnostics_to_msg, NodeStatus
from msg_tools.stamps import stamp_from_nanoseconds
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node

LOG_EVERY_S = 10.0
TELL_EVERY_S = 1.0
NEWS_WITHIN_S = 0.1


class Diagnostics:
    """
    The state of one node, on `/diagnostics`: once a second, and what is new at once.

    What is refused is counted by its kind. The first of a kind is logged at once, a stream of
    them once in `LOG_EVERY_S` seconds, with the number of those left unsaid.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        self._counts: Counter[str] = Counter()
        self.forget()
        self._unsaid: Counter[str] = Counter()
        self._said_at: dict[str, float] = {}
        self._last_problem = ''
        self._troubles: dict[str, str] = {}
        self._said_troubles: set[str] = set()
        self._failure = ''
        self._news = True
        self._told_at = -math.inf
        self._host = socket.gethostname()
        self._publisher = node.create_publisher(DiagnosticArray, '/diagnostics', 10)
        # By the system's clock: a clock of a simulation that stands still is worth telling too.
        node.create_timer(NEWS_WITHIN_S, self._tell_if_due,
                          clock=Clock(clock_type=ClockType.STEADY_TIME))

    def count(self, what: str, by: int = 1) -> None:
        """Count something that is no refusal, for example a view taken in."""
        self._counts[what] += by
        if what in self._rates:
            self._rates[what].add(time.monotonic())

    def measure(self, *counted: str) -> None:
        """Tell per second, too, what is counted under these names."""
        self._rates |= {name: Rate(time.monotonic()) for name in counted}

    def forget(self) -> None:
        """Forget facts, rates and latencies; what was counted stays."""
        self._facts: dict[str, str] = {}
        self._rates: dict[str, Rate] = {}
        self._latency = Durations()

    def took_since(self, stamp: int) -> None:
        """Note the latency of what was just published, from its stamp in nanoseconds to now."""
        self._latency.add((self._node.get_clock().now().nanoseconds - stamp) / 1e9)

    def tell(self, fact: str, value: str, at_once: bool = True) -> None:
        """Set a fact of the node's state, its name beginning with a capital."""
        self._news = self._news or (at_once and self._facts.get(fact) != value)
        self._facts[fact] = value

    def refuse(self, error: ActiveReconError) -> None:
        """Count what was refused and say it in one line."""
        self._say(f'refused/{error.kind}', f'refused: {one_line(error)}')

    def warn(self, kind: str, message: str) -> None:
        """Count what was used although it may do harm, and say why in one line."""
        self._say(f'warned/{kind}', message)

    def begin_trouble(self, kind: str, message: str) -> None:
        """
        Warn of a state that is wrong until `end_trouble`; count and say its beginning.

        To be called again and again while it lasts: one that comes and goes is said, with its
        end, once in `LOG_EVERY_S` seconds.
        """
        is_new = kind not in self._troubles
        self._troubles[kind] = message
        if is_new:
            self._notice(f'warned/{kind}', message)
        if kind not in self._said_troubles and self._log(f'warned/{kind}', message):
            self._said_troubles.add(kind)

    def end_trouble(self, kind: str) -> None:
        """Take back the warning of a state, and say so where its beginning was said."""
        message = self._troubles.pop(kind, None)
        if message is None:
            return
        self._news = True
        if kind in self._said_troubles:
            self._said_troubles.discard(kind)
            self._node.get_logger().info(f'over: {message}')
        else:
            self._unsaid[f'warned/{kind}'] += 1

    def fail(self, kind: str, message: str) -> None:
        """Say as an error what the node does no more; it stays the state until `recover`."""
        self._counts[f'refused/{kind}'] += 1
        self._failure = message
        self._news = True
        self._node.get_logger().error(message)

    def recover(self) -> None:
        """Take back what `fail` said: the node does it again."""
        self._news = self._news or self._failure != ''
        self._failure = ''

    @contextmanager
    def refusing(self) -> Iterator[None]:
        """Refuse what the block cannot use, and go on."""
        try:
            yield
        except ActiveReconError as error:
            self.refuse(error)

    def _say(self, key: str, message: str) -> None:
        self._notice(key, message)
        if not self._log(key, message):
            self._unsaid[key] += 1

    def _notice(self, key: str, message: str) -> None:
        self._counts[key] += 1
        self._last_problem = message
        self._news = True

    def _log(self, key: str, message: str) -> bool:
        """Say a message in the log, unless one of its kind was said only just; return whether."""
        now = time.monotonic()
        if now - self._said_at.get(key, -LOG_EVERY_S) < LOG_EVERY_S:
            return False
        unsaid = self._unsaid.pop(key, 0)
        more = f' (and {unsaid} more of this kind before)' if unsaid else ''
        self._said_at[key] = now
        self._node.get_logger().warning(f'{message}{more}')
        return True

    def _tell_if_due(self) -> None:
        """Publish what is new, and in any case once a second."""
        now = time.monotonic()
        regular = now - self._told_at >= TELL_EVERY_S
        if not regular and not self._news:
            return
        status = self._status(now)
        self._publisher.publish(diagnostics_to_msg(
            status, stamp_from_nanoseconds(self._node.get_clock().now().nanoseconds)))
        self._news = False
        if regular:
            # Not before: a warning lasts up to a second, so that who looks now and then sees it.
            self._last_problem = ''
            self._told_at = now

    def _status(self, now: float) -> NodeStatus:
        facts = dict(self._facts)
        for what, rate in self._rates.items():
            facts[f'{what.capitalize()} per second'] = f'{rate.per_second(now):.2f}'
        for percent in (50, 99):
            latency = self._latency.percentile(percent)
            if not math.isnan(latency):
                facts[f'Latency p{percent} (ms)'] = f'{1e3 * latency:.1f}'
        problems = dict.fromkeys(filter(None, [*self._troubles.values(), self._last_problem]))
        return NodeStatus(self._node.get_fully_qualified_name(), self._counts, facts,
                          '; '.join(problems), self._failure, self._host)
