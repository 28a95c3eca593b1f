"""Files that are written whole or not at all."""

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from secrets import token_hex
import tempfile

from active_recon.errors import ConfigError


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """
    Yield a path beside another, whose place the file there takes once the block has ended.

    If the block raises, what stood at `path` stays, and nothing is left beside it.
    """
    # A name of its own: two processes may write the same file at once
    unfinished = path.with_name(f'.{path.name}.{token_hex(4)}.part')
    try:
        yield unfinished
        unfinished.replace(path)
    except BaseException:
        with suppress(OSError):
            unfinished.unlink(missing_ok=True)
        raise


def writable(path: Path) -> Path:
    """
    Return the path of a file; make its folder, and raise ConfigError where it cannot be written.

    To be asked before the work whose results go there.
    """
    _require_room_in(path.parent, path)
    if path.is_dir():
        raise ConfigError(f'{path}: cannot be written: expected a file, got a folder')
    return path


def writable_folder(path: Path) -> Path:
    """Return the path of a folder; make it, and raise as `writable` does, to be asked as it is."""
    _require_room_in(path, path)
    return path


def _require_room_in(folder: Path, told: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise ConfigError(f'{told}: cannot be written: expected a folder that files can be made '
                          f'in, got: {error.strerror}') from error
