"""Subscriptions that wake nobody: what came is taken when their node has the time for it."""

from collections.abc import Iterator
from typing import Any

from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.subscription import Subscription


class Polled(ReentrantCallbackGroup):
    """A callback group of which no executor waits for a message, or hands one to a callback."""

    def can_execute(self, entity: Any) -> bool:
        """Return that there is nothing to wait for."""
        return False


def taken(subscription: Subscription) -> Iterator[Any]:
    """Take the messages that have come, the first that came first."""
    with subscription.handle:
        while (message := subscription.handle.take_message(
                subscription.msg_type, subscription.raw)) is not None:
            yield message[0]
