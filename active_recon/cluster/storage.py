"""Paths and places in object stores that all machines of a cluster must see."""

from dataclasses import dataclass
from functools import cache
import os
from pathlib import Path
import uuid

from active_recon.cluster.stores import Place, whole
from active_recon.errors import ActiveReconError, WorkError

_MARK = '.shared_folder-'


@dataclass(frozen=True)
class SharedFolder:
    """
    A folder and the name of its mark, a file in it that only this work has.

    A folder of the same path on a worker's own disk has no such mark: without it, results would be
    written where nobody looks for them.
    """

    place: Place
    mark: str

    @classmethod
    def of(cls, place: Place) -> 'SharedFolder':
        """Return the folder, made and marked."""
        place = place.resolve() if isinstance(place, Path) else place
        folder = cls(place, f'{_MARK}{uuid.uuid4().hex}')
        with whole(place / folder.mark) as unfinished:
            unfinished.write_text('active_recon\n')  # not every store keeps files of no bytes
        return folder

    def forget(self) -> None:
        """Remove the mark."""
        (self.place / self.mark).unlink(missing_ok=True)

    def require(self) -> None:
        """Raise WorkError where this machine does not see the folder."""
        try:
            (self.place / self.mark).read_text()
        except OSError as error:
            raise WorkError(_not_seen(self.place), 'not_seen') from error


@dataclass(frozen=True)
class Storage:
    """What workers must see: the folder that they write to, and what they read."""

    shared: SharedFolder | None
    reads: tuple[Place, ...]

    def require(self) -> None:
        """Raise WorkError where this machine does not see one of them."""
        _require(self)


@cache  # a worker that sees them is not asked again; one that does not stops the work
def _require(storage: Storage) -> None:
    if storage.shared is not None:
        storage.shared.require()
    for place in storage.reads:
        try:
            seen = place.exists()
        except ActiveReconError as error:  # of a store: no package, or no permission
            raise WorkError(f'{_not_seen(place)}, got: {error}', 'not_seen') from error
        if not seen:
            raise WorkError(_not_seen(place), 'not_seen')


def _not_seen(path: Place) -> str:
    return (f'{path}: not seen by {os.uname().nodename}: expected it on storage that all machines '
            'of the cluster share')
