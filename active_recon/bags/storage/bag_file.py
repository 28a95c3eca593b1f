"""One MCAP file of a bag: what was flushed to it is kept, whatever happens next."""

from collections.abc import Mapping
from operator import itemgetter
from pathlib import Path

from active_recon.bags.storage.chunk_file import WholeChunks
from active_recon.bags.storage.metadata import (
    as_yaml,
    bag_information,
    Contents,
    offered_qos_yaml,
    Topic,
)
from mcap.writer import Writer

_CHUNK_BYTES = 1_000_000


class BagFile:
    """
    An MCAP file of profile `ros2` that is being written; `path` must not exist yet.

    Messages wait in a chunk until `flush`, or until there are a million bytes of them, and stand
    in it in the order in which they were received: a middleware hands over topic by topic, but a
    file without an index is scanned, for which some readers ask for that order. Every method
    raises OSError where the disk is full or fails, and then what was flushed before stands in a
    readable file.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.contents = Contents()
        """What was taken in."""
        self.flushed = Contents()
        """What of it is in the file."""
        self.chunks = 0
        """How many chunks that are; each costs memory, for the index."""
        self._chunks = WholeChunks(path)
        # Summary offsets as this library writes them are refused by checkers of MCAP files.
        self._mcap = Writer(self._chunks, use_summary_offsets=False)  # type: ignore[arg-type]
        self._channels: dict[str, int] = {}
        self._schemas: dict[str, int] = {}
        self._waiting: list[tuple[int, int, bytes, int, int]] = []
        self._waiting_bytes = 0
        self._mcap.start(profile='ros2', library='active_recon')
        # Without this record rosbag2 takes a bare file for one of an older version.
        self.add_metadata('rosbag2', {
            'serialized_metadata': as_yaml(bag_information([(path.name, Contents())], []))})
        try:
            self.flush()
            self.sync()
        except OSError:
            self.abandon()
            path.unlink()  # nothing is in it
            raise

    @property
    def size(self) -> int:
        """The bytes that the file has, without the chunk begun."""
        return self._chunks.tell()

    def add_topic(self, topic: Topic, definition: str) -> None:
        """Announce a topic that the file does not have yet."""
        if topic.type_name not in self._schemas:
            self._schemas[topic.type_name] = self._mcap.register_schema(
                topic.type_name, 'ros2msg', definition.encode())
        self._channels[topic.name] = self._mcap.register_channel(
            topic.name, 'cdr', self._schemas[topic.type_name],
            {'offered_qos_profiles': offered_qos_yaml(topic.qos)})

    def has(self, topic: str) -> bool:
        """Whether the topic was announced."""
        return topic in self._channels

    def write(self, topic: str, data: bytes, receive_time: int, publish_time: int,
              sequence: int) -> None:
        """Take in a message of an announced topic; times in nanoseconds since 1970."""
        self.contents.add(topic, receive_time)
        self._waiting.append(
            (receive_time, self._channels[topic], data, publish_time, sequence))
        self._waiting_bytes += len(data)
        if self._waiting_bytes >= _CHUNK_BYTES:
            self.flush()

    def add_metadata(self, name: str, record: Mapping[str, str]) -> None:
        """Take in a record of metadata; a later one of the same name holds."""
        self._mcap.add_metadata(name, dict(record))

    def attach(self, name: str, media_type: str, data: bytes, time: int) -> None:
        """Take in an attachment; `time` in nanoseconds since 1970."""
        self._mcap.add_attachment(time, time, name, media_type, data)

    def flush(self) -> None:
        """Write the chunk begun, and all else that waits."""
        for time, channel, data, publish_time, sequence in sorted(
                self._waiting, key=itemgetter(0)):
            self._mcap.add_message(channel, time, data, publish_time, sequence)
        self._waiting.clear()
        self._waiting_bytes = 0
        self._mcap.flush()  # type: ignore[no-untyped-call]
        self._note_flushed()

    def sync(self) -> None:
        """Return when what was flushed would survive a power cut."""
        self._chunks.sync()

    def finish(self) -> None:
        """Write the index and close the file."""
        self.flush()
        self._mcap.finish()  # type: ignore[no-untyped-call]
        self._chunks.end()

    def abandon(self) -> None:
        """Close the file as it is: after the last flush, with no index."""
        self._chunks.close()

    def _note_flushed(self) -> None:
        if self.contents != self.flushed:
            self.chunks += 1
            self.flushed = self.contents.copy()
