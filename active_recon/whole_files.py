"""Files that are written whole or not at all."""

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """
    Yield a path beside another, whose place the file there takes once the block has ended.

    If the block raises, what stood at `path` stays, and nothing is left beside it.
    """
    unfinished = path.with_name(f'.{path.name}.part')
    try:
        yield unfinished
        unfinished.replace(path)
    except BaseException:
        with suppress(OSError):
            unfinished.unlink(missing_ok=True)
        raise
