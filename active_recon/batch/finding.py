"""The bags in folders, trees and patterns."""

from collections.abc import Iterator, Sequence
from glob import glob, has_magic
import os
from pathlib import Path
import re
from urllib.parse import unquote, urlsplit

from active_recon.cluster.stores import PACKAGES, Place, Stored
from active_recon.errors import ConfigError, DataError

_SUFFIXES = ('.mcap', '.db3', '.mcap.zstd', '.db3.zstd')


def place_of(text: str) -> Place:
    """
    Return the absolute path of a path or a file:// URL, or a place in an object store.

    Raises ConfigError on other URLs, and where the store's package is not installed.
    """
    if not re.match(r'[A-Za-z][A-Za-z0-9+.-]+:/', text):
        return Path(text).absolute()
    url = urlsplit(text)
    if url.scheme in PACKAGES and url.netloc:
        place = Stored(url.scheme + text[len(url.scheme):].rstrip('/'))  # S3:// is s3://
        place.require_package()
        return place
    if url.scheme != 'file' or url.netloc not in ('', 'localhost'):
        others = ', '.join(f'{scheme}://BUCKET/NAME' for scheme in PACKAGES)
        reason = ('the memory of one process, which workers do not see'
                  if url.scheme == 'memory' else 'no such storage')
        raise ConfigError(f'{text}: {reason}: expected a path or file:///PATH that all machines '
                          f'see, or {others}')
    return Path(unquote(url.path)).absolute()


def path_of(option: str, text: str) -> Path:
    """Return the absolute path of a path or a file:// URL; raises ConfigError on other URLs."""
    place = place_of(text)
    if isinstance(place, Stored):
        raise ConfigError(f'{option}: {text}: no path: expected a path or file:///PATH that all '
                          'machines see; bags and --out may be in object stores')
    return place


def find_roots(named: Sequence[str]) -> list[Place]:
    """
    Return the places that arguments name, in order, none of them inside another.

    Patterns with `*`, `?` and `**` are expanded. Raises DataError where there is nothing.
    """
    found: set[Place] = set()
    for text in named:
        place = place_of(text)
        matches = [place] if place.exists() else _matches(place) if has_magic(str(place)) else []
        if not matches:  # what is gone of those that match is refused by itself
            raise DataError(f'{text}: no bags there: expected a bag, a folder of bags, or a '
                            'pattern that matches some')
        found.update(each if isinstance(each, Stored) else Path(os.path.normpath(each))
                     for each in matches)
    return [place for place in sorted(found, key=str)
            if not any(above in found for above in place.parents)]


def _matches(pattern: Place) -> Sequence[Place]:
    """Return the folders and bags that match; a file is the bag that it is a part of."""
    found: Sequence[Place] = (
        pattern.matches() if isinstance(pattern, Stored)
        else [Path(each) for each in glob(str(pattern), recursive=True)])
    folders: dict[Place, bool] = {}
    bags: list[Place] = []
    for place in found:
        if place.is_dir():
            bags.append(place)
        elif place.name.endswith(_SUFFIXES):
            above = place.parents[0]
            if above not in folders:
                folders[above] = is_bag_folder(above, [name for name, _ in _entries(above)])
            bags.append(above if folders[above] else place)
    return list(dict.fromkeys(bags))


def bags_below(root: Place) -> Iterator[Place]:
    """
    Yield the bags in a tree, in the order of their paths; a file that is named is one.

    A folder is a bag if it has metadata.yaml, or files that a recorder numbered after the folder;
    every other MCAP or sqlite3 file is a bag by itself. Hidden folders are left out, in which a
    command that was killed leaves half a bag. Links to folders are not followed. A folder that
    cannot be read is taken for a bag, which its worker refuses with the reason.
    """
    yield from _bags_in(root) if root.is_dir() else [root]


def _bags_in(folder: Place) -> Iterator[Place]:
    try:
        entries = sorted(_entries(folder))
    except OSError:
        yield folder
        return
    if is_bag_folder(folder, [name for name, _ in entries]):
        yield folder
        return
    for name, is_folder in entries:
        if name.startswith('.'):
            continue
        if is_folder:
            yield from _bags_in(folder / name)
        elif name.endswith(_SUFFIXES):
            yield folder / name


def _entries(folder: Place) -> list[tuple[str, bool]]:
    """Return the names in a folder, and whether each is one."""
    if isinstance(folder, Stored):
        return [(each.name, each.is_folder) for each in folder.entries()]
    return [(each.name, each.is_dir(follow_symlinks=False)) for each in os.scandir(folder)]


def is_bag_folder(folder: Place, names: Sequence[str]) -> bool:
    """Return whether a folder that has these entries is one bag."""
    if 'metadata.yaml' in names:
        return True
    numbered = re.compile(rf'{re.escape(folder.name)}_\d+\.(mcap|db3)')
    files = [name for name in names
             if name.endswith(('.mcap', '.db3')) and not name.startswith('._')]
    storages = {name.rpartition('.')[2] for name in files}
    return len(storages) == 1 and all(map(numbered.fullmatch, files))
