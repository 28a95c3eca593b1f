"""Photos that arrive in a folder, once each of them is whole."""

from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from active_recon.calibration.files import in_order
from active_recon.errors import DataError
from active_recon.photos.files import photos_in

SETTLED_S = 0.8
"""A file is whole once it has not changed for so long, seconds."""
EMPTY_S = 10.0
"""The same of a file without bytes: copies may be that at first, and one that failed stays so."""


@dataclass
class _Seen:
    size: int
    changed: int  # nanoseconds, by the file system
    since: float
    told: bool = False


class Arrivals:
    """
    Tells which photos of a folder have come, changed or gone.

    Photos are those of `photos_in`: what programs that synchronise folders have not whole yet they
    keep as hidden files, or under other endings. While the folder cannot be read nothing comes or
    goes, and `away` says why; else it is ''. Raises DataError where there is no such folder.
    """

    def __init__(self, folder: Path) -> None:
        if not folder.is_dir():
            raise DataError(f'{folder}: no such folder: expected one where photos will '
                            'arrive; mkdir makes it',
                            'no_photos')
        self._folder = folder
        self.away = ''
        self._known: dict[Path, _Seen] = {}

    def gone(self) -> list[Path]:
        """Return photos that were told of and are no longer as they were."""
        there = self._files()
        gone = [path for path, seen in self._known.items() if seen.told and not self.away
                and there.get(path) != (seen.size, seen.changed)]
        for path in gone:
            del self._known[path]
        return gone

    def arrived(self, now: float) -> list[Path]:
        """
        Return the photos that have become whole, the oldest first, 2 before 10 of the same age.

        `now` is any clock in seconds, the same at each call.
        """
        whole = []
        for path, (size, changed) in self._files().items():
            seen = self._known.get(path)
            if seen is None or (seen.size, seen.changed) != (size, changed):
                self._known[path] = _Seen(size, changed, now)
            elif not seen.told and now - seen.since >= (SETTLED_S if size else EMPTY_S):
                seen.told = True
                whole.append(path)
        return sorted(whole, key=lambda path: (self._known[path].changed, in_order(path)))

    def _files(self) -> dict[Path, tuple[int, int]]:
        """Return the size of each photo and the time of its last change; none while `away`."""
        found = {}
        try:
            paths = photos_in(self._folder)
            self.away = ''
        except OSError as error:
            paths = []
            self.away = f'{self._folder}: cannot be read: {error.strerror}'
        for path in paths:
            with suppress(OSError):  # gone since
                status = path.stat()
                found[path] = status.st_size, status.st_mtime_ns
        return found
