"""Reading what is intact of a damaged or incomplete MCAP file."""

from bisect import bisect_right
from collections.abc import Iterator
from contextlib import suppress
from os import SEEK_END
from pathlib import Path
import struct
from typing import BinaryIO
import zlib

from active_recon.bags.storage.mcap_file import chunk_records, RecordReader
from active_recon.errors import DataError
from mcap.reader import SeekingReader
from mcap.records import Chunk, DataEnd, Footer, Header, McapRecord
from mcap.summary import Summary
from mcap.writer import MCAP0_MAGIC

_FOOTER = struct.Struct('<QQI')  # where summary and summary offsets begin, and the checksum
_CHECKSUM_BYTES = 4


class Salvage:
    """
    The intact records of an MCAP file and, after they were read, the damage found.

    - lost: what could not be read, in words; empty if nothing was lost
    - indexed: whether the file ends as it should, with an index

    Raises DataError if the file is not MCAP.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.lost: list[str] = []
        self.indexed = False
        with path.open('rb') as file:
            beginning = file.read(len(MCAP0_MAGIC))
        if not MCAP0_MAGIC.startswith(beginning):
            raise DataError(f'{path}: no MCAP file: wrong magic bytes at its beginning',
                            'no_mcap')

    def records(self) -> Iterator[McapRecord]:
        """Yield header, schemas, channels, messages, metadata and attachments in file order."""
        self.lost.clear()
        self.indexed = False
        size = self.path.stat().st_size
        summary = self._summary()
        begins = sorted(each.chunk_start_offset for each in summary.chunk_indexes
                        ) if summary else []
        with self.path.open('rb') as file:
            reader = RecordReader(file, size, max_record_bytes=size, max_attachment_bytes=size,
                                  skip=self.lost.append)
            while reader.position < size:
                try:
                    yield from self._content(reader, summary)
                except OSError:
                    raise
                except Exception:  # the decoders raise all kinds of errors on damaged bytes
                    after = bisect_right(begins, reader.position)
                    end = begins[after] if after < len(begins) else size
                    if end > reader.position:
                        self.lost.append(f'{"the last " * (end == size)}{end - reader.position} '
                                         f'bytes, from byte {reader.position}')
                    reader.go_on(end, after)

    def _content(self, reader: RecordReader, summary: Summary | None) -> Iterator[McapRecord]:
        in_data = True
        for record in reader.records():
            if isinstance(record, Footer):
                self.indexed = record.summary_start > 0
            elif isinstance(record, DataEnd):
                in_data = False  # the summary repeats schemas and channels
            elif in_data and isinstance(record, Chunk):
                yield from self._chunk(record)
            elif in_data:
                yield record
            if isinstance(record, Header) and summary:  # a damaged chunk may hold them
                yield from (*summary.schemas.values(), *summary.channels.values())

    def _summary(self) -> Summary | None:
        """Return the file's summary, if it is intact."""
        with suppress(Exception), self.path.open('rb') as file:
            summary = SeekingReader(file, record_size_limit=self.path.stat().st_size).get_summary()
            if _is_summary_intact(file):
                return summary
        return None

    def _chunk(self, chunk: Chunk) -> list[McapRecord]:
        """Return the records of a chunk, all or none."""
        try:
            return list(chunk_records(chunk))
        except Exception as error:
            self.lost.append(f'a chunk of {len(chunk.data)} bytes ({error})')
            return []


def _is_summary_intact(file: BinaryIO) -> bool:
    """Return whether the summary of a file matches its checksum, if it has one."""
    file.seek(-_FOOTER.size - len(MCAP0_MAGIC), SEEK_END)
    start, _, checksum = _FOOTER.unpack(file.read(_FOOTER.size))
    file.seek(start)
    checked = file.read()[:-_CHECKSUM_BYTES - len(MCAP0_MAGIC)]
    return checksum in (0, zlib.crc32(checked))
