"""One MCAP file of a bag; flushed messages survive a crash of the writer."""

from collections.abc import Mapping
from operator import itemgetter
from pathlib import Path

from active_recon.bags.storage.chunk_file import ChunkFile
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

    Messages are buffered into a chunk until `flush`, or until it holds a million bytes. Within a
    chunk they are sorted by receive time: the middleware delivers topic by topic, but some
    readers require time order when they scan a file without an index. Every method raises
    OSError if the disk is full or fails; the messages flushed before remain in a readable file.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.contents = Contents()
        """All messages written, including those not flushed yet."""
        self.flushed = Contents()
        """The messages that are in the file."""
        self.chunks = 0
        """The number of chunks in the file; the index keeps each of them in memory."""
        self._chunks = ChunkFile(path)
        # Summary offsets as this library writes them are refused by checkers of MCAP files.
        self._mcap = Writer(self._chunks, use_summary_offsets=False)  # type: ignore[arg-type]
        self._channels: dict[str, int] = {}
        self._schemas: dict[str, int] = {}
        self._waiting: list[tuple[int, int, bytes, int, int]] = []
        self._waiting_bytes = 0
        self._mcap.start(profile='ros2', library='active_recon')
        # Without this record rosbag2 treats a bare file as one of an older version.
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
        """The size of the file in bytes, without the open chunk."""
        return self._chunks.tell()

    def add_topic(self, topic: Topic, definition: str) -> None:
        """Register a topic that the file does not have yet."""
        if topic.type_name not in self._schemas:
            self._schemas[topic.type_name] = self._mcap.register_schema(
                topic.type_name, 'ros2msg', definition.encode())
        self._channels[topic.name] = self._mcap.register_channel(
            topic.name, 'cdr', self._schemas[topic.type_name],
            {'offered_qos_profiles': offered_qos_yaml(topic.qos)})

    def has(self, topic: str) -> bool:
        """Whether the topic is registered."""
        return topic in self._channels

    def write(self, topic: str, data: bytes, receive_time: int, publish_time: int,
              sequence: int) -> None:
        """Buffer a message of a registered topic; times in nanoseconds since 1970."""
        self.contents.add(topic, receive_time)
        self._waiting.append(
            (receive_time, self._channels[topic], data, publish_time, sequence))
        self._waiting_bytes += len(data)
        if self._waiting_bytes >= _CHUNK_BYTES:
            self.flush()

    def add_metadata(self, name: str, record: Mapping[str, str]) -> None:
        """Add a metadata record; the last one of a name is valid."""
        self._mcap.add_metadata(name, dict(record))

    def attach(self, name: str, media_type: str, data: bytes, time: int) -> None:
        """Add an attachment; `time` in nanoseconds since 1970."""
        self._mcap.add_attachment(time, time, name, media_type, data)

    def flush(self) -> None:
        """Write the open chunk and all other buffered records."""
        for time, channel, data, publish_time, sequence in sorted(
                self._waiting, key=itemgetter(0)):
            self._mcap.add_message(channel, time, data, publish_time, sequence)
        self._waiting.clear()
        self._waiting_bytes = 0
        self._mcap.flush()  # type: ignore[no-untyped-call]
        self._note_flushed()

    def sync(self) -> None:
        """Block until the flushed data would survive a power cut."""
        self._chunks.sync()

    def finish(self) -> None:
        """Write the index and close the file."""
        self.flush()
        self._mcap.finish()  # type: ignore[no-untyped-call]
        self._chunks.end()

    def abandon(self) -> None:
        """Close the file as it is after the last flush, without an index."""
        self._chunks.close()

    def _note_flushed(self) -> None:
        if self.contents != self.flushed:
            self.chunks += 1
            self.flushed = self.contents.copy()
