"""Writing a new bag of ROS messages atomically: it appears complete, or not at all."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from active_recon.bags.storage.message_types import message_definition
from active_recon.bags.storage.metadata import QosProfile
from active_recon.bags.storage.writer import BagWriter
from active_recon.errors import RecordingError
from active_recon.whole_files import unfinished_folder
from msg_tools.serialization import message_bytes, type_name


@contextmanager
def atomic_bag(folder: Path) -> Iterator[BagWriter]:
    """
    Yield a writer; the folder appears when the block ends without an error.

    Raises RecordingError if the folder exists or the disk is full.
    """
    folder = folder.absolute()
    if folder.exists():
        raise RecordingError(f'{folder} exists already and is not overwritten: choose another '
                             'folder', 'bag_not_begun')
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        with unfinished_folder(folder.parent, f'.{folder.name}-') as unfinished:
            with BagWriter(unfinished / folder.name) as bag:
                yield bag
            bag.folder.rename(folder)
    except RecordingError as error:
        if not isinstance(error.__cause__, OSError):
            raise
        # It tells what of the bag is left, as of a recording: nothing is
        raise RecordingError(f'cannot write a bag to {folder}: {error.__cause__.strerror}',
                             error.kind) from error.__cause__
    except OSError as error:
        raise RecordingError(f'cannot write a bag to {folder}: {error}',
                             'bag_not_begun') from error


def write_message(bag: BagWriter, topic: str, msg: Any, received: int, published: int,
                  qos: QosProfile) -> None:
    """Write a message and register its topic if it is new; times in nanoseconds since 1970."""
    kind = type_name(msg)
    bag.add_topic(topic, kind, message_definition(kind), (qos,))
    bag.write(topic, message_bytes(msg), received, published)
