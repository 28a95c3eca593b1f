"""Work deferred until a node's queues are empty, so that it is done on the newest message."""

from collections.abc import Callable

from rclpy.node import Node

_MOST_ROUNDS = 16  # longer than a queue: constant messages must not defer the work for ever


class DeferredWork:
    """Calls `work` once after `schedule`, as soon as an executor cycle brings no new message."""

    def __init__(self, node: Node, work: Callable[[], None]) -> None:
        self._node = node
        self._work = work
        self._received = 0
        self._received_before = 0
        self._rounds_left = 0
        self._guard = node.create_guard_condition(self._on_round)

    def note_message(self) -> None:
        """Count a message that further messages may follow."""
        self._received += 1

    def schedule(self) -> None:
        """Call `work` once the queues are empty."""
        if not self._rounds_left:
            self._rounds_left = _MOST_ROUNDS
        self._received_before = self._received
        self._guard.trigger()

    def close(self) -> None:
        """Cancel what is scheduled and accept no more."""
        self._node.destroy_guard_condition(self._guard)

    def _on_round(self) -> None:
        self._rounds_left = max(self._rounds_left - 1, 0)
        if self._received != self._received_before and self._rounds_left:
            self._received_before = self._received
            self._guard.trigger()
            return
        self._rounds_left = 0
        self._work()
