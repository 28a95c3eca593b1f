"""All bags through the workers, then into the table and the page."""

from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from itertools import islice
import json
from pathlib import Path

from active_recon.batch.finding import bags_below
from active_recon.batch.results import BagResult
from active_recon.batch.rows import refusal_row, Row
from active_recon.batch.summary import Summary
from active_recon.batch.table import parquet, TABLE, write_table
from active_recon.batch.task import Task
from active_recon.batch.work import BagDone, do_bag
from active_recon.cluster import Crew, Result
from active_recon.cluster.results import is_no_room
from active_recon.cluster.stores import Place, Stored
from active_recon.cluster.telling import told
from active_recon.errors import DataError, WorkError
from active_recon.reporting import Reporting, silent
from active_recon.whole_files import unfinished_folder, whole_file

SUMMARY = 'summary.html'
MOST_TOLD = 5
_LIST = 'bags.jsonl'
_MOST_CHECKED = 16  # paths that are named, whose presence each worker looks at
_AT_ONCE = 32  # results that are read from a store while others are on their way


@dataclass(frozen=True)
class Counts:
    """
    Numbers of bags: all, those refused, and those whose results were there before.

    `reasons`: why the first MOST_TOLD of those refused were.
    """

    bags: int
    refused: int
    kept: int
    reasons: Sequence[str]


def run_batch(task: Task, roots: Sequence[Place], crew: Crew,
              reporting: Reporting = silent) -> Counts:
    """
    Do all bags below some paths; write table.parquet and summary.html to the task's folder.

    Results that are there of the same bags and options are kept. Memory does not grow with the
    number of bags. Raises DataError where there are no bags, WorkError where the work cannot go
    on, ConfigError where pyarrow is missing.
    """
    parquet()
    try:
        with _place_of_list(task.out) as listed:
            return _run(task, roots, crew, reporting, listed)
    except OSError as error:
        if not is_no_room(error):
            raise DataError(f'{task.out}: not written: expected a folder, got: '
                            f'{error}') from error
        raise WorkError(f'{task.out}: no room to write: {error.strerror}; what is finished is '
                        'kept: start again once there is room', 'no_room') from error


@contextmanager
def _place_of_list(out: Place) -> Iterator[Path]:
    """
    Yield the path of the list of bags, which goes again; it may be too large for memory.

    Of two commands that write to one folder, each has its own.
    """
    if isinstance(out, Path):
        out.mkdir(parents=True, exist_ok=True)
    with unfinished_folder(out if isinstance(out, Path) else None) as folder:
        yield folder / _LIST


def _run(task: Task, roots: Sequence[Place], crew: Crew, reporting: Reporting,
         listed: Path) -> Counts:
    count = _write_list(listed, roots)
    refused = kept = 0
    with reporting(task.kind, count) as advance:
        results = crew.map(partial(do_bag, task, task.identity), _listed(listed), task.out,
                           [*roots[:_MOST_CHECKED], *_truths(task)])
        for result in told(results, crew, advance, _was_refused):
            if result.refusal:
                _write_refusal(task.out, listed, result)
            refused += _was_refused(result)
            kept += isinstance(result.value, BagDone) and result.value.kept
    summary = Summary()
    write_table(summary.counting(_rows(task.out, listed)), task.out / TABLE)
    summary.write(task.out / SUMMARY, task.kind)
    return Counts(count, refused, kept, summary.reasons(MOST_TOLD))


def _truths(task: Task) -> list[Path]:
    """Return the path of the truth, unless it is the name of an object that ships."""
    return [task.truth.path] if task.truth and task.truth.path.is_absolute() else []


def _write_list(path: Path, roots: Sequence[Place]) -> int:
    """Write the paths of all bags, one in a line as JSON; return their number."""
    count = 0
    with whole_file(path) as unfinished, unfinished.open('w', encoding='ascii') as file:
        for root in roots:
            for bag in bags_below(root):
                file.write(json.dumps(str(bag)) + '\n')
                count += 1
    if not count:
        raise DataError(f'{", ".join(map(str, roots))}: no bags there: expected rosbag2 folders, '
                        'or MCAP or sqlite3 files, found none')
    return count


def _listed(path: Path) -> Iterator[Place]:
    with path.open(encoding='ascii') as file:
        for line in file:
            place = json.loads(line)
            yield Stored(place) if '://' in place else Path(place)


def _was_refused(result: Result) -> bool:
    return bool(result.refusal) or result.value.refused


def _write_refusal(out: Place, listed: Path, result: Result) -> None:
    """Write the result of a bag of which no worker could tell."""
    bag = next(islice(_listed(listed), result.index, None))
    BagResult('', [refusal_row(str(bag), f'{bag}: {result.refusal}', result.kind)]).write(out, bag)


def _rows(out: Place, listed: Path) -> Iterator[Row]:
    left = _listed(listed)
    with ThreadPoolExecutor(_AT_ONCE if isinstance(out, Stored) else 1) as threads:
        while bags := list(islice(left, _AT_ONCE)):
            for bag, result in zip(bags, threads.map(partial(BagResult.read, out), bags),
                                   strict=True):
                if result is None:
                    raise DataError(f'{out}: no result of {bag}: expected the one that its worker '
                                    'wrote; start again')
                yield from result.rows
