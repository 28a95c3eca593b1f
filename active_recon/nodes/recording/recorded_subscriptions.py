"""Subscriptions to the recorded topics, with the QoS that their publishers offer."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from active_recon.bags.storage.metadata import QosProfile
from active_recon.bags.storage.writer import BagWriter
from active_recon.errors import RecordingError
from active_recon.nodes.recording.sequence_gaps import SequenceGaps
from active_recon.nodes.runtime.definitions import message_class, message_definition
from active_recon.nodes.runtime.qos import common_profile, offered_profile
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.subscription import Subscription
from rclpy.topic_endpoint_info import TopicEndpointInfo

# A publisher that offers less than those before is no fault: its topic is subscribed again.
ADAPTS = SubscriptionEventCallbacks(use_default_callbacks=False)
QUEUE = 1000  # messages that may wait while the disk is slow


class RecordedSubscriptions:
    """
    Subscribes to serialized messages, and again when the publishers of a topic offer other QoS.

    `on_message` is called with the topic, the serialized message and its info.
    """

    def __init__(self, node: Node, on_message: Callable[[str, bytes, dict[str, int]], None]
                 ) -> None:
        self._node = node
        self._on_message = on_message
        self._offered: dict[str, tuple[QosProfile, ...]] = {}
        self._subscriptions: dict[str, Subscription] = {}
        self._gaps = SequenceGaps()

    def update(self, name: str, publishers: Sequence[TopicEndpointInfo], bag: BagWriter) -> None:
        """
        Subscribe to a topic as its publishers offer it, and note the offer in the bag.

        Raises RecordingError where the definition of its type is not installed.
        """
        self._gaps.set_publishers(name, {bytes(each.endpoint_gid) for each in publishers})
        offered = tuple(sorted(map(offered_profile, publishers), key=str))
        if not publishers or self._offered.get(name) == offered:
            return
        self._offered[name] = offered
        type_name = publishers[0].topic_type
        try:
            kind = message_class(type_name)
        except (ImportError, AttributeError, ValueError) as error:
            raise RecordingError(f'{name}: message type not installed: expected an installed one, '
                                 f'got {type_name}', 'message_type') from error
        bag.add_topic(name, type_name, message_definition(type_name), offered)
        profile = common_profile(offered, QUEUE)
        subscription = self._subscriptions.get(name)
        if subscription is not None:
            if subscription.qos_profile == profile:
                return
            self._node.destroy_subscription(subscription)
        self._gaps.restart(name)
        self._subscriptions[name] = self._node.create_subscription(
            kind, name, partial(self._on_message, name), profile, raw=True,
            event_callbacks=ADAPTS)

    def message_type(self, name: str) -> Any:
        """Return the message class of a subscribed topic."""
        return self._subscriptions[name].msg_type

    def lost_before(self, name: str, number: int) -> int:
        """Return how many messages of a topic were lost before that with this number."""
        return self._gaps.before(name, number)

    def clear(self) -> None:
        """Unsubscribe from all topics."""
        for subscription in self._subscriptions.values():
            self._node.destroy_subscription(subscription)
        self._subscriptions.clear()
        self._offered.clear()
