"""Polled subscriptions: they do not wake the executor, and messages are taken on request."""

from collections.abc import Iterator
from typing import Any

from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.subscription import Subscription


class PolledCallbackGroup(ReentrantCallbackGroup):
    """A callback group that no executor waits on; `take_messages` reads its subscriptions."""

    def can_execute(self, entity: Any) -> bool:
        """Return False: the executor never runs these callbacks."""
        return False


def take_messages(subscription: Subscription) -> Iterator[tuple[Any, int]]:
    """Take the messages since the last call, oldest first, with their reception time in ns."""
    with subscription.handle:
        while (message := subscription.handle.take_message(
                subscription.msg_type, subscription.raw)) is not None:
            yield message[0], message[1]['received_timestamp']
