"""A new bag of ROS messages made here, which is there as a whole or not at all."""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from active_recon.bags.storage.metadata import QosProfile
from active_recon.bags.storage.writer import BagWriter
from active_recon.errors import RecordingError
from msg_tools.serialization import message_bytes, type_name
from rosbags.typesys import get_typestore, Stores


@contextmanager
def whole_bag(folder: Path) -> Iterator[BagWriter]:
    """
    Give a bag to write into; the folder appears when the block has ended well.

    Raises RecordingError where the folder exists or the disk is full.
    """
    folder = folder.absolute()
    if folder.exists():
        raise RecordingError(f'{folder} exists already, and nothing is overwritten: name another '
                             'folder', 'bag_not_begun')
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        with TemporaryDirectory(prefix=f'.{folder.name}-', dir=folder.parent) as beside:
            with BagWriter(Path(beside) / folder.name) as bag:
                yield bag
            bag.folder.rename(folder)
    except OSError as error:
        raise RecordingError(f'{folder}: no bag can be written there: {error}',
                             'bag_not_begun') from error


def write_message(bag: BagWriter, topic: str, msg: Any, received: int, published: int,
                  qos: QosProfile) -> None:
    """Write a message on a topic that is announced with it; times in nanoseconds since 1970."""
    kind = type_name(msg)
    bag.add_topic(topic, kind, _definition(kind), (qos,))
    bag.write(topic, message_bytes(msg), received, published)


@cache
def _definition(kind: str) -> str:
    definition, _ = get_typestore(Stores.ROS2_JAZZY).generate_msgdef(kind, ros_version=2)
    return definition
