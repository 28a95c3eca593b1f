"""
Run the tests in three sessions beside each other: those of live nodes wait, the others compute.

    python test/side_by_side.py -m 'not slow'

Options go to every session. Live processes on a busy machine may be late where nothing is wrong:
a test marked `ros` or `browser` that fails is run once more, when nothing else runs, and told
apart at the end. What fails then, or is not of that kind, has failed.
"""

from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
import subprocess
import sys
import tempfile
import threading
import xml.etree.ElementTree as ElementTree

TESTS = Path(__file__).parent
LIVE = ('ros', 'browser')
NOTHING_COLLECTED = 5


@dataclass(frozen=True)
class Session:
    """One pytest session: its name, what it runs, and whether that is live."""

    name: str
    paths: tuple[Path, ...]
    live: bool


@dataclass(frozen=True)
class Outcome:
    """Of a session: the exit code, what passed, what was skipped, and the ids that failed."""

    code: int
    passed: int
    skipped: int
    failed: tuple[str, ...]


def sessions(options: Sequence[str]) -> list[Session]:
    """Return the sessions; tests that are named in the options are one, not cut in three."""
    if any(Path(option.split('::')[0]).exists() for option in options):
        return [Session('named', (), live=False)]
    live = sorted(path for folder in LIVE for path in (TESTS / folder).glob('test_*.py'))
    return [Session('live, first half', tuple(live[::2]), live=True),
            Session('live, second half', tuple(live[1::2]), live=True),
            Session('without nodes', tuple(sorted(TESTS.glob('test_*.py'))), live=False)]


def run(session: Session, options: Sequence[str], folder: Path,
        saying: threading.Lock) -> Outcome:
    """Run a session and say its lines under its name; return how it ended."""
    report = folder / f'{session.name}.xml'
    command = [sys.executable, '-m', 'pytest', '-p', 'no:cacheprovider', f'--junit-xml={report}',
               *map(str, session.paths), *options]
    with subprocess.Popen(command, cwd=TESTS.parent, text=True, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT) as process:
        assert process.stdout is not None
        for line in process.stdout:
            with saying:
                print(f'[{session.name}] {line}', end='', flush=True)
    cases = list(_cases(report))
    return Outcome(
        process.returncode,
        sum(how == 'passed' for _, how in cases), sum(how == 'skipped' for _, how in cases),
        tuple(dict.fromkeys(name for name, how in cases if how == 'failed')))


def _cases(report: Path) -> Iterator[tuple[str, str]]:
    """Yield each test's id and how it ended."""
    if not report.is_file():  # the session did not live to write it
        return
    for case in ElementTree.parse(report).iter('testcase'):
        kinds = {child.tag for child in case}
        how = ('failed' if kinds & {'failure', 'error'} else
               'skipped' if 'skipped' in kinds else 'passed')
        yield _test_id(case.get('classname', ''), case.get('name', '')), how


def _test_id(module: str, name: str) -> str:
    """Return pytest's id of a test, from a report that writes its file with dots."""
    return f'{module.replace(".", "/")}.py::{name}'


def main(options: Sequence[str]) -> int:
    """Run all; return the exit code."""
    saying = threading.Lock()
    wanted = sessions(options)
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(len(wanted)) as pool:
        outcomes = list(pool.map(
            lambda session: run(session, options, Path(folder), saying), wanted))
        passed, skipped = (sum(outcome.passed for outcome in outcomes),
                           sum(outcome.skipped for outcome in outcomes))
        failed: list[str] = []
        late: list[str] = []
        broken = False
        for session, outcome in zip(wanted, outcomes, strict=True):
            if outcome.code not in (0, NOTHING_COLLECTED) and not outcome.failed:
                print(f'[{session.name}] ended with {outcome.code} and named no test')
                broken = True
            elif session.live and outcome.failed:
                print(f'== once more, alone: {", ".join(outcome.failed)}')
                again = run(Session('once more', (), live=True), [*options, *outcome.failed],
                            Path(folder), saying)
                broken |= again.code != 0 and not again.failed
                failed += again.failed
                late += [name for name in outcome.failed if name not in again.failed]
                passed += again.passed
            else:
                failed += outcome.failed
    if late:
        print(f'== passed only when they ran alone: {", ".join(late)}')
    if failed:
        print(f'== failed: {", ".join(failed)}')
    print(f'{passed} passed, {len(failed)} failed, {skipped} skipped')
    return 1 if broken or failed else 0


if __name__ == '__main__':
    raise SystemExit(main(sys.argv[1:]))
