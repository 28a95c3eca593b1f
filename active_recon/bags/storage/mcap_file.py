"""MCAP files read record by record; no length is believed before the bytes are there."""

from collections.abc import Callable, Iterator
from io import BytesIO
from pathlib import Path
import struct
from typing import BinaryIO
import zlib

from active_recon.errors import DataError
from active_recon.reporting import Advance
from lz4.frame import LZ4FrameDecompressor
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Chunk, McapRecord, Message, Metadata, Schema
from mcap.writer import MCAP0_MAGIC
from zstandard import ZstdDecompressor

MOST_BYTES = 1 << 28
"""A record or an unpacked chunk of more is refused: no camera makes such messages."""
MOST_ATTACHED = 1 << 20
"""Attachments of more are passed over: parameters are far smaller."""
_HEAD = 9  # bytes: an opcode and a length
_Reader = Callable[[ReadDataStream], McapRecord]
_CHUNKED: dict[Opcode, _Reader] = {Opcode.SCHEMA: Schema.read, Opcode.CHANNEL: Channel.read}
_READ: dict[Opcode, _Reader] = {
    **_CHUNKED, Opcode.CHUNK: Chunk.read, Opcode.METADATA: Metadata.read,
    Opcode.ATTACHMENT: Attachment.read}


def mcap_records(path: Path, advance: Advance, name: Path | None = None) -> Iterator[McapRecord]:
    """
    Yield the schemas, channels, messages, metadata and attachments of a file, in its order.

    The index is not used, so that it cannot mislead. `advance` is told the bytes. `name` is what
    a person knows the file by, where it is another. Raises DataError where the file is no whole
    MCAP file or a chunk is not what its checksum says.
    """
    name = name or path
    try:
        with path.open('rb') as file:
            yield from _file_records(file, path.stat().st_size, advance)
    except DataError as error:
        raise DataError(f'{name}: {error}', error.kind) from error
    except OSError as error:
        raise DataError(f'{name}: cannot be read: {error.strerror}') from error
    except Exception as error:  # the decoders raise whatever damaged bytes lead them to
        raise DataError(f'{name}: damaged: it has records that cannot be understood '
                        f'({str(error) or type(error).__name__}); `active-recon bag '
                        'repair` keeps the others', 'damaged') from error


def _file_records(file: BinaryIO, size: int, advance: Advance) -> Iterator[McapRecord]:
    if file.read(len(MCAP0_MAGIC)) != MCAP0_MAGIC:
        raise DataError('no MCAP file: it begins otherwise', 'no_mcap')
    for opcode, length in _heads(file, size):
        advance(_HEAD + length, '')
        if opcode == Opcode.FOOTER:
            file.seek(length, 1)
            if file.read() == MCAP0_MAGIC:
                advance(2 * len(MCAP0_MAGIC), '')
                return
            break
        if opcode == Opcode.MESSAGE or opcode in _READ:
            if opcode == Opcode.ATTACHMENT and length > MOST_ATTACHED:
                continue
            record = _record(opcode, file, length)
            if isinstance(record, Chunk):
                yield from _chunk_records(record)
            else:
                yield record
    raise DataError('its end is missing, as where a recorder was killed; `active-recon bag '
                    'repair` keeps all that is whole', 'truncated')


def _chunk_records(chunk: Chunk) -> Iterator[McapRecord]:
    data = _unpacked(chunk)
    stream = BytesIO(data)
    for opcode, length in _heads(stream, len(data)):
        if opcode == Opcode.MESSAGE or opcode in _CHUNKED:
            yield _record(opcode, stream, length)


def _heads(stream: BinaryIO, end: int) -> Iterator[tuple[int, int]]:
    """Yield each record's opcode and length, the stream at its content."""
    following = stream.tell()
    while following < end:
        stream.seek(following)
        head = stream.read(_HEAD)
        opcode, length = struct.unpack('<BQ', head) if len(head) == _HEAD else (0, 0)
        left = end - stream.tell()
        if len(head) < _HEAD or length > left:
            raise DataError(
                f'cut off at byte {following}: a record there claims {length} bytes and {left} '
                f'are left; `active-recon bag repair` keeps all that is whole',
                'truncated')
        following = stream.tell() + length
        yield opcode, length


def _record(opcode: int, stream: BinaryIO, length: int) -> McapRecord:
    if length > MOST_BYTES:
        raise DataError(f'a record of {length} bytes: expected at most {MOST_BYTES}',
                        'too_large')
    content = ReadDataStream(BytesIO(stream.read(length)))
    if opcode != Opcode.MESSAGE:
        return _READ[Opcode(opcode)](content)
    if length < 22:
        raise DataError(f'a message of {length} bytes: expected at least 22', 'damaged')
    message: Message = Message.read(content, length)
    return message


def _unpacked(chunk: Chunk) -> bytes:
    size = chunk.uncompressed_size
    if size > MOST_BYTES:
        raise DataError(f'a chunk that claims {size} bytes: expected at most {MOST_BYTES}',
                        'too_large')
    if chunk.compression == 'zstd':
        data = ZstdDecompressor().stream_reader(chunk.data).read(size + 1)
    elif chunk.compression == 'lz4':
        data = LZ4FrameDecompressor().decompress(chunk.data, max_length=size + 1)
    elif chunk.compression == '':
        data = chunk.data
    else:
        raise DataError(f'a chunk packed by {chunk.compression!r}: expected zstd, lz4 or '
                        'nothing', 'compression')
    if len(data) != size or chunk.uncompressed_crc not in (0, zlib.crc32(data)):
        raise DataError(f'a chunk of {size} bytes is not as it was written, {len(data)} bytes '
                        'without its checksum; `active-recon bag repair` keeps '
                        'the others', 'damaged')
    return bytes(data)
