"""The bags in folders, trees and patterns."""

from collections.abc import Iterator, Sequence
from glob import glob, has_magic
import os
from pathlib import Path
import re
from urllib.parse import unquote, urlsplit

from active_recon.errors import ConfigError, DataError

_SUFFIXES = ('.mcap', '.db3', '.mcap.zstd', '.db3.zstd')


def place_of(text: str) -> Path:
    """Return the absolute path of a path or a file:// URL; raises ConfigError on other URLs."""
    if not re.match(r'[A-Za-z][A-Za-z0-9+.-]*://', text):
        return Path(text).absolute()
    url = urlsplit(text)
    if url.scheme != 'file' or url.netloc not in ('', 'localhost'):
        raise ConfigError(f'{text}: no such storage: expected a path or file:///PATH that all '
                          'machines see; mount a bucket, for example with s3fs, gcsfuse or rclone')
    return Path(unquote(url.path)).absolute()


def find_roots(named: Sequence[str]) -> list[Path]:
    """
    Return the absolute paths that arguments name, in order, none of them inside another.

    Patterns with `*`, `?` and `**` are expanded. Raises DataError where there is nothing.
    """
    found: set[Path] = set()
    for text in named:
        path = place_of(text)
        matches = [path] if path.exists() or not has_magic(str(path)) else [
            Path(each) for each in glob(str(path), recursive=True)]
        if not matches or not all(each.exists() for each in matches):
            raise DataError(f'{text}: no bags there: expected a bag, a folder of bags, or a '
                            'pattern that matches some')
        found.update(Path(os.path.normpath(each)) for each in matches)
    return [path for path in sorted(found) if not any(above in found for above in path.parents)]


def bags_below(root: Path) -> Iterator[Path]:
    """
    Yield the bags in a tree, in the order of their paths; a file that is named is one.

    A folder is a bag if it has metadata.yaml, or files that a recorder numbered after the folder;
    every other MCAP or sqlite3 file is a bag by itself. Links to folders are not followed.
    """
    if not root.is_dir() or is_bag_folder(root, os.listdir(root)):
        yield root
        return
    for entry in sorted(os.scandir(root), key=lambda each: each.name):
        path = root / entry.name
        if entry.is_dir(follow_symlinks=False):
            yield from bags_below(path)
        elif entry.name.endswith(_SUFFIXES) and not entry.name.startswith('.'):
            yield path


def is_bag_folder(folder: Path, names: Sequence[str]) -> bool:
    """Return whether a folder that has these entries is one bag."""
    if 'metadata.yaml' in names:
        return True
    numbered = re.compile(rf'{re.escape(folder.name)}_\d+\.mcap')
    files = [name for name in names if name.endswith('.mcap')]
    return bool(files) and all(map(numbered.fullmatch, files))
