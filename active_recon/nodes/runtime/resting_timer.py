"""A timer that rests while there is nothing to wait for: an idle node is to sleep."""

from collections.abc import Callable

from active_recon.nodes.runtime.clock import STEADY
from rclpy.node import Node


class RestingTimer:
    """
    Calls `tick` every `period` seconds while `needed` holds.

    What `needed` depends on may change at any time, in the node's thread: `wake` is then to be
    called, and starts the timer where it rests. It stops by itself.
    """

    def __init__(self, node: Node, period: float, tick: Callable[[], object],
                 needed: Callable[[], bool]) -> None:
        self._tick_once = tick
        self._needed = needed
        self._timer = node.create_timer(period, self._tick, clock=STEADY)
        self._timer.cancel()
        self.wake()

    def wake(self) -> None:
        """Start the timer if it rests and is needed."""
        if self._timer.is_canceled() and self._needed():
            self._timer.reset()

    def _tick(self) -> None:
        self._tick_once()
        if not self._needed():
            self._timer.cancel()
