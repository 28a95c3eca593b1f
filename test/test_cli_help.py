"""`--help` and `--version`: what the terminal shows before anything is done."""

import re

from active_recon import __version__
from active_recon.cli.main import app, flowing
from command_line import command as run
import pytest
import typer
from typer.testing import CliRunner


def commands_of(command, name=('',)):
    """Yield a command by its name, and all within it."""
    yield name, command
    for part, inner in getattr(command, 'commands', {}).items():
        yield from commands_of(inner, (*filter(None, name), part))


COMMANDS = dict(commands_of(typer.main.get_command(app)))


def shown(*arguments):
    result = CliRunner().invoke(app, [*filter(None, arguments)], env={
        'COLUMNS': '80', 'TERMINAL_WIDTH': '80'})
    assert result.exit_code == 0, result.output
    return result.output


def test_the_version_is_told():
    assert shown('--version') == f'active-recon {__version__}\n'


@pytest.mark.parametrize('command', COMMANDS, ids=' '.join)
def test_no_line_of_a_paragraph_breaks_before_the_terminal_does(command):
    said = shown(*command, '--help').split('\u256d')[0]
    paragraphs = re.split(r'\n\s*\n', said)
    for paragraph in paragraphs:
        lines = [line.strip() for line in paragraph.strip().splitlines() if line.strip()]
        for line, following in zip(lines, lines[1:], strict=False):
            assert len(line) + 1 + len(following.split()[0]) > 78, line


@pytest.mark.parametrize('command', [name for name, command in COMMANDS.items()
                                     if any(each.name == 'seed' for each in command.params)],
                         ids=' '.join)
def test_a_negative_seed_is_refused(command):
    result = CliRunner().invoke(app, [*command, '--seed', '-1'])
    assert result.exit_code == 2 and "Invalid value for '--seed'" in result.output


def test_a_paragraph_is_one_line_and_stays_apart_from_the_next():
    def command():
        """
        Do this,
        and that.

        Example: do
        this
        """

    assert flowing(command) == 'Do this, and that.\n\nExample: do this'


def test_a_refusal_has_its_exit_code_where_nobody_can_hear_it(monkeypatch, tmp_path):
    monkeypatch.setattr('sys.stderr', None)  # as with 2>&-
    assert run(monkeypatch, 'bag', 'info', tmp_path / 'missing.mcap') == 2
