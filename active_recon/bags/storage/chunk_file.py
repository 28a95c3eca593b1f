"""The file under the MCAP writer: after each flush it is one that readers open to its end."""

from contextlib import suppress
import fcntl
import os
from pathlib import Path

from mcap.data_stream import RecordBuilder
from mcap.records import DataEnd, Footer
from mcap.writer import MCAP0_MAGIC


class WholeChunks:
    """
    The stream under the MCAP writer: a flush reaches the file as a whole or not at all.

    After what was flushed stands an ending without a summary, which the next flush overwrites: a
    file whose writer was killed needs no repair to be read, only to be indexed. An ordinary
    buffered file would leave half a chunk behind where the disk is full, and would try to write
    the rest again when it is closed.
    """

    def __init__(self, path: Path) -> None:
        self._file = path.open('xb', buffering=0)
        with suppress(OSError):  # a disk that knows no locks; for who would repair the file
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        self._kept = 0
        self._pending = bytearray()

    @property
    def pending(self) -> bool:
        """Whether something waits for a flush."""
        return bool(self._pending)

    def tell(self) -> int:
        """Return the position in bytes, what waits included."""
        return self._kept + len(self._pending)

    def write(self, data: bytes) -> int:
        """Take bytes in until the next flush; return how many."""
        self._pending += data
        return len(data)

    def flush(self) -> None:
        """Write what waits; where that fails, OSError, and the file is as it was before."""
        if not self._pending:
            return
        self._put(self._pending + _ENDING)
        self._kept += len(self._pending)
        self._pending.clear()

    def sync(self) -> None:
        """Return when what was flushed would survive a power cut; OSError where it would not."""
        os.fsync(self._file.fileno())

    def end(self) -> None:
        """Write what waits as the file's own end, and close it; OSError as `flush`."""
        self._put(self._pending)
        self._pending.clear()
        self.sync()
        self.close()

    def close(self) -> None:
        """Close the file as it is."""
        self._file.close()

    def _put(self, data: bytes | bytearray) -> None:
        """Write after what is kept, over the ending; put the ending back where that fails."""
        try:
            self._write_at_end(data)
        except OSError:
            # On the bytes that it stood on: there was room for it before.
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
