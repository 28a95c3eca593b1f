"""A node that warns of endpoints on its topics with incompatible QoS."""

from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator
from itertools import product
from typing import Any

from active_recon.nodes.runtime.diagnostics import Diagnostics
from active_recon.nodes.runtime.qos import endpoint_node, profile_words
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import qos_check_compatible, QoSCompatibility, QoSProfile
from rclpy.subscription import Subscription

CHECK_EVERY_S = 0.4
_LOOK_EVERY = 5  # checks: endpoints are looked at if their numbers are the same as before
_UNKNOWN = 'an unknown node'


class QosWarnings(Node):
    """
    Warns, naming both nodes, while a topic has an endpoint with an incompatible QoS.

    List it before the node's class among the bases; the node's diagnostics are its
    `_diagnostics`, where each mismatch is the warning `qos/<topic>` until the endpoint is gone.

    The endpoints are polled. The middleware has an event for a mismatch, but waiting for it
    would wake the executor on every message as well.
    """

    _diagnostics: Diagnostics

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self._mismatched: set[str] = set()
        self._numbers: list[tuple[int, int]] = []
        self._rounds = 0
        self.create_timer(CHECK_EVERY_S, self._check_endpoints,
                          clock=Clock(clock_type=ClockType.STEADY_TIME))

    def create_publisher(self, *args: Any, **options: Any) -> Publisher:
        """Create a publisher as rclpy does, without event callbacks."""
        events = PublisherEventCallbacks(use_default_callbacks=False)
        return super().create_publisher(*args, **{'event_callbacks': events, **options})

    def create_subscription(self, msg_type: Any, topic: str, callback: Callable[[Any], None],
                            *args: Any, **options: Any) -> Subscription:
        """Create a subscription as rclpy does, without event callbacks."""
        events = SubscriptionEventCallbacks(use_default_callbacks=False)
        return super().create_subscription(
            msg_type, topic, callback, *args, **{'event_callbacks': events, **options})

    def _check_endpoints(self) -> None:
        """Raise a warning for each topic with a mismatch, clear those that have none any more."""
        topics = self._own_topics()
        numbers = [(self.count_publishers(topic), self.count_subscribers(topic))
                   for topic in topics]
        self._rounds += 1
        if numbers == self._numbers and not self._mismatched and self._rounds % _LOOK_EVERY:
            return
        self._numbers = numbers
        found: defaultdict[str, list[str]] = defaultdict(list)
        for topic, mismatch in self._mismatches(topics):
            found[topic].append(mismatch)
        # Two checks must agree: an endpoint is discovered before its node, and lost after it
        for topic in found.keys() & self._mismatched:
            self._diagnostics.raise_warning(
                self._warning_kind(topic), f'{topic}: {"; ".join(found[topic])}')
        for topic in self._mismatched - found.keys():
            self._diagnostics.clear_warning(self._warning_kind(topic))
        self._mismatched = set(found)

    def _warning_kind(self, topic: str) -> str:
        inside = self.get_namespace().rstrip('/') + '/'
        return f'qos/{topic.removeprefix(inside).lstrip("/")}'

    def _own_topics(self) -> list[str]:
        return sorted({own.topic_name for own in self.publishers}
                      | {own.topic_name for own in self.subscriptions})

    def _mismatches(self, topics: Iterable[str]) -> Iterator[tuple[str, str]]:
        """Yield topics and a description of each mismatch there."""
        me = self.get_fully_qualified_name()
        for topic in topics:
            for offered, requested in product(self.get_publishers_info_by_topic(topic),
                                              self.get_subscriptions_info_by_topic(topic)):
                names = endpoint_node(offered) or _UNKNOWN, endpoint_node(requested) or _UNKNOWN
                if me not in names or _is_compatible(offered.qos_profile, requested.qos_profile):
                    continue
                profiles = profile_words(offered.qos_profile), profile_words(requested.qos_profile)
                yield topic, (
                    'incompatible QoS: expected subscribers to request no more than this node '
                    f'offers ({profiles[0]}), but {names[1]} requests ({profiles[1]}), so nothing '
                    'arrives'
                    if names[0] == me else
                    'incompatible QoS: expected publishers to offer at least what this node '
                    f'requests ({profiles[1]}), but {names[0]} offers ({profiles[0]}), so nothing '
                    'arrives')


def _is_compatible(offered: QoSProfile, requested: QoSProfile) -> bool:
    return bool(qos_check_compatible(offered, requested)[0] != QoSCompatibility.ERROR)
