from pathlib import Path

import pytest
import side_by_side

ALWAYS = 'def test_it():\n    assert False\n'
ONCE = """from pathlib import Path

def test_it():
    told = Path(__file__).with_suffix('.told')
    failed_before = told.exists()
    told.touch()
    assert failed_before
"""


@pytest.mark.parametrize('live, text, code, told', [
    (True, ONCE, 0, '1 passed, 0 failed, 0 skipped'),
    (True, ALWAYS, 1, '0 passed, 1 failed, 0 skipped'),
    (False, ONCE, 1, '0 passed, 1 failed, 0 skipped'),
])
def test_only_a_live_test_is_run_once_more_and_what_fails_then_has_failed(
        live, text, code, told, tmp_path, monkeypatch, capsys):
    path = tmp_path / 'test_one.py'
    path.write_text(text)
    monkeypatch.setattr(side_by_side, 'TESTS', tmp_path / 'tests')
    monkeypatch.setattr(side_by_side, 'sessions', lambda options: [
        side_by_side.Session('one', (path,), live)])
    assert side_by_side.main(['--rootdir', str(tmp_path)]) == code
    assert capsys.readouterr().out.splitlines()[-1] == told


def test_every_test_file_is_in_one_session():
    files = [path for session in side_by_side.sessions([]) for path in session.paths]
    assert sorted(files) == sorted(Path(side_by_side.TESTS).rglob('test_*.py'))
