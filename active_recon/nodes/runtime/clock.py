"""Clocks that may jump back: that of a simulation, or of a bag that is played again."""

from collections.abc import Callable

from rclpy.clock import Clock, ClockChange, JumpThreshold, TimeJump
from rclpy.clock_type import ClockType
from rclpy.duration import Duration
from rclpy.node import Node

STEADY = Clock(clock_type=ClockType.STEADY_TIME)
"""For timers that must run while the node's own clock is paused."""
BACK_S = 0.1
"""Steps back up to this are no jump: two publishers of a clock may differ."""
AHEAD_S = 0.5
"""Tolerance for stamps ahead of the clock: clock messages arrive with a delay."""


class ClockMonitor:
    """
    Calls `went_back` after the node's clock has jumped back or switched to simulation time.

    The argument describes what happened.
    """

    def __init__(self, node: Node, went_back: Callable[[str], None]) -> None:
        self._clock = node.get_clock()
        self._went_back = went_back
        self._has_gone_back = False
        self._handle = self._clock.create_jump_callback(
            JumpThreshold(min_forward=None, min_backward=Duration(seconds=-BACK_S)),
            post_callback=self._jumped)

    def is_ahead(self, stamp: int) -> bool:
        """Whether a stamp in nanoseconds must be from before the clock jumped back."""
        now = self._clock.now().nanoseconds
        return self._has_gone_back and stamp > now + AHEAD_S * 1e9

    def close(self) -> None:
        """Stop monitoring."""
        self._handle.unregister()

    def _jumped(self, jump: TimeJump) -> None:
        if jump.clock_change == ClockChange.ROS_TIME_DEACTIVATED:
            return
        self._has_gone_back = True
        back_s = -jump.delta.nanoseconds / 1e9
        self._went_back('the clock is now that of a simulation'
                        if jump.clock_change == ClockChange.ROS_TIME_ACTIVATED
                        else f'the clock went back by {back_s:.3f} s')
