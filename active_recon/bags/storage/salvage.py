"""What can still be read from an MCAP file, however it ends."""

from collections.abc import Iterator
from pathlib import Path
import struct
from typing import BinaryIO

from active_recon.errors import DataError
from mcap.exceptions import McapError
from mcap.records import (
    Attachment,
    Channel,
    Chunk,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    Message,
    Metadata,
    Schema,
)
from mcap.stream_reader import breakup_chunk, StreamReader
from mcap.writer import MCAP0_MAGIC
import zstandard

_BROKEN = (McapError, ValueError, RuntimeError, OverflowError, MemoryError, struct.error,
           zstandard.ZstdError)
_CONTENT = (Header, Schema, Channel, Message, Metadata, Attachment)


class Salvage:
    """
    The whole records of an MCAP file, and once they are read, what was wrong with it.

    - lost: what could not be read, in words; empty where nothing was lost
    - indexed: whether the file ends as it should, with an index

    Raises DataError where the file is no MCAP at all.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.lost: list[str] = []
        self.indexed = False
        with path.open('rb') as file:
            begins = file.read(len(MCAP0_MAGIC))
        if not MCAP0_MAGIC.startswith(begins):
            raise DataError(f'{path}: no MCAP file: it begins otherwise',
                            'no_mcap')

    def records(self) -> Iterator[McapRecord]:
        """Yield header, schemas, channels, messages, metadata and attachments in file order."""
        self.lost.clear()
        with self.path.open('rb') as file:
            whole = _WholeReads(file, self.path.stat().st_size)
            try:
                yield from self._content(whole)
            except _BROKEN:
                if whole.size > whole.kept:
                    self.lost.append(f'the end, {whole.size - whole.kept} bytes from byte '
                                     f'{whole.kept} on')

    def _content(self, whole: '_WholeReads') -> Iterator[McapRecord]:
        reader = StreamReader(
            whole, emit_chunks=True, record_size_limit=None)  # type: ignore[arg-type]
        in_data = True
        for record in reader.records:
            whole.keep()
            if isinstance(record, Chunk):
                yield from self._opened(record)
            elif isinstance(record, DataEnd):
                in_data = False  # what follows repeats what was there
            elif isinstance(record, Footer):
                self.indexed = record.summary_start > 0
            elif in_data and isinstance(record, _CONTENT):
                yield record

    def _opened(self, chunk: Chunk) -> Iterator[McapRecord]:
        try:
            yield from breakup_chunk(chunk, validate_crc=True)
        except _BROKEN as error:
            self.lost.append(f'a chunk of {len(chunk.data)} bytes ({error})')


class _WholeReads:
    """A stream that ends where a read would: what is cut off is not read in part."""

    def __init__(self, file: BinaryIO, size: int) -> None:
        self.size = size
        self.kept = 0
        """The bytes that were read and understood."""
        self._file = file

    def keep(self) -> None:
        """Note that what was read so far was understood."""
        self.kept = self._file.tell()

    def read(self, count: int) -> bytes:
        return self._file.read(count) if count <= self.size - self._file.tell() else b''
