"""Which signals ask a process to stop, and when they are heard."""

import os
import signal
import subprocess
import sys
import time

from active_recon.cli import main as commands
from active_recon.interrupts import held_interrupts, stop_signals
import pytest


@pytest.fixture(autouse=True)
def as_before(monkeypatch):
    """Forget at the end that there was an interruption."""
    monkeypatch.setattr('active_recon.interrupts._is_interrupted', False)


@pytest.fixture
def hangup():
    """Give the signal of a closed terminal what it had before."""
    before = signal.getsignal(signal.SIGHUP)
    yield signal.SIGHUP
    signal.signal(signal.SIGHUP, before)


def test_a_closed_terminal_is_heard_where_it_is_asked_for(hangup):
    signal.signal(hangup, signal.SIG_DFL)
    with pytest.raises(KeyboardInterrupt), held_interrupts() as raise_if_asked:
        os.kill(os.getpid(), hangup)
        raise_if_asked()
    assert signal.getsignal(hangup) == signal.SIG_DFL


def test_what_nohup_started_outlives_its_terminal(hangup):
    signal.signal(hangup, signal.SIG_IGN)
    assert set(stop_signals()) == {signal.SIGINT, signal.SIGTERM}
    with held_interrupts() as raise_if_asked:
        os.kill(os.getpid(), hangup)
        raise_if_asked()


@pytest.mark.parametrize('asked', [signal.SIGINT, signal.SIGTERM])
def test_a_command_hears_what_asks_it_to_stop_in_an_import_once_that_is_done(
        asked, hangup, tmp_path, monkeypatch):
    (tmp_path / 'swallowing.py').write_text(
        f'import os\ntry:\n    os.kill(os.getpid(), {asked:d})\nexcept BaseException:\n    pass\n'
        'imported = True\n')
    monkeypatch.syspath_prepend(tmp_path)
    imported = []

    def run():
        from swallowing import imported as whole
        imported.append(whole)
        time.sleep(5)

    monkeypatch.setattr(commands, 'app', run)
    before = {kind: signal.getsignal(kind) for kind in (signal.SIGINT, signal.SIGTERM)}
    try:
        signal.signal(asked, signal.default_int_handler)  # a shell's background ignores Ctrl-C
        with pytest.raises(SystemExit, match='^130$'):
            commands.main()
    finally:
        del sys.modules['swallowing']
        for kind, handler in before.items():
            signal.signal(kind, handler)
    assert imported == [True]


def test_a_command_that_is_stopped_while_it_is_imported_ends_without_a_word():
    ended = subprocess.run([sys.executable, '-c', """
import os
import signal
import sys
from active_recon.cli.start import main

class Stopping:
    def find_spec(self, name, *_):
        if name == 'active_recon.cli.main':
            os.kill(os.getpid(), signal.SIGINT)

signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background ignores Ctrl-C
sys.meta_path.insert(0, Stopping())
main()
"""], capture_output=True, text=True, timeout=30, check=False)
    assert (ended.returncode, ended.stdout, ended.stderr) == (-signal.SIGINT, '', '')


def test_a_command_that_is_stopped_before_it_runs_ends_without_a_traceback(monkeypatch):
    def run():
        raise KeyboardInterrupt  # as while typer builds all commands

    monkeypatch.setattr(commands, 'app', run)
    with pytest.raises(SystemExit, match='^130$'):
        commands.main()


def test_what_a_library_makes_of_an_interruption_is_no_error_of_the_command(hangup, monkeypatch):
    def run():
        try:
            os.kill(os.getpid(), signal.SIGTERM)
            time.sleep(5)
        except BaseException:
            raise ValueError('could not determine the shape') from None

    monkeypatch.setattr(commands, 'app', run)
    before = signal.getsignal(signal.SIGTERM)
    try:
        with pytest.raises(SystemExit, match='^130$'):
            commands.main()
    finally:
        signal.signal(signal.SIGTERM, before)


@pytest.mark.parametrize('asked', [
    signal.SIGTERM, pytest.param(signal.SIGHUP, marks=pytest.mark.slow)])
def test_a_command_that_is_killed_leaves_nothing_unfinished(asked, hangup, tmp_path):
    signal.signal(hangup, signal.SIG_DFL)  # tests that nohup started ignore it
    command = subprocess.Popen(
        [sys.executable, '-m', 'active_recon.cli.main', 'record-sweep', 'chair', '--out',
         tmp_path / 'bag'], stderr=subprocess.PIPE, text=True)
    while not any(tmp_path.iterdir()) and command.poll() is None:
        time.sleep(0.02)
    command.send_signal(asked)
    _, told = command.communicate(timeout=30)
    assert command.returncode != 0 and 'Traceback' not in told
    assert not list(tmp_path.iterdir())
