"""
Bags: an MCAP file with rosbag2's metadata.yaml beside it.

The writer knows no ROS: types arrive as names, definitions as text, messages as the CDR bytes
that went over the wire. What it writes opens in rosbag2, rosbags, mcap-ros2-support and Foxglove.
"""

from collections import Counter
from dataclasses import dataclass, field, replace
import errno
from pathlib import Path
from types import TracebackType
from typing import Any

from active_recon.bags.metadata import (
    as_yaml,
    bag_information,
    metadata_yaml,
    offered_qos_yaml,
    QosProfile,
    Topic,
)
from active_recon.bags.whole_chunks import WholeChunks
from active_recon.errors import RecordingError
from mcap.writer import Writer


class BagWriter:
    """
    Records messages into a folder: `<folder>/<folder's name>.mcap` and `metadata.yaml`.

    The folder is made where it is missing; a folder that already holds a bag is refused, nothing
    is ever overwritten. Messages reach the disk in chunks, by `flush` or when a chunk is full.
    Where the disk is full (or fails) the call that noticed raises RecordingError, the unwritten
    chunk is dropped, and the bag is closed: it stays a readable one up to its last chunk.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.path = folder / f'{folder.name}.mcap'
        self._topics: dict[str, Topic] = {}
        self._channels: dict[str, int] = {}
        self._schemas: dict[str, int] = {}
        self._written = _Contents()
        self._on_disk = _Contents()
        self._closed = False
        try:
            folder.mkdir(parents=True, exist_ok=True)
            if (folder / 'metadata.yaml').exists():
                raise FileExistsError(errno.EEXIST, 'there is a metadata.yaml already')
            self._chunks = WholeChunks(self.path)
        except OSError as error:
            raise RecordingError(f'expected to begin a new bag in {folder}, but: {error}',
                                 'bag_not_begun') from error
        # Summary offsets as this library writes them are refused by checkers of MCAP files.
        self._mcap = Writer(self._chunks, use_summary_offsets=False)  # type: ignore[arg-type]
        self._mcap.start(profile='ros2', library='active_recon')
        # Without this record rosbag2 takes a bare file for one of an older version.
        self._mcap.add_metadata('rosbag2', {'serialized_metadata': as_yaml(self._information())})
        self.flush()

    @property
    def message_count(self) -> int:
        """Messages taken in so far, the ones not yet on disk among them."""
        return self._written.counts.total()

    def add_topic(self, name: str, type_name: str, definition: str,
                  qos: tuple[QosProfile, ...] = ()) -> None:
        """
        Announce a topic before its first message.

        `type_name` is as in 'std_msgs/msg/Header', `definition` its text in the ros2msg form: the
        message file, then each type that it names, after a line of 80 '=' and 'MSG: pkg/Name'.
        `qos` are the profiles that its publishers offer. Announced again, a topic stays as it is;
        another type is refused.
        """
        self._require_open()
        known = self._topics.get(name)
        if known is not None:
            if known.type_name != type_name:
                raise RecordingError(f'{name}: expected messages of {known.type_name} as before, '
                                     f'got {type_name}', 'topic_type')
            return
        if type_name not in self._schemas:
            self._schemas[type_name] = self._mcap.register_schema(
                type_name, 'ros2msg', definition.encode())
        self._topics[name] = Topic(name, type_name, qos)
        self._channels[name] = self._mcap.register_channel(
            name, 'cdr', self._schemas[type_name], {'offered_qos_profiles': offered_qos_yaml(qos)})

    def write(self, topic: str, data: bytes, receive_time: int, publish_time: int) -> None:
        """
        Take in one message: its CDR bytes, header included; times in nanoseconds since 1970.

        Raises RecordingError where the topic was not announced, the bag is closed, or the disk
        is full.
        """
        self._require_open()
        if topic not in self._channels:
            raise RecordingError(f'{topic}: expected a topic announced by add_topic', 'topic')
        self._written.add(topic, receive_time)
        self._mcap.add_message(self._channels[topic], receive_time, data, publish_time,
                               sequence=self._written.counts[topic])
        if self._chunks.pending:
            self.flush()

    def flush(self) -> None:
        """Write the chunk begun to the disk. Raises RecordingError where the disk is full."""
        self._require_open()
        try:
            self._mcap.flush()  # type: ignore[no-untyped-call]
        except OSError as error:
            self._abandon(error)
        self._on_disk = replace(self._written, counts=self._written.counts.copy())

    def close(self) -> None:
        """Complete the bag; a second call does nothing. RecordingError where the disk is full."""
        if self._closed:
            return
        self.flush()
        try:
            self._mcap.finish()  # type: ignore[no-untyped-call]
            self._chunks.flush()
            self._write_metadata()
        except OSError as error:
            self._abandon(error)
        self._chunks.close()
        self._closed = True

    def _require_open(self) -> None:
        if self._closed:
            raise RecordingError(f'{self.path}: expected an open bag, but it was closed', 'closed')

    def _abandon(self, error: OSError) -> None:
        """End the file after its last whole chunk, and say why."""
        self._closed = True
        kept = self._on_disk.counts.total()
        lost = self.message_count - kept
        message = (f'{self.path}: the disk took no more ({error.strerror}); the bag ends after '
                   f'{kept} messages, {lost} were lost')
        try:
            self._chunks.end()
            self._write_metadata()
        except OSError:  # not even room for that
            message += '; it could not be completed and needs `mcap recover`'
        self._chunks.close()
        raise RecordingError(message, 'disk_full') from error

    def _write_metadata(self) -> None:
        (self.folder / 'metadata.yaml').write_text(metadata_yaml(self._information()))

    def _information(self) -> dict[str, Any]:
        contents = self._on_disk
        return bag_information(self.path.name, list(self._topics.values()), contents.counts,
                               contents.begin, contents.end)

    def __enter__(self) -> 'BagWriter':
        """Close the bag where the block ends."""
        return self

    def __exit__(self, kind: type[BaseException] | None, value: BaseException | None,
                 trace: TracebackType | None) -> None:
        """Close the bag."""
        self.close()


@dataclass
class _Contents:
    """How many messages each topic has, and the span of their receive times, nanoseconds."""

    counts: Counter[str] = field(default_factory=Counter)
    begin: int = 0
    end: int = 0

    def add(self, topic: str, time: int) -> None:
        self.begin = min(self.begin, time) if self.counts else time
        self.end = max(self.end, time)
        self.counts[topic] += 1
