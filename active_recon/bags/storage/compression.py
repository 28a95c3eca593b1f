"""Decompression of bags that rosbag2 compressed by file or by message, with a size limit."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from active_recon.bags.storage.mcap_file import MAX_RECORD_BYTES
from active_recon.errors import DataError
from zstandard import frame_content_size, FRAME_HEADER, ZstdDecompressor, ZstdError

MAX_COMPRESSION_RATIO = 200
"""The largest ratio of decompressed to compressed size that is accepted for a file larger than
MAX_RECORD_BYTES once decompressed: images of one colour reach about a hundred."""
COMPRESSION_MODES = ('', 'file', 'message')
_BLOCK_BYTES = 1 << 20


@dataclass(frozen=True)
class StoredFiles:
    """
    The files of a bag in their order, and their compression: one of COMPRESSION_MODES.

    Messages that are compressed, each by itself, are known as such without being told.
    """

    paths: Sequence[Path]
    compression_mode: str = ''

    @contextmanager
    def decompressed(self) -> Iterator[list[Path]]:
        """
        Yield the files to read, one for each path; compressed ones as temporary copies.

        Raises DataError if one is not compressed by zstd, or is too large once decompressed.
        """
        if self.compression_mode != 'file':
            yield list(self.paths)
            return
        with TemporaryDirectory() as folder:
            yield [_decompressed_file(path, Path(folder)) for path in self.paths]

    def decompressed_message(self, data: bytes) -> bytes:
        """Return the bytes of a stored message; raises DataError as `decompressed` does."""
        if self.compression_mode != 'message' and not is_packed(data):
            return data
        try:
            declared = frame_content_size(data)  # -1: unknown
            limit = min(declared, MAX_RECORD_BYTES) if declared >= 0 else MAX_RECORD_BYTES
            message = ZstdDecompressor().stream_reader(data).read(limit + 1)
        except ZstdError as error:
            raise DataError(f'damaged message: expected zstd compression ({error})',
                            'damaged') from error
        if declared > limit or len(message) > limit:
            raise DataError(f'message too large: its {len(data)} bytes decompress to more than '
                            f'{limit}', 'too_large')
        if len(message) < declared:
            raise DataError(f'damaged message: expected {declared} bytes once decompressed, got '
                            f'{len(message)}', 'damaged')
        return message


def is_packed(message: bytes) -> bool:
    """Return whether the bytes of a message are compressed: CDR never begins like that."""
    return message.startswith(FRAME_HEADER)


def _decompressed_file(path: Path, folder: Path) -> Path:
    decompressed = folder / path.stem
    limit = max(MAX_RECORD_BYTES, MAX_COMPRESSION_RATIO * path.stat().st_size)
    size = 0
    try:
        with (path.open('rb') as file, decompressed.open('wb') as out,
              ZstdDecompressor().stream_reader(file, read_across_frames=True) as reader):
            while block := reader.read(_BLOCK_BYTES):
                size += len(block)
                if size > limit:
                    raise DataError(f'{path}: too large: decompresses to more than {limit} bytes',
                                    'too_large')
                out.write(block)
    except ZstdError as error:
        raise DataError(f'{path}: damaged: expected zstd compression ({error})',
                        'damaged') from error
    except OSError as error:
        raise DataError(f'{path}: cannot be decompressed: {error.strerror}') from error
    return decompressed
