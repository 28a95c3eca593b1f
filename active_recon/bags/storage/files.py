"""Atomic and durable file operations."""

from itertools import count
import os
from pathlib import Path
import re

from active_recon.errors import DataError
from active_recon.whole_files import whole_file


def write_atomically(path: Path, text: str) -> None:
    """Replace a text file atomically; raises OSError if the disk is full."""
    with whole_file(path) as unfinished, unfinished.open('w') as file:
        file.write(text)
        file.flush()
        os.fsync(file.fileno())
    sync_folder(path.parent)


def mcap_files(folder: Path) -> list[Path]:
    """
    Return the MCAP files of a folder in rosbag2's order, by their numbers.

    Raises DataError where others are packed: without them it would be a part of the bag.
    """
    if packed := sorted(folder.glob('*.mcap.zstd')):
        raise DataError(
            f'{folder}: packed files in a folder without metadata.yaml to list them: expected '
            f'MCAP files, got {packed[0].name}; unpack it first, by `zstd -d --rm`', 'compression')

    def number(path: Path) -> tuple[int, str]:
        found = re.search(r'_(\d+)$', path.stem)
        return int(found[1]) if found else 0, path.name

    return sorted(folder.glob('*.mcap'), key=number)


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
