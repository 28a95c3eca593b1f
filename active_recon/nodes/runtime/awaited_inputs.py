"""Warnings about inputs that have never received a message, with possible remedies."""

from collections.abc import Callable, Iterator, Mapping
from difflib import SequenceMatcher
from typing import Any

from active_recon.nodes.runtime.diagnostics import Diagnostics
from active_recon.nodes.runtime.qos import endpoint_node, NOTHING_COMES, profile_words
from active_recon.nodes.runtime.resting_timer import RestingTimer
from msg_tools.serialization import type_name
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.subscription import Subscription

AWAITED_S = 4.0
CHECK_EVERY_S = 0.4
_CHECKS = round(AWAITED_S / CHECK_EVERY_S)  # a busy node checks less often, and waits longer
_LOOK_EVERY = 5  # checks: the remedies need all of the graph
_MAX_CANDIDATES = 3
_RESULTS = {'entropy', 'latent', 'network_image', 'next_azimuth', 'next_view', 'view',
            'view_image', 'views'}
"""Topics of the loop's own nodes, which are nobody's camera or turntable."""


class AwaitedInputs:
    """
    Warns of each input without a message for `AWAITED_S` seconds, until the first arrives.

    To be made while the node is made or activated. The diagnostics show each input as the
    warning `never_heard/<name>`, by its name before remapping.
    """

    def __init__(self, node: Node, diagnostics: Diagnostics) -> None:
        self._node = node
        self._diagnostics = diagnostics
        self._awaited: dict[str, Mapping[str, str]] = {}
        self._checks = 0
        self._timer = RestingTimer(node, CHECK_EVERY_S, self._check, lambda: bool(self._awaited))

    def subscribe(self, kind: type, name: str, callback: Callable[[Any], None],
                  qos: QoSProfile) -> Subscription:
        """Subscribe to an input, and expect messages of it."""
        def on_msg(msg: Any) -> None:
            self.received(name)
            callback(msg)

        self.expect(name, {kind: ''})
        return self._node.create_subscription(kind, name, on_msg, qos)

    def expect(self, name: str, suffixes: Mapping[type, str]) -> None:
        """Expect messages of an input, of any of several types, each with its topic's suffix."""
        self._awaited[name] = {type_name(kind()): suffix for kind, suffix in suffixes.items()}
        self._timer.wake()

    def received(self, name: str) -> None:
        """Note that a message of an input has arrived, whether or not it can be used."""
        if self._awaited.pop(name, None) is not None:
            self._diagnostics.clear_warning(_warning(name))

    def clear(self) -> None:
        """Expect nothing any more."""
        for name in self._awaited:
            self._diagnostics.clear_warning(_warning(name), log=False)
        self._awaited.clear()

    def _check(self) -> None:
        self._checks += 1
        if self._checks >= _CHECKS and (self._checks - _CHECKS) % _LOOK_EVERY == 0:
            for name, suffixes in self._awaited.items():
                self._diagnostics.raise_warning(_warning(name), self._message(name, suffixes))

    def _message(self, name: str, suffixes: Mapping[str, str]) -> str:
        topics = [f'{self._node.resolve_topic_name(name)}{suffix}' for suffix in suffixes.values()]
        publishers = [text for topic in topics for text in self._publishers(topic, suffixes)]
        message = (f'{" or ".join(topics)}: no messages: expected some, none has arrived; '
                   f'{", ".join(publishers) or "nothing publishes there"}')
        candidates = sorted(self._candidates(name, suffixes), key=_similarity_to(topics[0]))
        return '; '.join([message, *(
            f'{topic} has a publisher: remap with -r {old}:={new}'
            for topic, old, new in candidates[:-_MAX_CANDIDATES - 1:-1])])

    def _publishers(self, topic: str, suffixes: Mapping[str, str]) -> Iterator[str]:
        """Yield a description of each publisher of a topic."""
        for each in self._node.get_publishers_info_by_topic(topic):
            name = endpoint_node(each)
            if each.topic_type not in suffixes:
                what = f'and publishes {each.topic_type} instead of {" or ".join(suffixes)}'
            else:
                what = 'and has published nothing yet' if name else f'of {NOTHING_COMES}'
            profile = profile_words(each.qos_profile)
            yield f'{name or "a node"} publishes there ({profile}) {what}'

    def _candidates(self, name: str,
                    suffixes: Mapping[str, str]) -> Iterator[tuple[str, str, str]]:
        """Yield other topics of a matching type, with both sides of the remapping to them."""
        own = {each.topic_name for each in self._node.publishers}
        own |= {each.topic_name for each in self._node.subscriptions}
        for topic, kinds in self._node.get_topic_names_and_types():
            for suffix in {suffixes[kind] for kind in kinds if kind in suffixes}:
                if (topic in own or topic.rpartition('/')[2] in _RESULTS
                        or not self._node.get_publishers_info_by_topic(topic)):
                    continue
                if topic.endswith(suffix):
                    yield topic, name, topic.removesuffix(suffix)
                else:
                    yield topic, name + suffix, topic


def _warning(name: str) -> str:
    return f'never_heard/{name}'


def _similarity_to(topic: str) -> Callable[[tuple[str, str, str]], tuple[float, str]]:
    """Return a sort key that puts the topic with the most similar name last."""
    return lambda other: (SequenceMatcher(None, topic, other[0]).ratio(), other[0])
