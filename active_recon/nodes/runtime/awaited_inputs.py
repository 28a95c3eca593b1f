"""A node's inputs that have never had a message: warned of, with what could be heard instead."""

from collections.abc import Callable, Iterator, Mapping
from difflib import SequenceMatcher
from typing import Any

from active_recon.nodes.runtime.clock import STEADY
from active_recon.nodes.runtime.diagnostics import Diagnostics
from active_recon.nodes.runtime.qos import endpoint_node, profile_words
from msg_tools.serialization import type_name
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.subscription import Subscription

AWAITED_S = 4.0
LOOK_EVERY_S = 0.4
_LOOKS = round(AWAITED_S / LOOK_EVERY_S)  # a node that is held up looks less often, and waits
_MOST_OTHERS = 3


class AwaitedInputs:
    """
    Warns of each input that is awaited for `AWAITED_S` seconds, until its first message comes.

    It is made while its node is made or activated. In the diagnostics each input is a trouble
    `never_heard/<name>`, by the name that it has in the node before it is remapped.
    """

    def __init__(self, node: Node, diagnostics: Diagnostics) -> None:
        self._node = node
        self._diagnostics = diagnostics
        self._awaited: dict[str, Mapping[str, str]] = {}
        self._looks = 0
        node.create_timer(LOOK_EVERY_S, self._look, clock=STEADY)

    def hear(self, kind: type, name: str, callback: Callable[[Any], None],
             qos: QoSProfile) -> Subscription:
        """Subscribe to an input, and await it."""
        def on_msg(msg: Any) -> None:
            self.heard(name)
            callback(msg)

        self.expect(name, {kind: ''})
        return self._node.create_subscription(kind, name, on_msg, qos)

    def expect(self, name: str, forms: Mapping[type, str]) -> None:
        """Await an input, in any of several types: each with what its topic ends in, or ''."""
        self._awaited[name] = {type_name(kind()): suffix for kind, suffix in forms.items()}

    def heard(self, name: str) -> None:
        """Await an input no more: a message of it has come, whether or not it can be used."""
        if self._awaited.pop(name, None) is not None:
            self._diagnostics.end_trouble(_trouble(name))

    def forget(self) -> None:
        """Await nothing any more."""
        for name in list(self._awaited):
            self.heard(name)

    def _look(self) -> None:
        self._looks += 1
        if self._looks >= _LOOKS:
            for name, forms in self._awaited.items():
                self._diagnostics.begin_trouble(_trouble(name), self._words(name, forms))

    def _words(self, name: str, forms: Mapping[str, str]) -> str:
        topics = [f'{self._node.resolve_topic_name(name)}{suffix}' for suffix in forms.values()]
        publishers = [words for topic in topics for words in self._publishers(topic, forms)]
        said = (f'{" or ".join(topics)}: expected messages, none has ever come; '
                f'{", ".join(publishers) or "nobody publishes there"}')
        others = sorted(self._others(name, forms), key=_likeness(topics[0]))[-_MOST_OTHERS:]
        return '; '.join([said, *(
            f'{topic} has a publisher: remap with -r {old}:={new}'
            for topic, old, new in reversed(others))])

    def _publishers(self, topic: str, forms: Mapping[str, str]) -> Iterator[str]:
        """Yield who publishes on a topic, and how, in words."""
        for each in self._node.get_publishers_info_by_topic(topic):
            what = ('has sent nothing yet' if each.topic_type in forms
                    else f'sends {each.topic_type} instead of {" or ".join(forms)}')
            yield (f'{endpoint_node(each) or "a node"} publishes there '
                   f'({profile_words(each.qos_profile)}) and {what}')

    def _others(self, name: str, forms: Mapping[str, str]) -> Iterator[tuple[str, str, str]]:
        """Yield other topics of a type that fits, with both sides of the remapping to them."""
        own = {each.topic_name for each in self._node.publishers}
        own |= {each.topic_name for each in self._node.subscriptions}
        for topic, kinds in self._node.get_topic_names_and_types():
            for suffix in {forms[kind] for kind in kinds if kind in forms}:
                if topic in own or not self._node.get_publishers_info_by_topic(topic):
                    continue
                if topic.endswith(suffix):
                    yield topic, name, topic.removesuffix(suffix)
                else:
                    yield topic, name + suffix, topic


def _trouble(name: str) -> str:
    return f'never_heard/{name}'


def _likeness(topic: str) -> Callable[[tuple[str, str, str]], tuple[float, str]]:
    """Return what sorts other topics, the one with the most similar name last."""
    return lambda other: (SequenceMatcher(None, topic, other[0]).ratio(), other[0])
