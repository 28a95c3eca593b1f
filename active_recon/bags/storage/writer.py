"""
Bags: MCAP files with rosbag2's metadata.yaml.

The writer needs no ROS: types are given as names, definitions as text, messages as CDR bytes. Its
bags open in rosbag2, rosbags, mcap-ros2-support and Foxglove.
"""

from collections import Counter
from collections.abc import Mapping
import errno
from pathlib import Path
import time
from types import TracebackType

from active_recon.bags.storage.bag_file import BagFile
from active_recon.bags.storage.files import sync_folder, write_atomically
from active_recon.bags.storage.metadata import (
    as_yaml,
    bag_information,
    Contents,
    metadata_yaml,
    parameters_name,
    PROVENANCE,
    QosProfile,
    Topic,
    total,
)
from active_recon.errors import RecordingError
from active_recon.file_names import readable

MAX_CHUNKS = 20_000
"""Chunks in one file; their index takes 30 MB of memory until it is written."""


class BagWriter:
    """
    Records messages into a folder: `<folder's name>_0.mcap`, `_1.mcap`, ..., `metadata.yaml`.

    The folder is created if it is missing; one that already holds a bag is rejected, nothing is
    ever overwritten. A new file is started when the last one has reached `max_bytes` or
    MAX_CHUNKS; it repeats the last message of each latched topic, so that it can be read alone
    (`new_in_bag` skips the repeated messages).
    Messages reach the disk in chunks, by `flush` or when a chunk is full. If the disk is full or
    fails, the call raises RecordingError, the open chunk is dropped and the bag is closed; it
    remains readable up to its last chunk. So does a call that finds the bag deleted.
    """

    def __init__(self, folder: Path, max_bytes: int | None = None) -> None:
        self.folder = folder
        self._max_bytes = max_bytes
        self._topics: dict[str, tuple[Topic, str]] = {}
        self._counts: Counter[str] = Counter()
        self._provenance: dict[str, str] = {}
        self._parameters: dict[str, bytes] = {}
        self._done: list[tuple[str, Contents]] = []
        self._latched: dict[str, tuple[bytes, int, int]] = {}
        self._repeated = 0
        self._repeated_bytes = 0
        self._closed = False
        try:
            folder.mkdir(parents=True, exist_ok=True)
            if any(folder.glob('*.mcap')) or (folder / 'metadata.yaml').exists():
                raise FileExistsError(errno.EEXIST, 'it already holds a bag')
            if readable(folder.name) != folder.name:
                raise OSError(errno.EILSEQ, 'the name of a bag has to be of UTF-8')
            self._file = self._begin_file(0)
        except OSError as error:
            raise RecordingError(f'cannot start a bag in {folder}: {error}',
                                 'bag_not_begun') from error

    @property
    def path(self) -> Path:
        """The current or last file."""
        return self._file.path

    @property
    def message_count(self) -> int:
        """The number of messages written so far, including those not yet on disk."""
        return self._counts.total()

    def add_topic(self, name: str, type_name: str, definition: str,
                  qos: tuple[QosProfile, ...] = ()) -> None:
        """
        Register a topic before its first message; a topic without messages is not in the bag.

        `type_name` is as in 'std_msgs/msg/Header', `definition` its text in the ros2msg form: the
        message file, then each type that it names, after a line of 80 '=' and 'MSG: pkg/Name'.
        `qos` are the profiles that its publishers offer. Registering a topic again changes
        nothing; raises RecordingError if its type differs.
        """
        self._require_open()
        if name not in self._topics:
            self._topics[name] = Topic(name, type_name, qos), definition
            return
        known = self._topics[name][0].type_name
        if known != type_name:
            raise RecordingError(f'{name}: changed type: expected {known} as before, '
                                 f'got {type_name}', 'topic_type')

    def write(self, topic: str, data: bytes, receive_time: int, publish_time: int) -> None:
        """
        Write one message: its CDR bytes, header included; times in nanoseconds since 1970.

        Raises RecordingError if the topic is not registered, the bag is closed or the disk is
        full.
        """
        self._require_open()
        if topic not in self._topics:
            raise RecordingError(f'{topic}: unknown topic: register it by add_topic', 'topic')
        self._counts[topic] += 1
        try:
            if self._file_is_full():
                self._split(receive_time)
            if not self._file.has(topic):
                self._file.add_topic(*self._topics[topic])
            self._file.write(topic, data, receive_time, publish_time, self._counts[topic])
            if self._topics[topic][0].latched:
                self._latched[topic] = data, publish_time, self._counts[topic]
        except OSError as error:
            self._abandon(error)

    def add_provenance(self, record: Mapping[str, str]) -> None:
        """
        Record what made the bag, flushed at once: versions, hashes, policy, seed, object.

        Later calls add to the record; each file of the bag has all that was known by then.
        Raises RecordingError as `write` does.
        """
        self._require_open()
        self._provenance |= {name: readable(text) for name, text in record.items()}
        try:
            self._file.add_metadata(PROVENANCE, self._provenance)
        except OSError as error:
            self._abandon(error)
        self.flush()

    def attach_parameters(self, node: str, parameters: Mapping[str, object]) -> None:
        """Attach a node's parameters by its name, flushed at once; raises as `write` does."""
        self._require_open()
        self._parameters[node] = as_yaml({
            name: readable(value) if isinstance(value, str) else value
            for name, value in parameters.items()}).encode()
        try:
            self._attach(self._file, node)
        except OSError as error:
            self._abandon(error)
        self.flush()

    def flush(self) -> None:
        """
        Write all messages to the disk, where they survive a power cut.

        Raises RecordingError if the disk is full, or the file was deleted.
        """
        self._require_open()
        try:
            self._file.flush()
            self._file.sync()
        except OSError as error:
            self._abandon(error)

    def close(self) -> None:
        """Complete the bag, once; raises RecordingError if the disk is full."""
        if self._closed:
            return
        try:
            self._file.finish()
            self._write_metadata()
        except OSError as error:
            self._abandon(error)
        self._closed = True

    def _begin_file(self, number: int) -> BagFile:
        """Start a file, with the provenance and parameters known so far."""
        file = BagFile(self.folder / f'{self.folder.name}_{number}.mcap')
        if self._provenance:
            file.add_metadata(PROVENANCE, self._provenance)
        for node in self._parameters:
            self._attach(file, node)
        sync_folder(self.folder)
        return file

    def _attach(self, file: BagFile, node: str) -> None:
        file.attach(parameters_name(node), 'application/yaml', self._parameters[node],
                    time.time_ns())

    def _file_is_full(self) -> bool:
        return self._file.chunks >= MAX_CHUNKS or (
            self._max_bytes is not None
            and self._file.size - self._repeated_bytes >= self._max_bytes)

    def _split(self, time: int) -> None:
        self._file.finish()
        following = self._begin_file(len(self._done) + 1)
        begun = following.size
        try:
            self._repeat_latched(following, time)
        except OSError:
            following.abandon()
            following.path.unlink()
            raise
        self._done.append((self.path.name, self._file.contents))
        self._file = following
        self._repeated += len(self._latched)
        self._repeated_bytes = following.size - begun

    def _repeat_latched(self, file: BagFile, time: int) -> None:
        for topic, (data, publish_time, sequence) in self._latched.items():
            file.add_topic(*self._topics[topic])
            file.write(topic, data, time, publish_time, sequence)
        file.flush()

    def _require_open(self) -> None:
        if self._closed:
            raise RecordingError(f'{self.path}: the bag is closed', 'closed')

    def _abandon(self, error: OSError) -> None:
        """Close the bag after its last complete chunk and raise RecordingError."""
        self._closed = True
        if isinstance(error, FileNotFoundError):
            self._file.abandon()
            raise RecordingError(
                f'{self.path}: deleted or moved while it was recorded: expected it to stay in its '
                'place until the recording ends; `active-recon bag repair` completes one that was '
                'moved', 'bag_gone') from error
        kept = total(contents for _, contents in self._files()).counts.total() - self._repeated
        lost = self.message_count - kept
        message = (f'{self.path}: writing failed ({error.strerror}); the bag ends after {kept} '
                   f'messages, {lost} were lost')
        self._file.abandon()
        try:
            self._write_metadata()
        except OSError:  # not even room for that
            message += ('; its metadata.yaml could not be written: make room and run '
                        f'`active-recon bag repair {self.folder}`')
        raise RecordingError(message, 'disk_full') from error

    def _files(self) -> list[tuple[str, Contents]]:
        return [*self._done, (self.path.name, self._file.flushed)]

    def _write_metadata(self) -> None:
        files = self._files()
        counts = total(contents for _, contents in files).counts
        # Readers look in the files for the definition of each topic that metadata.yaml lists
        topics = [topic for topic, _ in self._topics.values() if counts[topic.name]]
        write_atomically(
            self.folder / 'metadata.yaml', metadata_yaml(bag_information(files, topics)))

    def __enter__(self) -> 'BagWriter':
        """Close the bag at the end of the block."""
        return self

    def __exit__(self, kind: type[BaseException] | None, value: BaseException | None,
                 trace: TracebackType | None) -> None:
        """Close the bag."""
        self.close()
