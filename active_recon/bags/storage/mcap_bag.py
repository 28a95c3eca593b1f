"""A bag of one or several consecutive MCAP files."""

from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from active_recon.bags.storage.bag import bag_summary, BagSummary, RawMessage
from active_recon.bags.storage.compression import StoredFiles
from active_recon.bags.storage.mcap_file import mcap_records
from active_recon.bags.storage.message_types import require_standard
from active_recon.bags.storage.metadata import (
    Contents,
    parameters_node,
    PROVENANCE,
    qos_from_yaml,
    Topic,
    yaml_mapping,
)
from active_recon.errors import DataError
from active_recon.reporting import Advance, Reporting, silent
from mcap.records import Attachment, Channel, McapRecord, Message, Metadata, Schema

_Record = RawMessage | Metadata | Attachment


class McapBag:
    """Consecutive MCAP files of the bag at a path."""

    def __init__(self, path: Path, files: StoredFiles) -> None:
        self._path = path
        self._files = files

    def summary(self, reporting: Reporting = silent) -> BagSummary:
        """Return what is in the files, all of which are read."""
        size = sum(path.stat().st_size for path in self._files.paths)
        with reporting('checking the bag', size) as advance:
            return self._summary(advance)

    def _summary(self, advance: Advance) -> BagSummary:
        topics: dict[str, Topic] = {}
        contents = Contents()
        provenance: dict[str, str] = {}
        parameters: dict[str, Mapping[str, Any]] = {}
        for record in self._records(topics, advance):
            if isinstance(record, RawMessage):
                contents.add(record.topic, record.received)
            elif isinstance(record, Metadata) and record.name == PROVENANCE:
                provenance = record.metadata
            elif isinstance(record, Attachment) and (node := parameters_node(record.name)):
                parameters[node] = yaml_mapping(
                    record.data, f'{self._path}: {record.name}')
        return bag_summary(topics.values(), contents, provenance, parameters)

    def messages(self, topics: Collection[str]) -> Iterator[RawMessage]:
        """Yield the messages of the topics, file after file, in file order."""
        wanted = frozenset(topics)
        for record in self._records({}, lambda steps, note: None):
            if isinstance(record, RawMessage) and record.topic in wanted:
                yield record

    def _records(self, topics: dict[str, Topic], advance: Advance
                 ) -> Iterator[_Record]:
        """Yield the content of the files; their topics are added to `topics`."""
        with self._files.decompressed() as files:
            yield from new_in_bag(
                self._file_records(mcap_records(path, advance, name), name, topics)
                for name, path in zip(self._files.paths, files, strict=True))

    def _file_records(self, records: Iterator[McapRecord], name: Path, topics: dict[str, Topic]
                      ) -> Iterator[_Record]:
        schemas: dict[int, Schema] = {}
        channels: dict[int, Topic] = {}
        for record in records:
            if isinstance(record, Schema):
                if record.encoding == 'ros2msg':
                    record = replace(record, name=_full_name(record.name))
                    require_standard(record.name, record.data, name)
                schemas[record.id] = record
            elif isinstance(record, Channel):
                channels[record.id] = topics[record.topic] = Topic(
                    record.topic, _type_name(record, schemas),
                    qos_from_yaml(record.metadata.get('offered_qos_profiles', '')))
            elif isinstance(record, Message):
                if record.channel_id not in channels:
                    raise DataError(f'{name}: message of unknown channel {record.channel_id}',
                                    'damaged')
                topic = channels[record.channel_id]
                try:
                    data = self._files.decompressed_message(record.data)
                except DataError as error:
                    raise DataError(f'{name}: {error}', error.kind) from error
                yield RawMessage(topic.name, topic.type_name, data, record.log_time,
                                 record.publish_time or record.log_time)
            elif isinstance(record, Metadata | Attachment):
                yield record


def new_in_bag(files: Iterable[Iterator[_Record]]) -> Iterator[_Record]:
    """
    Yield the records of consecutive files without the messages that a file repeats.

    A repeated message is the last one of its topic, with the same bytes and publish time.
    """
    last: dict[str, tuple[int, bytes]] = {}
    for number, records in enumerate(files):
        for record in records:
            if isinstance(record, RawMessage):
                message = record.published, record.data
                if number and last.get(record.topic) == message:
                    continue
                last[record.topic] = message
            yield record


def _full_name(name: str) -> str:
    """Return a type's name as ROS 2 has it: other writers may leave `msg` out, as in ROS 1."""
    package, slash, kind = name.partition('/')
    return f'{package}/msg/{kind}' if slash and '/' not in kind else name


def _type_name(channel: Channel, schemas: Mapping[int, Schema]) -> str:
    schema = schemas.get(channel.schema_id)
    name = schema.name if schema else 'unknown'
    # Messages that are not CDR get the name of no type, so that nothing reads them.
    return name if channel.message_encoding == 'cdr' else f'{name} as {channel.message_encoding}'
