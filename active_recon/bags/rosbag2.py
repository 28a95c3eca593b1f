"""Bags in rosbag2's other storages: sqlite3, and MCAP packed as a whole."""

from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path

from active_recon.bags.message_types import require_standard
from active_recon.bags.metadata import Contents
from active_recon.bags.raw import bag_summary, BagSummary, RawMessage
from active_recon.errors import ActiveReconError, DataError
from active_recon.reporting import Reporting, silent
from rosbags.interfaces import MessageDefinitionFormat
from rosbags.rosbag2 import Reader


class OtherBag:
    """A file or folder as the library rosbags reads it."""

    def __init__(self, path: Path) -> None:
        self._path = path

    def summary(self, reporting: Reporting = silent) -> BagSummary:
        """Say what is in the bag, once all of it has been read."""
        contents = Contents()
        with self._open() as reader, reporting(
                'checking the bag', reader.message_count) as advance:
            types = {each.topic: each.msgtype for each in reader.connections}
            for connection, received, _ in reader.messages():
                contents.add(connection.topic, received)
                advance(1, '')
        return bag_summary(types, contents, {}, {})

    def messages(self, topics: Collection[str]) -> Iterator[RawMessage]:
        """Yield the messages of the topics by their receive times."""
        with self._open() as reader:
            wanted = [each for each in reader.connections if each.topic in topics]
            for connection, received, data in reader.messages(wanted) if wanted else ():
                yield RawMessage(
                    connection.topic, connection.msgtype, data, received, received)

    @contextmanager
    def _open(self) -> Iterator[Reader]:
        try:
            with Reader(self._path) as reader:
                for connection in reader.connections:
                    if connection.msgdef.format == MessageDefinitionFormat.MSG:
                        require_standard(
                            connection.msgtype, connection.msgdef.data.encode(), self._path)
                yield reader
        except ActiveReconError:
            raise
        except Exception as error:  # the library raises whatever damaged bytes lead it to
            raise DataError(f'{self._path}: expected a bag of rosbag2 (MCAP or sqlite3), got: '
                            f'{" ".join(str(error).split())}') from error
