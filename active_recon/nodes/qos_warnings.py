"""A node that warns of whoever is on its topics, but with a QoS profile that lets nothing pass."""

from collections.abc import Callable, Iterator
from functools import partial
import math
import time
from typing import Any

from active_recon.nodes.diagnostics import Diagnostics
from active_recon.nodes.qos import endpoint_node, profile_words
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import qos_check_compatible, QoSCompatibility, QoSProfile
from rclpy.subscription import Subscription
from rclpy.timer import Timer
from rclpy.topic_endpoint_info import TopicEndpointInfo

LOOK_EVERY_S = 0.5
FOUND_WITHIN_S = 5.0
"""The middleware may tell of a mismatch before it tells with whom."""
_UNKNOWN = 'a node without a name'


class QosWarnings(Node):
    """
    Warns, naming both profiles, while a topic of the node has an endpoint that does not fit.

    It stands before the node's class among the bases, and the node's diagnostics are its
    `_diagnostics`. There each mismatch is a trouble `qos/<topic>` until the endpoint is gone.
    """

    _diagnostics: Diagnostics

    def __init__(self, *args: Any, **options: Any) -> None:
        self._noticed: dict[str, float] = {}
        self._looking: Timer | None = None
        super().__init__(*args, **options)

    def create_publisher(self, msg_type: Any, topic: str, *args: Any, **options: Any) -> Publisher:
        """Create a publisher, as rclpy does, whose mismatches are noticed."""
        events = PublisherEventCallbacks(incompatible_qos=partial(self._notice, topic))
        return super().create_publisher(
            msg_type, topic, *args, **{'event_callbacks': events, **options})

    def create_subscription(self, msg_type: Any, topic: str, callback: Callable[[Any], None],
                            *args: Any, **options: Any) -> Subscription:
        """Create a subscription, as rclpy does, whose mismatches are noticed."""
        events = SubscriptionEventCallbacks(incompatible_qos=partial(self._notice, topic))
        return super().create_subscription(
            msg_type, topic, callback, *args, **{'event_callbacks': events, **options})

    def _notice(self, topic: str, _event: object) -> None:
        self._noticed[self.resolve_topic_name(topic)] = time.monotonic()
        self._look()
        if self._looking is None:
            self._looking = self.create_timer(
                LOOK_EVERY_S, self._look, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def _look(self) -> None:
        """Tell which endpoints do not fit now, and forget the topics on which all do."""
        for topic, noticed_at in list(self._noticed.items()):
            inside = self.get_namespace().rstrip('/') + '/'
            trouble = f'qos/{topic.removeprefix(inside).lstrip("/")}'
            mismatches = '; '.join(self._mismatches(topic))
            late = time.monotonic() - noticed_at > FOUND_WITHIN_S
            if mismatches and (late or _UNKNOWN not in mismatches):
                self._diagnostics.begin_trouble(trouble, f'{topic}: {mismatches}')
                self._noticed[topic] = -math.inf
            elif late:
                self._diagnostics.end_trouble(trouble)
                del self._noticed[topic]
        if not self._noticed and self._looking is not None:
            self.destroy_timer(self._looking)
            self._looking = None

    def _mismatches(self, topic: str) -> Iterator[str]:
        for served in (each.qos_profile for each in self.publishers if each.topic_name == topic):
            for other in self.get_subscriptions_info_by_topic(topic):
                if not _fit(served, other.qos_profile):
                    yield ('expected who listens to ask for no more than this node offers '
                           f'({profile_words(served)}), but {_name_of(other)} asks for '
                           f'({profile_words(other.qos_profile)}) and hears nothing')
        for asked in (each.qos_profile for each in self.subscriptions if each.topic_name == topic):
            for other in self.get_publishers_info_by_topic(topic):
                if not _fit(other.qos_profile, asked):
                    yield ('expected who publishes to offer at least what this node asks for '
                           f'({profile_words(asked)}), but {_name_of(other)} offers '
                           f'({profile_words(other.qos_profile)}) and is not heard')


def _fit(offered: QoSProfile, requested: QoSProfile) -> bool:
    return bool(qos_check_compatible(offered, requested)[0] != QoSCompatibility.ERROR)


def _name_of(endpoint: TopicEndpointInfo) -> str:
    return endpoint_node(endpoint) or _UNKNOWN
