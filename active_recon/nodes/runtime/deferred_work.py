"""Work that waits until a node has heard all that lies in its queues: done on the newest."""

from collections.abc import Callable

from rclpy.node import Node

_MOST_ROUNDS = 16  # more than a queue is long; who sends without a pause must not stop the work


class AfterHearing:
    """Calls `work` once after `ask`, as soon as a round of the executor brought nothing new."""

    def __init__(self, node: Node, work: Callable[[], None]) -> None:
        self._node = node
        self._work = work
        self._heard = 0
        self._heard_before = 0
        self._rounds_left = 0
        self._asked = node.create_guard_condition(self._on_round)

    def heard(self) -> None:
        """Note that something came for which it is worth to wait."""
        self._heard += 1

    def ask(self) -> None:
        """Let the work be done soon."""
        if not self._rounds_left:
            self._rounds_left = _MOST_ROUNDS
        self._heard_before = self._heard
        self._asked.trigger()

    def close(self) -> None:
        """Do no work any more."""
        self._node.destroy_guard_condition(self._asked)

    def _on_round(self) -> None:
        self._rounds_left = max(self._rounds_left - 1, 0)
        if self._heard != self._heard_before and self._rounds_left:
            self._heard_before = self._heard
            self._asked.trigger()
            return
        self._rounds_left = 0
        self._work()
