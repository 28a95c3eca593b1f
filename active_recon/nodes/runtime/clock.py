"""A node's clock that may go back, as that of a simulation or of a bag that is played again."""

from collections.abc import Callable

from rclpy.clock import Clock, ClockChange, JumpThreshold, TimeJump
from rclpy.clock_type import ClockType
from rclpy.duration import Duration
from rclpy.node import Node

STEADY = Clock(clock_type=ClockType.STEADY_TIME)
"""For what is to go on while the node's own clock stands still."""
BACK_S = 0.1
"""By so little a clock may go back without a jump: two who publish it may differ."""
AHEAD_S = 0.5
"""So far ahead of the clock a stamp may be: the clock is heard a little late."""


class ClockWatch:
    """
    Calls `went_back` when the node's clock has gone back, or has just become a simulation's.

    By then the clock tells the new time. The argument says what happened, in words.
    """

    def __init__(self, node: Node, went_back: Callable[[str], None]) -> None:
        self._clock = node.get_clock()
        self._went_back = went_back
        self._has_gone_back = False
        self._handle = self._clock.create_jump_callback(
            JumpThreshold(min_forward=None, min_backward=Duration(seconds=-BACK_S)),
            post_callback=self._jumped)

    def is_ahead(self, stamp: int) -> bool:
        """Whether a stamp, nanoseconds, can only be of the time before the clock went back."""
        now = self._clock.now().nanoseconds
        return self._has_gone_back and stamp > now + AHEAD_S * 1e9

    def close(self) -> None:
        """Call nobody any more."""
        self._handle.unregister()

    def _jumped(self, jump: TimeJump) -> None:
        if jump.clock_change == ClockChange.ROS_TIME_DEACTIVATED:
            return
        self._has_gone_back = True
        back_s = -jump.delta.nanoseconds / 1e9
        self._went_back('the clock is now that of a simulation'
                        if jump.clock_change == ClockChange.ROS_TIME_ACTIVATED
                        else f'the clock went back by {back_s:.3f} s')
