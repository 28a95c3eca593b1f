"""ROS node that plays a bag: serialized messages at their reception times, and the clock."""

from pathlib import Path
import time

from active_recon.bags.runs.playing import played
from active_recon.errors import ConfigError
from active_recon.nodes.runtime.definitions import message_class
from active_recon.nodes.runtime.parameters import Parameters
from active_recon.nodes.runtime.qos import common_profile
from active_recon.nodes.runtime.run import run_node
from active_recon.parameters.player import PlayerParameters
from msg_tools.stamps import stamp_from_nanoseconds
from rclpy.clock import Clock as SystemClock
from rclpy.clock_type import ClockType
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy
from rosgraph_msgs.msg import Clock

CLOCK = '/clock'
SUBSCRIBER_TIMEOUT_S = 3.0
"""Time to wait for a subscriber of each topic before the bag is played anyway."""
_TICK_S = 0.002
_CLOCK_EVERY_S = 0.02
_LOG_EVERY_S = 10.0
_QUEUE = 100


class PlayerNode(Node):
    """Publish a bag's messages once, then end the process."""

    def __init__(self) -> None:
        super().__init__('player')
        params = Parameters(self, PlayerParameters).values
        bag, self._rate = Path(params.bag), params.rate
        playing = played(bag, self._rate, params.topics)
        self._out = {}
        for topic in playing.topics:
            try:
                kind = message_class(topic.type_name)
            except (ImportError, AttributeError, ValueError) as error:
                raise ConfigError(f'{topic.name}: message type not installed: expected an '
                                  f'installed one, got {topic.type_name}; leave it out with '
                                  'topics') from error
            profile = common_profile(topic.qos, _QUEUE)
            if profile.durability == DurabilityPolicy.TRANSIENT_LOCAL:
                profile.depth = max(len(topic.qos), 1)  # the last of each publisher
            self._out[topic.name] = self.create_publisher(kind, topic.name, profile)
        self._clock_pub = None if CLOCK in self._out else self.create_publisher(Clock, CLOCK, 10)
        self._messages = playing.messages()
        self._next = next(self._messages, None)
        self._begin = self._next.received if self._next is not None else 0
        self._made_at = time.monotonic()
        self._started_at: float | None = None
        self._clock_at = self._logged_at = 0.0
        self.get_logger().info(f'playing {len(playing.topics)} topics of {bag} at rate '
                               f'{self._rate:g}')
        # A steady clock: with use_sim_time the node would wait for the clock it publishes.
        self.create_timer(_TICK_S, self._play, clock=SystemClock(clock_type=ClockType.STEADY_TIME))

    def _play(self) -> None:
        """Publish the messages that are due."""
        now = time.monotonic()
        if self._started_at is None:
            if not self._has_subscribers(now - self._made_at):
                return
            self._started_at = self._logged_at = now
        elapsed = (now - self._started_at) * self._rate
        due = self._begin + round(elapsed * 1e9)
        while self._next is not None and self._next.received <= due:
            self._publish_clock(self._next.received)
            self._out[self._next.topic].publish(self._next.data)
            self._next = next(self._messages, None)
        if self._next is None:
            self._finish()
        if now - self._clock_at >= _CLOCK_EVERY_S:
            self._publish_clock(due)
            self._clock_at = now
        if now - self._logged_at >= _LOG_EVERY_S:
            self.get_logger().info(f'{elapsed:.0f} s of the recording played')
            self._logged_at = now

    def _has_subscribers(self, waited_s: float) -> bool:
        """Return whether every topic has a subscriber, or has waited long enough for one."""
        unsubscribed = [name for name, publisher in self._out.items()
                   if not publisher.get_subscription_count()]
        if unsubscribed and waited_s < SUBSCRIBER_TIMEOUT_S:
            return False
        if unsubscribed:
            self.get_logger().info(f'playing without subscribers of {", ".join(unsubscribed)}')
        return True

    def _publish_clock(self, nanoseconds: int) -> None:
        if self._clock_pub is not None:
            self._clock_pub.publish(Clock(clock=stamp_from_nanoseconds(nanoseconds)))

    def _finish(self) -> None:
        """End the process when all messages have been delivered."""
        for publisher in self._out.values():
            publisher.wait_for_all_acked(Duration(seconds=SUBSCRIBER_TIMEOUT_S))
        self.get_logger().info('done')
        raise SystemExit(0)


def main(args: list[str] | None = None) -> None:
    """Play a bag until its end, or until the process is asked to stop."""
    run_node(PlayerNode, args)


if __name__ == '__main__':
    main()
