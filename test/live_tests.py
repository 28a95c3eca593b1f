"""
Live tests beside the others: files of both kinds take turns, and who fails gets a second chance.

Tests in `test/ros` and `test/browser` start processes and mostly wait for them. With `pytest -n`
their files are spread evenly among those that compute. Live processes on a busy machine may be
late where nothing is wrong: a live test that fails is run once more when nothing else runs. What
fails then has failed; what passes then is named at the end.
"""

from collections.abc import Generator, Mapping, Sequence
from pathlib import Path
import subprocess
import sys

import pytest
from pytest import Config, Item, Session, TerminalReporter, TestReport

LIVE = ('test/ros/', 'test/browser/')


def pytest_configure(config: Config) -> None:
    """Register the second chance where tests of several workers are reported."""
    if config.getoption('numprocesses', None) and not hasattr(config, 'workerinput'):
        config.pluginmanager.register(SecondChance(config))


def pytest_collection_modifyitems(config: Config, items: list[Item]) -> None:
    """Let the files of live tests take turns with the others, the same in every worker."""
    if hasattr(config, 'workerinput'):
        files = {item.nodeid.split('::')[0]: item.path for item in items}
        order = take_turns({file: path.stat().st_size for file, path in files.items()})
        items.sort(key=lambda item: order.index(item.nodeid.split('::')[0]))


def take_turns(sizes: Mapping[str, int]) -> list[str]:
    """
    Return files, given with their sizes, with those of live tests evenly among the others.

    The largest of each kind come first, so that none that takes long is left alone at the end.
    """
    files = sorted(sizes, key=lambda file: (-sizes[file], file))
    live = [file for file in files if file.startswith(LIVE)]
    others = [file for file in files if not file.startswith(LIVE)]
    place = {file: (index + 0.5) / len(kind)
             for kind in (live, others) for index, file in enumerate(kind)}
    return sorted(files, key=place.__getitem__)


class SecondChance:
    """Live tests that failed beside others are run once more, alone."""

    def __init__(self, config: Config) -> None:
        self._root = config.rootpath
        self._failures: dict[str, TestReport] = {}
        self._output = ''
        self._passed = True

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_logreport(self, report: TestReport) -> None:
        """Take the failure of a live test out of the count."""
        if report.failed and report.nodeid.startswith(LIVE):
            self._failures[report.nodeid] = report
            report.outcome = 'rerun'  # type: ignore[assignment]

    def pytest_report_teststatus(self, report: TestReport) -> tuple[str, str, str] | None:
        """Count it by itself."""
        return ('rerun', 'R', 'RERUN') if report.outcome == 'rerun' else None

    @pytest.hookimpl(wrapper=True)
    def pytest_runtestloop(self, session: Session) -> Generator[None, object, object]:
        """Run them once more when all workers have ended; what fails now counts."""
        result = yield
        if self._failures:
            self._passed, self._output = run_alone(list(self._failures), self._root)
            session.testsfailed += not self._passed
        return result

    def pytest_terminal_summary(self, terminalreporter: TerminalReporter) -> None:
        """Show how they failed beside others, and what became of them alone."""
        if not self._failures:
            return
        terminalreporter.section('live tests that failed beside others')
        for name, report in self._failures.items():
            terminalreporter.section(name, '_')
            terminalreporter.line(report.longreprtext)
        terminalreporter.section('the same tests once more, alone')
        terminalreporter.line(self._output)
        if self._passed:
            terminalreporter.line(f'passed only alone: {", ".join(self._failures)}', yellow=True)


def run_alone(names: Sequence[str], root: Path) -> tuple[bool, str]:
    """Run tests in one process; return whether all passed, and the output with each outcome."""
    ended = subprocess.run(
        [sys.executable, '-m', 'pytest', '-p', 'no:cacheprovider', '-rfEp', *names],
        cwd=root, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    return ended.returncode == 0, ended.stdout
