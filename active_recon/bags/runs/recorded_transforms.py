"""Transforms in a bag: whether they have the object's frame, and the cameras by them."""

from collections.abc import Iterator, Sequence
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

STATIC = '_static'
"""What the name of a topic ends with whose transforms hold at any time."""


def frames_until(bag: Bag, topics: Sequence[TopicSummary], wanted: str) -> set[str]:
    """Return the frames of transforms, read until one of them is the wanted one."""
    frames: set[str] = set()
    for message in bag.messages({topic.name for topic in topics}):
        for each in read_message(message).transforms:
            frames |= {each.header.frame_id.lstrip('/'), each.child_frame_id.lstrip('/')}
        if wanted in frames:
            break
    return frames


def without_statics(topics: Sequence[TopicSummary]) -> list[TopicSummary]:
    """Return the topics but those with the static transforms beside another's."""
    names = {topic.name for topic in topics}
    return [topic for topic in topics if not topic.name.endswith(STATIC)
            or topic.name.removesuffix(STATIC) not in names]


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
            else:
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
