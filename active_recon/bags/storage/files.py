"""Files that are there as a whole or not at all, and stay there when the power fails."""

from contextlib import suppress
from itertools import count
import os
from pathlib import Path
import re


def write_whole(path: Path, text: str) -> None:
    """Write a text file in one step, over what was there; OSError where the disk is full."""
    unfinished = path.with_name(f'.{path.name}.part')
    try:
        with unfinished.open('w') as file:
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
        unfinished.replace(path)
    except OSError:
        with suppress(OSError):
            unfinished.unlink()
        raise
    sync_folder(path.parent)


def mcap_files(folder: Path) -> list[Path]:
    """Return the MCAP files of a folder in the order in which rosbag2 numbers them."""
    def number(path: Path) -> tuple[int, str]:
        found = re.search(r'_(\d+)$', path.stem)
        return int(found[1]) if found else 0, path.name

    return sorted(folder.glob('*.mcap'), key=number)


def free_name(path: Path, ending: str) -> Path:
    """Return the path with `.<ending>` behind, or with a number where that is taken."""
    names = (f'{path.name}.{ending}{number if number > 1 else ""}' for number in count(1))
    return next(free for name in names if not (free := path.with_name(name)).exists())


def sync_folder(folder: Path) -> None:
    """Return when the names in a folder would survive a power cut."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
