"""What a node used and what it refused: counted, said in the log, published once a second."""

from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
import time

from active_recon.errors import ActiveReconError
from active_recon.nodes.run import one_line
from diagnostic_msgs.msg import DiagnosticArray
from msg_tools.diagnostics import diagnostics_to_msg
from msg_tools.stamps import stamp_from_nanoseconds
from rclpy.node import Node

LOG_EVERY_S = 10.0


class Diagnostics:
    """
    The counters of one node, on `/diagnostics`.

    What is refused is counted by its kind. The first of a kind is logged at once, a stream of
    them once in `LOG_EVERY_S` seconds, with the number of those left unsaid.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        self._counts: Counter[str] = Counter()
        self._unsaid: Counter[str] = Counter()
        self._said_at: dict[str, float] = {}
        self._problem = ''
        self._failure = ''
        self._publisher = node.create_publisher(DiagnosticArray, '/diagnostics', 10)
        node.create_timer(1.0, self._publish)

    def count(self, what: str, by: int = 1) -> None:
        """Count something that is no refusal, for example a view taken in."""
        self._counts[what] += by

    def refuse(self, error: ActiveReconError) -> None:
        """Count what was refused and say it in one line."""
        self._say(f'refused/{error.kind}', f'refused: {one_line(error)}')

    def warn(self, kind: str, message: str) -> None:
        """Count what was used although it may do harm, and say why in one line."""
        self._say(f'warned/{kind}', message)

    def fail(self, kind: str, message: str) -> None:
        """Say as an error what the node does no more; it stays the state until `recover`."""
        self._counts[f'refused/{kind}'] += 1
        self._failure = message
        self._node.get_logger().error(message)

    def recover(self) -> None:
        """Take back what `fail` said: the node does it again."""
        self._failure = ''

    @contextmanager
    def refusing(self) -> Iterator[None]:
        """Refuse what the block cannot use, and go on."""
        try:
            yield
        except ActiveReconError as error:
            self.refuse(error)

    def _say(self, key: str, message: str) -> None:
        self._counts[key] += 1
        self._problem = message
        now = time.monotonic()
        if now - self._said_at.get(key, -LOG_EVERY_S) < LOG_EVERY_S:
            self._unsaid[key] += 1
            return
        unsaid = self._unsaid.pop(key, 0)
        more = f' (and {unsaid} more of this kind before)' if unsaid else ''
        self._said_at[key] = now
        self._node.get_logger().warning(f'{message}{more}')

    def _publish(self) -> None:
        """Publish the counters; the level is WARN where something was refused since."""
        now = stamp_from_nanoseconds(self._node.get_clock().now().nanoseconds)
        name = self._node.get_fully_qualified_name()
        self._publisher.publish(
            diagnostics_to_msg(name, self._counts, self._problem, now, self._failure))
        self._problem = ''
