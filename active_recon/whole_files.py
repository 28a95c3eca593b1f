"""Files that are written whole or not at all."""

from collections.abc import Iterator
from contextlib import contextmanager, ExitStack, suppress
from pathlib import Path
from secrets import token_hex
import tempfile

from active_recon.errors import ConfigError
from active_recon.interrupts import held_interrupts


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """
    Yield a path beside another, whose place the file there takes once the block has ended.

    If the block raises, what stood at `path` stays, and nothing is left beside it. An OSError of
    writing, as of a full disk, names `path`.
    """
    # A name of its own: two processes may write the same file at once
    unfinished = path.with_name(f'.{path.name}.{token_hex(4)}.part')
    try:
        yield unfinished
        unfinished.replace(path)
    except BaseException as error:
        with suppress(OSError):
            unfinished.unlink(missing_ok=True)
        if (isinstance(error, OSError) and error.errno is not None  # else its words would be lost
                and error.filename in (None, str(unfinished)) and error.filename2 is None):
            error.filename = str(path)
        raise


@contextmanager
def unfinished_folder(place: Path | None, prefix: str = '.') -> Iterator[Path]:
    """
    Yield a new folder in another, or where temporary files are; it goes when the block ends.

    A command that is stopped leaves none: between the making of a folder and the noting that it
    has to go, it is not.
    """
    with ExitStack() as stack:
        with held_interrupts():
            folder = stack.enter_context(tempfile.TemporaryDirectory(
                prefix=prefix, dir=place, ignore_cleanup_errors=True))
        yield Path(folder)


def writable(path: Path) -> Path:
    """
    Return the path of a file; make its folder, and raise ConfigError where it cannot be written.

    To be asked before the work whose results go there.
    """
    writable_folder(path.parent, path)
    if path.is_dir():
        raise ConfigError(f'{path}: cannot be written: expected a file, got a folder')
    return path


def writable_folder(folder: Path, told: Path | None = None) -> None:
    """Make a folder; raises ConfigError, of `told` or of it, where no file can be made in it."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise ConfigError(f'{told or folder}: cannot be written: expected a folder that files can '
                          f'be made in, got: {error.strerror}') from error
