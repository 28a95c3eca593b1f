"""The commands, as a shell runs them."""

from functools import cache

from active_recon.cli.main import main
import pytest
import typer

_built_once = cache(typer.main.get_command)  # it takes a tenth of a second each time


def command(monkeypatch, *arguments):
    """Run `active-recon` with these arguments; return its exit code."""
    monkeypatch.setattr('typer.main.get_command', _built_once)
    monkeypatch.setattr('sys.argv', ['active-recon', *map(str, arguments)])
    with pytest.raises(SystemExit) as end:
        main()
    return end.value.code or 0


def refusal(monkeypatch, capsys, *arguments):
    """Run a command that is refused with exit code 2; return its one line."""
    capsys.readouterr()
    assert command(monkeypatch, *arguments) == 2
    *_, line = capsys.readouterr().err.splitlines()  # warnings may come before
    assert line.startswith('active-recon: ')
    return line
