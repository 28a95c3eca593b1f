"""What rosbag2 itself has packed, by file or by message, unpacked to no more than is stated."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from active_recon.bags.storage.mcap_file import MOST_BYTES
from active_recon.errors import DataError
from zstandard import frame_content_size, ZstdDecompressor, ZstdError

MOST_TIMES = 200
"""A packed file may unpack to so many times its bytes, and to MOST_BYTES in any case: images of
one colour come to about a hundred."""
PACKINGS = ('', 'file', 'message')
_PIECE = 1 << 20


@dataclass(frozen=True)
class StoredFiles:
    """The files of a recording in their order, and how rosbag2 packed them: one of PACKINGS."""

    paths: Sequence[Path]
    packed: str = ''

    @contextmanager
    def opened(self) -> Iterator[list[Path]]:
        """
        Yield files that can be read, as many; packed ones are unpacked to the disk meanwhile.

        Raises DataError where one is not packed by zstd, or unpacks to more than is allowed.
        """
        if self.packed != 'file':
            yield list(self.paths)
            return
        with TemporaryDirectory() as folder:
            yield [_unpacked_file(path, Path(folder)) for path in self.paths]

    def message(self, data: bytes) -> bytes:
        """Return a stored message's bytes unpacked; raises DataError as `opened` does."""
        if self.packed != 'message':
            return data
        try:
            declared = frame_content_size(data)  # -1: it does not tell
            most = min(declared, MOST_BYTES) if declared >= 0 else MOST_BYTES
            unpacked = ZstdDecompressor().stream_reader(data).read(most + 1)
        except ZstdError as error:
            raise DataError(f'a message that is not packed by zstd as it claims ({error})',
                            'damaged') from error
        if declared > most or len(unpacked) > most:
            raise DataError(f'a message of {len(data)} bytes that unpacks to more than {most}',
                            'too_large')
        return unpacked


def _unpacked_file(path: Path, folder: Path) -> Path:
    unpacked = folder / path.stem
    most = max(MOST_BYTES, MOST_TIMES * path.stat().st_size)
    size = 0
    try:
        with (path.open('rb') as file, unpacked.open('wb') as out,
              ZstdDecompressor().stream_reader(file, read_across_frames=True) as reader):
            while piece := reader.read(_PIECE):
                size += len(piece)
                if size > most:
                    raise DataError(f'{path}: unpacks to more than {most} bytes', 'too_large')
                out.write(piece)
    except ZstdError as error:
        raise DataError(f'{path}: not packed by zstd as its name says ({error})',
                        'damaged') from error
    except OSError as error:
        raise DataError(f'{path}: cannot be unpacked: {error.strerror}') from error
    return unpacked
