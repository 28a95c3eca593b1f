"""A recording in MCAP, of one file or of several that follow each other."""

from collections.abc import Collection, Iterator, Mapping
from pathlib import Path
from typing import Any

from active_recon.bags.mcap_file import mcap_records
from active_recon.bags.message_types import require_standard
from active_recon.bags.metadata import (
    Contents,
    parameters_node,
    PROVENANCE,
    yaml_mapping,
)
from active_recon.bags.raw import bag_summary, BagSummary, RawMessage
from active_recon.errors import DataError
from active_recon.reporting import Advance, Reporting, silent
from mcap.records import Attachment, Channel, Message, Metadata, Schema


class McapBag:
    """MCAP files that follow each other in the recording of that path."""

    def __init__(self, path: Path, files: list[Path]) -> None:
        self._path = path
        self._files = files

    def summary(self, reporting: Reporting = silent) -> BagSummary:
        """Read all of the files and say what is in them."""
        size = sum(path.stat().st_size for path in self._files)
        with reporting('checking the bag', size) as advance:
            return self._summary(advance)

    def _summary(self, advance: Advance) -> BagSummary:
        types: dict[str, str] = {}
        contents = Contents()
        provenance: dict[str, str] = {}
        parameters: dict[str, Mapping[str, Any]] = {}
        for record in self._records(types, advance):
            if isinstance(record, RawMessage):
                contents.add(record.topic, record.received)
            elif isinstance(record, Metadata) and record.name == PROVENANCE:
                provenance = record.metadata
            elif isinstance(record, Attachment) and (node := parameters_node(record.name)):
                parameters[node] = yaml_mapping(
                    record.data, f'{self._path}: {record.name}')
        return bag_summary(types, contents, provenance, parameters)

    def messages(self, topics: Collection[str]) -> Iterator[RawMessage]:
        """Yield the messages of the topics, file after file, each in its order."""
        wanted = frozenset(topics)
        for record in self._records({}, lambda steps, note: None):
            if isinstance(record, RawMessage) and record.topic in wanted:
                yield record

    def _records(self, types: dict[str, str], advance: Advance
                 ) -> Iterator[RawMessage | Metadata | Attachment]:
        """Yield what the files hold; `types` gathers the topics and their types."""
        for path in self._files:
            schemas: dict[int, Schema] = {}
            channels: dict[int, tuple[str, str]] = {}
            for record in mcap_records(path, advance):
                if isinstance(record, Schema):
                    schemas[record.id] = record
                    if record.encoding == 'ros2msg':
                        require_standard(record.name, record.data, path)
                elif isinstance(record, Channel):
                    channels[record.id] = record.topic, _type_name(record, schemas)
                    types[record.topic] = channels[record.id][1]
                elif isinstance(record, Message):
                    if record.channel_id not in channels:
                        raise DataError(f'{path}: expected messages of announced channels, got '
                                        f'one of channel {record.channel_id}', 'damaged')
                    yield RawMessage(*channels[record.channel_id], record.data, record.log_time,
                                     record.publish_time or record.log_time)
                elif isinstance(record, Metadata | Attachment):
                    yield record


def _type_name(channel: Channel, schemas: Mapping[int, Schema]) -> str:
    schema = schemas.get(channel.schema_id)
    name = schema.name if schema else 'unknown'
    # What is not CDR bears a name that no type has, and is so read by nobody.
    return name if channel.message_encoding == 'cdr' else f'{name} as {channel.message_encoding}'
