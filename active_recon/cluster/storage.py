"""Paths that all machines of a cluster must see."""

from dataclasses import dataclass
from functools import cache
import os
from pathlib import Path
import uuid

from active_recon.errors import WorkError
from active_recon.whole_files import whole_file

_MARK = '.shared_folder'


@dataclass(frozen=True)
class SharedFolder:
    """
    A folder and what its mark says.

    A folder of the same path on a worker's own disk has another mark or none: without it, results
    would be written where nobody looks for them.
    """

    path: Path
    mark: str

    @classmethod
    def of(cls, path: Path) -> 'SharedFolder':
        """Return the folder, made and marked; a mark that is there already is kept."""
        path = path.resolve()
        path.mkdir(parents=True, exist_ok=True)
        mark = path / _MARK
        if not mark.is_file():
            with whole_file(mark) as unfinished:
                unfinished.write_text(f'{uuid.uuid4().hex}\n')
        return cls(path, mark.read_text())

    def forget(self) -> None:
        """Remove the mark."""
        (self.path / _MARK).unlink(missing_ok=True)

    def require(self) -> None:
        """Raise WorkError where this machine does not see the folder."""
        try:
            seen = (self.path / _MARK).read_text() == self.mark
        except OSError:
            seen = False
        if not seen:
            raise WorkError(_not_seen(self.path), 'not_seen')


@dataclass(frozen=True)
class Storage:
    """What workers must see: the folder that they write to, and what they read."""

    shared: SharedFolder | None
    reads: tuple[Path, ...]

    def require(self) -> None:
        """Raise WorkError where this machine does not see one of them."""
        _require(self)


@cache  # a worker that sees them is not asked again; one that does not stops the work
def _require(storage: Storage) -> None:
    if storage.shared is not None:
        storage.shared.require()
    for path in storage.reads:
        if not path.exists():
            raise WorkError(_not_seen(path), 'not_seen')


def _not_seen(path: Path) -> str:
    return (f'{path}: not seen by {os.uname().nodename}: expected it on storage that all machines '
            'of the cluster share')
