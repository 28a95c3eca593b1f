"""Writing the records of an MCAP file to a new file with an index."""

from pathlib import Path

from active_recon.bags.storage.chunk_file import ChunkFile
from mcap.records import Attachment, Channel, Header, McapRecord, Message, Metadata, Schema
from mcap.writer import Writer


class McapRewriter:
    """
    A new MCAP file with the records of another; raises OSError if the disk is full.

    A file that an earlier attempt left at `path` is overwritten. Messages of unknown channels
    are left out.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        path.unlink(missing_ok=True)
        self._chunks = ChunkFile(path)
        self._mcap = Writer(self._chunks, use_summary_offsets=False)  # type: ignore[arg-type]
        self._started = False
        self._schemas: dict[int, int] = {0: 0}
        self._channels: dict[int, int] = {}

    def add(self, record: McapRecord) -> None:
        """Write one record; they come in the order of the other file."""
        if isinstance(record, Header):
            self._start(record.profile, record.library)
        elif isinstance(record, Schema) and record.id not in self._schemas:
            self._schemas[record.id] = self._mcap.register_schema(
                record.name, record.encoding, record.data)
        elif isinstance(record, Channel) and record.id not in self._channels:
            self._channels[record.id] = self._mcap.register_channel(
                record.topic, record.message_encoding, self._schemas.get(record.schema_id, 0),
                record.metadata)
        elif isinstance(record, Message) and record.channel_id in self._channels:
            self._mcap.add_message(self._channels[record.channel_id], record.log_time,
                                   record.data, record.publish_time, record.sequence)
        elif isinstance(record, Metadata):
            self._mcap.add_metadata(record.name, record.metadata)
        elif isinstance(record, Attachment):
            self._mcap.add_attachment(record.create_time, record.log_time, record.name,
                                      record.media_type, record.data)
        self._chunks.flush()

    def finish(self) -> None:
        """Write the index; block until the file would survive a power cut."""
        if not self._started:
            self._start('ros2', 'active_recon')
        self._mcap.finish()  # type: ignore[no-untyped-call]
        self._chunks.end()

    def discard(self) -> None:
        """Close and delete the file."""
        self._chunks.close()
        self.path.unlink(missing_ok=True)

    def _start(self, profile: str, library: str) -> None:
        if not self._started:
            self._started = True
            self._mcap.start(profile, library)
