"""Files and folders in object stores, by the URLs of fsspec."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
import os
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from active_recon.errors import ActiveReconError, ConfigError, DataError, WorkError
from active_recon.whole_files import whole_file

PACKAGES = {'s3': 's3fs', 'gs': 'gcsfs', 'az': 'adlfs'}
"""The package that fsspec needs for the URLs of a scheme."""
_CHANGES = ('ETag', 'etag', 'md5Hash', 'LastModified', 'last_modified', 'mtime')


@dataclass(frozen=True)
class Entry:
    """What stands in a folder; `changed` is another text whenever a file's content is another."""

    name: str
    is_folder: bool
    size: int
    changed: str


@dataclass(frozen=True)
class Stored:
    """A file or folder in an object store; `url` has no slash at its end."""

    url: str

    def __str__(self) -> str:
        """Return the URL."""
        return self.url

    def __truediv__(self, name: str) -> 'Stored':
        """Return what has this name, or these names, in the folder."""
        return Stored(f'{self.url}/{name}')

    @property
    def name(self) -> str:
        """The last part of the URL."""
        return self.url.rpartition('/')[2]

    @property
    def parents(self) -> list['Stored']:
        """The folders that it is in, the nearest first, down to the bucket."""
        scheme, _, path = self.url.partition('://')
        parts = path.split('/')
        return [Stored(f'{scheme}://{"/".join(parts[:count])}')
                for count in range(len(parts) - 1, 0, -1)]

    def require_package(self) -> None:
        """Raise ConfigError where the package that reaches this store is not installed."""
        self._files()

    def exists(self) -> bool:
        """Return whether there is a file or a folder; raises DataError where it is not known."""
        with self._reading():
            return bool(self._files().exists(self.url))

    def is_dir(self) -> bool:
        """Return whether it is a folder: whether names of other files begin with it."""
        with self._reading():
            return bool(self._files().isdir(self.url))

    def entries(self) -> list[Entry]:
        """Return what stands in the folder, or the file itself; raises DataError if unreadable."""
        return [Entry(each['name'].rstrip('/').rpartition('/')[2], each['type'] == 'directory',
                      each['size'] or 0, str(next(filter(None, map(each.get, _CHANGES)), '')))
                for each in self._listing()]

    def matches(self) -> list['Stored']:
        """Return what a pattern with `*`, `?` and `**` matches."""
        scheme = self.url.partition('://')[0]
        with self._reading():
            return [Stored(f'{scheme}://{path}'.rstrip('/'))
                    for path in self._files().glob(self.url)]

    def fetch(self, folder: Path) -> Path:
        """Copy the file, or the folder with its files, into a folder; return the copy's path."""
        copy = folder / self.name
        found = [each['name'] for each in self._listing() if each['type'] != 'directory']
        with self._reading():
            if found == [self._path]:
                self._files().get_file(self.url, str(copy))
                return copy
            copy.mkdir()
            for path in found:
                self._files().get_file(path, str(copy / path.rpartition('/')[2]))
        return copy

    def read_text(self, encoding: str = 'utf-8') -> str:
        """Return a file's text; raises FileNotFoundError, and WorkError on other faults."""
        with self._working():
            return bytes(self._files().cat_file(self.url)).decode(encoding)

    def put(self, path: Path) -> None:
        """Copy a file to this place, where it appears at once and whole."""
        with self._working():
            self._files().put_file(str(path), self.url)

    def unlink(self, missing_ok: bool = False) -> None:
        """Remove a file."""
        try:
            with self._working():
                self._files().rm_file(self.url)
        except FileNotFoundError:
            if not missing_ok:
                raise

    @property
    def _path(self) -> str:
        """What the store's library calls it."""
        return self.url.partition('://')[2]

    def _listing(self) -> list[dict[str, Any]]:
        """Return what the store tells of the folder's entries, or of the file itself."""
        files = self._files()
        with self._reading():
            # The listing of a file would be looked for in that of its folder, however long
            if '.' in self.name and (found := files.info(self.url))['type'] == 'file':
                return [found]
            return [each for each in files.ls(self.url, detail=True)
                    if each['type'] != 'directory' or each['name'].rstrip('/') != self._path]

    def _files(self) -> Any:
        return _file_system(self.url.partition('://')[0])

    @contextmanager
    def _reading(self) -> Iterator[None]:
        """Let a fault refuse a bag; a second start tries it again."""
        try:
            yield
        except FileNotFoundError as error:
            raise DataError(f'{self}: no such file or folder in the store', 'not_seen') from error
        except (ConfigError, DataError):
            raise
        except Exception as error:  # each store's library has errors of its own
            raise DataError(f'{self}: cannot be read from {os.uname().nodename}: {error}',
                            'file') from error

    @contextmanager
    def _working(self) -> Iterator[None]:
        """Let a fault stop the work: without the folder of the results there is nothing to do."""
        try:
            yield
        except (FileNotFoundError, ConfigError):
            raise
        except Exception as error:  # likewise
            raise WorkError(f'{self}: cannot be reached from {os.uname().nodename}: {error}',
                            'store') from error


Place = Path | Stored
"""A file or folder, by its path or in an object store."""


@contextmanager
def whole(place: Place) -> Iterator[Path]:
    """
    Yield a path, the file at which takes its place once the block has ended, whole or not at all.

    Raises OSError where there is no room, WorkError where a store cannot be reached.
    """
    if isinstance(place, Path):
        place.parent.mkdir(parents=True, exist_ok=True)
        with whole_file(place) as unfinished:
            yield unfinished
        return
    with TemporaryDirectory() as folder:
        path = Path(folder) / place.name
        yield path
        place.put(path)


@contextmanager
def at_hand(place: Place) -> Iterator[Path]:
    """
    Yield the path of a file or folder; of one in a store that of a copy, which goes again.

    Errors of the block name the place, not the copy.
    """
    if isinstance(place, Path):
        yield place
        return
    with TemporaryDirectory() as folder:
        copy = place.fetch(Path(folder))
        try:
            yield copy
        except ActiveReconError as error:
            told = str(error).replace(str(copy), str(place))
            raise type(error)(told, error.kind) from error


@lru_cache
def _file_system(scheme: str) -> Any:
    import fsspec

    try:
        # Listings are not kept: memory would grow with the archive, and results appear meanwhile
        return fsspec.filesystem(scheme, use_listings_cache=False)
    except ImportError as error:
        package = PACKAGES[scheme]
        raise ConfigError(f'{scheme}://: no {package} on {os.uname().nodename}: expected it '
                          f'installed: pip install {package} ({error})') from error
