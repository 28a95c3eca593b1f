"""Atomic and durable file operations."""

from itertools import count
import os
from pathlib import Path

from active_recon.errors import DataError
from active_recon.whole_files import whole_file


def write_atomically(path: Path, text: str) -> None:
    """Replace a text file atomically; raises OSError if the disk is full."""
    with whole_file(path) as unfinished, unfinished.open('w') as file:
        file.write(text)
        file.flush()
        os.fsync(file.fileno())
    sync_folder(path.parent)


def numbered_files(folder: Path, suffix: str = '.mcap') -> list[Path]:
    """
    Return the files of the bag in a folder, by the numbers that rosbag2 ends their names with.

    What macOS leaves beside them, `._<name>`, is none. Raises DataError where others are packed,
    as without them it would be a part of the bag, and where the names are those of several bags.
    """
    if packed := _files(folder, f'{suffix}.zstd'):
        raise DataError(
            f'{folder}: packed files, which are read only as metadata.yaml lists them: expected '
            f'{suffix} files, got {packed[0].name}; unpack it first, by `zstd -d --rm`',
            'compression')
    files = sorted(_files(folder, suffix), key=_name_and_number)
    if len({_name_and_number(path)[0] for path in files}) > 1:
        raise DataError(f'{folder}: several bags in a folder without metadata.yaml: expected '
                        f'files of one name, got {", ".join(path.name for path in files)}; name '
                        'one of them', 'several_bags')
    return files


def _files(folder: Path, suffix: str) -> list[Path]:
    return sorted(path for path in folder.glob(f'*{suffix}') if not path.name.startswith('._'))


def _name_and_number(path: Path) -> tuple[str, int]:
    name, _, number = path.stem.rpartition('_')
    return (name, int(number)) if name and number.isdecimal() else (path.stem, 0)


def free_name(path: Path, ending: str) -> Path:
    """Return an unused path: `<path>.<ending>`, else `<path>.<ending>2`, `3`, ..."""
    names = (f'{path.name}.{ending}{number if number > 1 else ""}' for number in count(1))
    return next(free for name in names if not (free := path.with_name(name)).exists())


def sync_folder(folder: Path) -> None:
    """Block until the entries of a folder would survive a power cut."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
