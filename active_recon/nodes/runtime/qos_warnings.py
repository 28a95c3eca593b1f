"""A node that warns of whoever is on its topics, but so that nothing passes."""

from collections import defaultdict
from collections.abc import Callable, Iterator
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

LOOK_EVERY_S = 0.4
_UNKNOWN = 'a node without a name'


class QosWarnings(Node):
    """
    Warns, naming both sides, while a topic of the node has an endpoint that does not fit.

    It stands before the node's class among the bases, and the node's diagnostics are its
    `_diagnostics`. There each mismatch is a trouble `qos/<topic>` until the endpoint is gone.

    The endpoints are looked at now and then. The middleware would tell of a mismatch, too, but
    who waits for that is woken by every message as well, for nothing.
    """

    _diagnostics: Diagnostics

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self._unfit: set[str] = set()
        self.create_timer(LOOK_EVERY_S, self._look_at_endpoints,
                          clock=Clock(clock_type=ClockType.STEADY_TIME))

    def create_publisher(self, *args: Any, **options: Any) -> Publisher:
        """Create a publisher, as rclpy does, that waits for no event of the middleware."""
        events = PublisherEventCallbacks(use_default_callbacks=False)
        return super().create_publisher(*args, **{'event_callbacks': events, **options})

    def create_subscription(self, msg_type: Any, topic: str, callback: Callable[[Any], None],
                            *args: Any, **options: Any) -> Subscription:
        """Create a subscription, as rclpy does, that waits for no event of the middleware."""
        events = SubscriptionEventCallbacks(use_default_callbacks=False)
        return super().create_subscription(
            msg_type, topic, callback, *args, **{'event_callbacks': events, **options})

    def _look_at_endpoints(self) -> None:
        """Tell which endpoints do not fit now, and forget the topics on which all do."""
        found: defaultdict[str, list[str]] = defaultdict(list)
        for topic, mismatch in self._mismatches():
            found[topic].append(mismatch)
        # Two looks must agree: an endpoint is found before its node, and lost after it
        for topic in found.keys() & self._unfit:
            self._diagnostics.begin_trouble(
                self._trouble(topic), f'{topic}: {"; ".join(found[topic])}')
        for topic in self._unfit - found.keys():
            self._diagnostics.end_trouble(self._trouble(topic))
        self._unfit = set(found)

    def _trouble(self, topic: str) -> str:
        inside = self.get_namespace().rstrip('/') + '/'
        return f'qos/{topic.removeprefix(inside).lstrip("/")}'

    def _mismatches(self) -> Iterator[tuple[str, str]]:
        """Yield topics and what does not fit there, in words."""
        me = self.get_fully_qualified_name()
        topics = {own.topic_name for own in self.publishers}
        for topic in topics | {own.topic_name for own in self.subscriptions}:
            for offered, asked in product(self.get_publishers_info_by_topic(topic),
                                          self.get_subscriptions_info_by_topic(topic)):
                names = endpoint_node(offered) or _UNKNOWN, endpoint_node(asked) or _UNKNOWN
                if me not in names or _fit(offered.qos_profile, asked.qos_profile):
                    continue
                profiles = profile_words(offered.qos_profile), profile_words(asked.qos_profile)
                yield topic, (
                    'expected who listens to ask for no more than this node offers '
                    f'({profiles[0]}), but {names[1]} asks for ({profiles[1]}) and hears nothing'
                    if names[0] == me else
                    'expected who publishes to offer at least what this node asks for '
                    f'({profiles[1]}), but {names[0]} offers ({profiles[0]}) and is not heard')


def _fit(offered: QoSProfile, requested: QoSProfile) -> bool:
    return bool(qos_check_compatible(offered, requested)[0] != QoSCompatibility.ERROR)
