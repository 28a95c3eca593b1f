"""Live tests beside the others: they take turns, and those that fail have a second chance."""

import os
from pathlib import Path
import subprocess
import sys

from live_tests import take_turns
import pytest

FAILS = 'def test_it():\n    assert False\n'
FAILS_ONCE = """from pathlib import Path

def test_it():
    told = Path(__file__).with_suffix('.told')
    failed_before = told.exists()
    told.touch()
    assert failed_before
"""


@pytest.mark.parametrize('kind, text, code, counted', [
    ('ros', FAILS_ONCE, 0, '1 passed, 1 rerun'),
    ('browser', FAILS, 1, '1 passed, 1 rerun'),
    ('other', FAILS_ONCE, 1, '1 failed, 1 passed'),
])
def test_only_a_live_test_is_run_once_more_and_what_fails_then_has_failed(
        kind, text, code, counted, tmp_path):
    folder = tmp_path / 'test' / kind
    folder.mkdir(parents=True)
    (folder / 'test_one.py').write_text(text)
    (folder / 'test_two.py').write_text('def test_it():\n    pass\n')
    done = subprocess.run(
        [sys.executable, '-m', 'pytest', '-p', 'no:cacheprovider', '-p', 'live_tests', '-n', '2',
         '--dist', 'loadfile', '--rootdir', tmp_path, folder], cwd=tmp_path, text=True,
        capture_output=True, env={**os.environ, 'PYTHONPATH': str(Path(__file__).parent)})
    assert done.returncode == code, done.stdout
    assert counted in done.stdout.splitlines()[-1]
    again = f'test/{kind}/test_one.py::test_it'
    assert (f'passed only alone: {again}' in done.stdout) == (kind == 'ros')
    assert (f'FAILED {again} - ' in done.stdout) == (kind != 'ros')


def test_files_of_live_tests_lie_evenly_among_the_others_the_largest_of_both_first():
    sizes = {'test/browser/b': 1, 'test/ros/a': 2,
             'test/f': 1, 'test/e': 1, 'test/d': 7, 'test/c': 9}
    assert take_turns(sizes) == [
        'test/c', 'test/ros/a', 'test/d', 'test/e', 'test/browser/b', 'test/f']
