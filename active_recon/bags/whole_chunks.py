"""The file under the MCAP writer, which a full disk does not tear in the middle of a chunk."""

from pathlib import Path

from mcap.data_stream import RecordBuilder
from mcap.records import DataEnd, Footer
from mcap.writer import MCAP0_MAGIC


class WholeChunks:
    """
    The stream under the MCAP writer: a flush reaches the file as a whole or not at all.

    An ordinary buffered file would leave half a chunk behind where the disk is full, and would
    try to write the rest again when it is closed.
    """

    def __init__(self, path: Path) -> None:
        self._file = path.open('xb', buffering=0)
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
        written = 0
        try:
            while written < len(self._pending):
                written += self._file.write(self._pending[written:])
        except OSError:
            self._file.truncate(self._kept)
            raise
        self._kept += written
        self._pending.clear()

    def end(self) -> None:
        """Drop what was not flushed and end the file without a summary: readers then scan it."""
        self._file.truncate(self._kept)
        self._file.seek(self._kept)
        self._pending.clear()
        ending = RecordBuilder()
        DataEnd(data_section_crc=0).write(ending)
        Footer(summary_start=0, summary_offset_start=0, summary_crc=0).write(ending)
        self.write(ending.end() + MCAP0_MAGIC)  # type: ignore[no-untyped-call]
        self.flush()

    def close(self) -> None:
        """Close the file as it is."""
        self._file.close()
