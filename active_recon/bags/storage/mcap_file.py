"""Reading MCAP files record by record; every length is checked before memory is allocated."""

from collections.abc import Callable, Iterator
from io import BytesIO
from pathlib import Path
import struct
from typing import BinaryIO
import zlib

from active_recon.bags.storage.metadata import parameters_node
from active_recon.errors import DataError
from active_recon.reporting import Advance
from lz4.frame import LZ4FrameDecompressor
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
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
    Statistics,
)
from mcap.writer import MCAP0_MAGIC
from zstandard import ZstdDecompressor

MAX_RECORD_BYTES = 1 << 28
"""Larger records and decompressed chunks are rejected: no camera makes such messages."""
MAX_ATTACHMENT_BYTES = 1 << 20
"""Larger attachments are skipped: parameters are far smaller."""
_HEAD_BYTES = 9  # an opcode and a length
_MIN_MESSAGE_BYTES = 22
_REPAIR = '`active-recon bag repair` keeps all that is intact'
_Parser = Callable[[ReadDataStream], McapRecord]
_IN_CHUNK: dict[int, _Parser] = {Opcode.SCHEMA: Schema.read, Opcode.CHANNEL: Channel.read}
_PARSERS: dict[int, _Parser] = {
    **_IN_CHUNK, Opcode.HEADER: Header.read, Opcode.CHUNK: Chunk.read,
    Opcode.METADATA: Metadata.read, Opcode.ATTACHMENT: Attachment.read,
    Opcode.STATISTICS: Statistics.read,
    Opcode.DATA_END: DataEnd.read, Opcode.FOOTER: Footer.read}


def mcap_records(path: Path, advance: Advance, name: Path | None = None) -> Iterator[McapRecord]:
    """
    Yield the records of a file in file order, chunks opened; indexes are skipped.

    `advance` is called with the number of bytes read. `name` is the path to show in errors, if
    it differs from `path`. Raises DataError if the file is not a complete MCAP file or a chunk
    does not match its checksum.
    """
    name = name or path
    try:
        with path.open('rb') as file:
            for record in RecordReader(file, path.stat().st_size, advance).records():
                if isinstance(record, Chunk):
                    yield from chunk_records(record)
                else:
                    yield record
    except DataError as error:
        raise DataError(f'{name}: {error}', error.kind) from error
    except OSError as error:
        raise DataError(f'{name}: cannot be read: {error.strerror}') from error
    except Exception as error:  # the decoders raise all kinds of errors on damaged bytes
        raise DataError(f'{name}: damaged: it has records that cannot be understood '
                        f'({str(error) or type(error).__name__}); {_REPAIR}', 'damaged') from error


class RecordReader:
    """
    Reads the top-level records of an MCAP file from its beginning.

    `size` is the file's, in bytes. `position` is the end of the last complete record. `skip` is
    told in words of each record that cannot be understood, which is then left out, and of chunks
    that are not there; None: that ends the reading with its error.
    """

    def __init__(self, file: BinaryIO, size: int,
                 advance: Advance = lambda steps, note: None,
                 max_record_bytes: int = MAX_RECORD_BYTES,
                 max_attachment_bytes: int = MAX_ATTACHMENT_BYTES,
                 skip: Callable[[str], None] | None = None) -> None:
        self.position = 0
        self._chunks = 0
        self._file = file
        self._size = size
        self._advance = advance
        self._max_record_bytes = max_record_bytes
        self._max_attachment_bytes = max_attachment_bytes
        self._skip = skip

    def records(self) -> Iterator[McapRecord]:
        """
        Yield header, schemas, channels, messages, chunks, metadata, attachments and footer.

        They are those from `position` on. Raises DataError if the file is not MCAP, or ends before
        its footer and magic bytes.
        """
        self._file.seek(self.position)
        if not self.position and self._file.read(len(MCAP0_MAGIC)) != MCAP0_MAGIC:
            raise DataError('no MCAP file: wrong magic bytes at its beginning', 'no_mcap')
        self.position = self._file.tell()
        for opcode, length in _heads(self._file, self._size):
            self._advance(_HEAD_BYTES + length, '')
            self._chunks += opcode == Opcode.CHUNK
            wanted = opcode == Opcode.MESSAGE or opcode in _PARSERS
            if not wanted or (
                    opcode == Opcode.ATTACHMENT and length > self._max_attachment_bytes):
                continue
            begin = self._file.tell()
            try:
                record = _parse(opcode, self._file, length, self._max_record_bytes)
            except Exception as error:  # the decoders raise all kinds of errors on damaged bytes
                if self._skip is None:
                    raise
                self._skip(f'a record of {length} bytes, from byte {begin} '
                           f'({str(error) or type(error).__name__})')
                continue
            self.position = self._file.tell()
            if isinstance(record, Statistics):
                self._require_chunks(record.chunk_count - self._chunks)
                continue
            if isinstance(record, Footer):
                if self._file.read() != MCAP0_MAGIC:
                    break
                self.position = self._size
                self._advance(2 * len(MCAP0_MAGIC), '')
                yield record
                return
            yield record
        raise DataError(f'incomplete: its end is missing, as after a killed recorder; {_REPAIR}',
                        'truncated')

    def go_on(self, position: int, chunks: int) -> None:
        """Go on at the beginning of a record, so many chunks after the first, with `records`."""
        self.position, self._chunks = position, chunks

    def _require_chunks(self, missing: int) -> None:
        """Tell of chunks that the index counts: what says that a record is one may be damaged."""
        if missing > 0:
            lost = f'{missing} of the chunks that its index counts'
            if self._skip is None:
                raise DataError(f'damaged: it lacks {lost}; {_REPAIR}', 'damaged')
            self._skip(lost)


def chunk_records(chunk: Chunk) -> Iterator[McapRecord]:
    """
    Yield the schemas, channels and messages of a chunk.

    Raises DataError if it is too large or does not match its checksum.
    """
    data = _decompressed(chunk)
    stream = BytesIO(data)
    for opcode, length in _heads(stream, len(data)):
        if opcode == Opcode.MESSAGE or opcode in _IN_CHUNK:
            yield _parse(opcode, stream, length, MAX_RECORD_BYTES)


def _heads(stream: BinaryIO, end: int) -> Iterator[tuple[int, int]]:
    """Yield the opcode and length of each record, with the stream at its content."""
    following = stream.tell()
    while following < end:
        stream.seek(following)
        head = stream.read(_HEAD_BYTES)
        opcode, length = struct.unpack('<BQ', head) if len(head) == _HEAD_BYTES else (0, 0)
        left = end - stream.tell()
        if len(head) < _HEAD_BYTES or length > left:
            raise DataError(f'cut off at byte {following}: a record there claims {length} bytes, '
                            f'{left} are left; {_REPAIR}', 'truncated')
        following = stream.tell() + length
        yield opcode, length


def _parse(opcode: int, stream: BinaryIO, length: int, max_bytes: int) -> McapRecord:
    if length > max_bytes:
        raise DataError(f'record too large: expected at most {max_bytes} bytes, got {length}',
                        'too_large')
    data = stream.read(length)
    content = ReadDataStream(BytesIO(data))
    if opcode != Opcode.MESSAGE:
        record = _PARSERS[opcode](content)
        # Other attachments are not read, and their writers may reckon otherwise
        if isinstance(record, Attachment) and parameters_node(record.name) and int.from_bytes(
                data[-4:], 'little') not in (0, zlib.crc32(data[:-4])):
            raise DataError(f'damaged attachment {record.name}: its {length} bytes do not match '
                            f'their checksum; {_REPAIR}', 'damaged')
        return record
    if length < _MIN_MESSAGE_BYTES:
        raise DataError(f'damaged message: expected at least {_MIN_MESSAGE_BYTES} bytes, got '
                        f'{length}', 'damaged')
    message: Message = Message.read(content, length)
    return message


def _decompressed(chunk: Chunk) -> bytes:
    size = chunk.uncompressed_size
    if size > MAX_RECORD_BYTES:
        raise DataError(f'chunk too large: expected at most {MAX_RECORD_BYTES} bytes, got a '
                        f'claim of {size}', 'too_large')
    if chunk.compression == 'zstd':
        data = ZstdDecompressor().stream_reader(chunk.data).read(size + 1)
    elif chunk.compression == 'lz4':
        data = LZ4FrameDecompressor().decompress(chunk.data, max_length=size + 1)
    elif chunk.compression == '':
        data = chunk.data
    else:
        raise DataError('unknown chunk compression: expected zstd, lz4 or none, got '
                        f'{chunk.compression!r}', 'compression')
    if len(data) != size or chunk.uncompressed_crc not in (0, zlib.crc32(data)):
        raise DataError(f'damaged chunk: its {size} bytes do not match their checksum; {_REPAIR}',
                        'damaged')
    return bytes(data)
