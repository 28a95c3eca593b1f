"""Progress bars on a terminal, progress lines in a log."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
import time

from active_recon.reporting import Reporting, silent
from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

_LARGE_BAG = 50_000_000  # bytes, about a second
_LINE_EVERY = 30.0  # seconds between lines in a log


def bag_progress(path: Path) -> Reporting:
    """Return the progress bar for reading a large bag, or `silent` for a small one."""
    files = path.rglob('*') if path.is_dir() else [path]
    size = sum(file.stat().st_size for file in files if file.is_file())
    return progress_bar if size > _LARGE_BAG else silent


@contextmanager
def progress_bar(title: str, total: int) -> Iterator[Callable[[int, str], None]]:
    """
    Yield `advance(steps, note)`, which updates a bar with a note and the time left.

    Without a terminal it prints a line every half minute instead.
    """
    console = Console(stderr=True)
    if not console.is_terminal:
        yield _log_lines(title, total)
        return
    # Names of files in a title or note may have brackets
    words, note = (TextColumn(shown, markup=False)
                   for shown in ('{task.description}', '{task.fields[note]}'))
    columns = (words, BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(),
               TimeRemainingColumn(), note)
    with Progress(*columns, console=console) as bar:
        task = bar.add_task(title, total=total, note='')

        def advance(steps: int, note: str) -> None:
            bar.update(task, advance=steps, note=note)

        yield advance


def _log_lines(title: str, total: int) -> Callable[[int, str], None]:
    start = last = time.monotonic()
    done = first = 0

    def advance(steps: int, note: str) -> None:
        nonlocal last, done, first
        first = first or steps  # the first step of a resumed run is what was done before
        done += steps
        now = time.monotonic()
        if done < total and now - last < _LINE_EVERY:
            return
        last = now
        left = (now - start) / max(done - first, 1) * (total - done)
        print(f'{title}: {done}/{total}, {left:.0f} s left  {note}', flush=True)  # noqa: T201

    return advance
