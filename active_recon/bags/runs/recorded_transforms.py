"""Transforms in a bag: whether they have the object's frame, and the cameras by them."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from active_recon.bags.runs.run import TopicSummary
from active_recon.bags.storage.bag import Bag, RawMessage
from active_recon.bags.storage.message_types import read_message
from active_recon.errors import MessageError, ViewError
from active_recon.geometry.transform_tree import Transform, TransformTree
from msg_tools.transforms import transform_from_msg
from msg_tools.views import NOT_BEGUN, PATIENCE_S
import numpy as np
from numpy.typing import NDArray

USUAL = '/tf'
STATIC = '_static'
"""What the name of a topic ends with whose transforms hold at any time."""


def connecting(bag: Bag, topics: Sequence[TopicSummary],
               wanted: Collection[str]) -> tuple[list[TopicSummary], set[str]]:
    """
    Return the topics whose transforms, with the static ones, connect the wanted frames.

    The second value are all frames, read until `/tf` connects them, which is then returned alone,
    or every topic does.
    """
    def connects(tree: Mapping[str, set[str]]) -> bool:
        return set(wanted) <= tree.get(next(iter(wanted)), set())

    statics = [topic.name for topic in topics if topic.name.endswith(STATIC)]
    moving = [topic for topic in topics if topic.name not in statics] or list(topics)
    trees: dict[str, dict[str, set[str]]] = {topic.name: {} for topic in moving}
    for message in bag.messages({topic.name for topic in topics}):
        of_all = message.topic in statics and message.topic not in trees
        for each in read_message(message).transforms:
            pair = each.header.frame_id.lstrip('/'), each.child_frame_id.lstrip('/')
            for tree in trees.values() if of_all else [trees[message.topic]]:
                one, other = (tree.setdefault(name, {name}) for name in pair)
                if one is not other:
                    one |= other
                    tree.update(dict.fromkeys(other, one))
        if connects(trees.get(USUAL, {})) or all(map(connects, trees.values())):
            break
    found = [topic for topic in moving if connects(trees[topic.name])]
    return ([topic for topic in found if topic.name == USUAL] or found,
            {name for tree in trees.values() for name in tree})


class RecordedTransforms:
    """
    The transforms of a bag, from which the pose of an image's frame is looked up.

    `max_gap` is the longest time from an image to the transforms that are interpolated, seconds.
    """

    def __init__(self, object_frame: str, max_gap: float) -> None:
        self._object_frame = object_frame.lstrip('/')
        self._tree = TransformTree(max_gap)
        self._moving: list[tuple[int, Transform]] = []
        self._firsts: dict[str, int] = {}
        self._latest: dict[str, int] = {}
        self._restarted: set[str] = set()

    def read(self, msg: Any, message: RawMessage) -> Iterator[MessageError]:
        """Read a TFMessage; yield the errors of its transforms that cannot be used."""
        for each in msg.transforms:
            try:
                transform = transform_from_msg(each)
            except MessageError as error:
                yield MessageError(str(error), 'unusable_transform')
                continue
            if message.topic.endswith(STATIC):
                self._tree.add(transform, static=True)
                continue
            latest = self._latest.setdefault(transform.child, transform.stamp)
            if transform.stamp < latest - PATIENCE_S * 1e9:  # tf2 would forget all of before
                self._restarted.add(transform.child)
            if transform.child in self._restarted and transform.stamp <= latest:
                yield MessageError(f'transform out of order: that of {transform.child!r} went '
                                   f'back by {(latest - transform.stamp) / 1e9:.3f} s',
                                   'unusable_transform')
                continue
            self._latest[transform.child] = max(latest, transform.stamp)
            self._moving.append((message.received, transform))

    @property
    def stamps(self) -> list[int]:
        """The stamps of all but the static transforms, nanoseconds."""
        return [transform.stamp for _, transform in self._moving]

    def finish(self, by_receive_time: bool) -> None:
        """Connect what was read, each transform at its stamp or at its receive time."""
        for received, transform in self._moving:
            at = replace(transform, stamp=received) if by_receive_time else transform
            self._firsts[at.child] = min(at.stamp, self._firsts.get(at.child, at.stamp))
            self._tree.add(at, static=False)
        self._moving.clear()

    def pose(self, frame: str, time: int) -> NDArray[np.float64]:
        """Return the pose of a camera's frame, (4, 4), at a time; raises MessageError."""
        try:
            return self._tree.pose(self._object_frame, frame.lstrip('/'), time)
        except ViewError as error:
            soon = any(0 < first - time <= PATIENCE_S * 1e9 for first in self._firsts.values())
            raise MessageError(str(error), NOT_BEGUN if soon and error.kind == 'no_pose'
                               else error.kind) from error
