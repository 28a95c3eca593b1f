"""How fast a folder grows."""

from collections import deque
from pathlib import Path

WINDOW_S = 5.0


class DiskRate:
    """The size of a folder's files, and its rate of growth over the last WINDOW_S."""

    def __init__(self, folder: Path, now: float) -> None:
        self._folder = folder
        self._sizes = deque([(now, 0)])
        self._began = now

    def update(self, now: float) -> None:
        """Measure the size at a time, seconds of a monotonic clock."""
        try:
            size = sum(path.stat().st_size for path in self._folder.iterdir())
        except FileNotFoundError:  # a file was renamed meanwhile
            return
        self._sizes.append((now, size))
        while len(self._sizes) > 2 and self._sizes[1][0] <= now - WINDOW_S:
            self._sizes.popleft()

    @property
    def megabytes(self) -> float:
        """The size when it was last measured."""
        return self._sizes[-1][1] / 1e6

    @property
    def megabytes_per_s(self) -> float:
        """The rate of growth."""
        (begin, first), (end, last) = self._sizes[0], self._sizes[-1]
        return (last - first) / 1e6 / (end - begin) if end > begin else 0.0

    @property
    def seconds(self) -> float:
        """Time from the beginning to the last measurement."""
        return self._sizes[-1][0] - self._began
