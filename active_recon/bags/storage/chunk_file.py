"""The output stream of the MCAP writer: after each flush the file is readable to its end."""

from contextlib import suppress
import errno
import fcntl
import os
from pathlib import Path

from mcap.data_stream import RecordBuilder
from mcap.records import DataEnd, Footer
from mcap.writer import MCAP0_MAGIC


class ChunkFile:
    """
    A stream for the MCAP writer whose flushes are atomic: all of the data is written, or none.

    Each flush appends a footer without a summary, which the next flush overwrites: the file of a
    writer that was killed is readable without repair and lacks only the index. An ordinary
    buffered file would leave half a chunk behind on a full disk, and would try to write the rest
    again when it is closed.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._file = path.open('xb', buffering=0)
        with suppress(OSError):  # keeps `bag repair` away, if the file system has locks
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        self._kept = 0
        self._pending = bytearray()

    def tell(self) -> int:
        """Return the position in bytes, buffered data included."""
        return self._kept + len(self._pending)

    def write(self, data: bytes) -> int:
        """Buffer bytes until the next flush; return their number."""
        self._pending += data
        return len(data)

    def flush(self) -> None:
        """Write the buffered bytes; on failure raise OSError and leave the file unchanged."""
        if not self._pending:
            return
        self._put(self._pending + _ENDING)
        self._kept += len(self._pending)
        self._pending.clear()

    def sync(self) -> None:
        """
        Block until the flushed bytes would survive a power cut; raises OSError.

        That is FileNotFoundError where the file was deleted, into which writing still succeeds.
        """
        os.fsync(self._file.fileno())
        if not os.fstat(self._file.fileno()).st_nlink and not self._path.exists():
            raise FileNotFoundError(errno.ENOENT, 'it was deleted')

    def end(self) -> None:
        """Write the buffered bytes, which end the file, and close it; raises OSError."""
        self._put(self._pending)
        self._pending.clear()
        self.sync()
        self.close()

    def close(self) -> None:
        """Close the file as it is."""
        self._file.close()

    def _put(self, data: bytes | bytearray) -> None:
        """Write after the flushed bytes, over the footer; restore the footer on failure."""
        try:
            self._write_at_end(data)
        except OSError:
            # In its old place: there was room for it before.
            self._write_at_end(_ENDING)
            self._file.truncate(self._kept + len(_ENDING))
            raise

    def _write_at_end(self, data: bytes | bytearray) -> None:
        self._file.seek(self._kept)
        written = 0
        while written < len(data):
            written += self._file.write(data[written:])


def _ending() -> bytes:
    builder = RecordBuilder()
    DataEnd(data_section_crc=0).write(builder)
    Footer(summary_start=0, summary_offset_start=0, summary_crc=0).write(builder)
    return bytes(builder.end()) + MCAP0_MAGIC  # type: ignore[no-untyped-call]


_ENDING = _ending()
