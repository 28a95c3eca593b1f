"""Every command line that is shown to be copied is accepted by what it calls."""

from dataclasses import fields
import re
import shlex
import shutil
import subprocess

from active_recon.cli.main import app
from active_recon.parameters.node_parameters import NODE_PARAMETERS
from benchmarks import lifting, views
import pytest
from shown_commands import LINES, ROOT, SPANS, words_after
import typer


def names(node):
    return {'use_sim_time', *(each.name for each in fields(NODE_PARAMETERS[node.strip('/')]))}


@pytest.fixture(scope='module')
def parser():
    """Return the command `active-recon` without what its commands do."""
    def idle(command):
        command.callback = None
        for inner in getattr(command, 'commands', {}).values():
            idle(inner)
        return command

    return idle(typer.main.get_command(app))


def accepted(parser, words):
    try:
        parser.main(words, standalone_mode=False)
    except Exception as error:
        pytest.fail(f'active-recon {shlex.join(words)}: {error!r}')


def test_a_page_shows_commands_that_are_accepted(parser):
    shown = words_after('active-recon', LINES)
    assert len(shown) > 50
    for words in shown:
        accepted(parser, words)


def test_a_page_names_commands_and_options_that_exist(parser):
    for words in words_after('active-recon', SPANS):
        command, named = parser, {word for word in words if word.startswith('--')}
        while words and hasattr(command, 'commands') and words[0] not in named:
            command = command.commands[words.pop(0)]
        known = {name for each in command.params for name in (*each.opts, *each.secondary_opts)}
        assert named <= {*known, '--help'}, command.name


def test_the_help_has_examples_that_are_accepted(parser):
    for command in parser.commands.values():
        for each in (command, *getattr(command, 'commands', {}).values()):
            for line in re.findall('active-recon (.+)', each.help or ''):
                accepted(parser, shlex.split(line))


def test_a_page_makes_targets_that_exist(parser):
    targets = set(re.findall('^([a-z-]+):', (ROOT / 'Makefile').read_text(), re.MULTILINE))
    for words in words_after('make', [*LINES, *SPANS]):
        asked = shlex.join(words).partition(" '&&' ")[0]
        assert {word for word in shlex.split(asked) if '=' not in word} <= targets
        if demo := re.match('demo ARGS=(.+)', ' '.join(words)):
            accepted(parser, ['demo', *shlex.split(demo[1])])


def test_a_page_runs_tests_that_exist():
    for path, *named in words_after('pytest', LINES):
        assert (ROOT / path).exists()
        for flag, word in zip(named, named[1:], strict=False):
            assert flag == '-k' and re.search(rf'def test_\w*{word}', (ROOT / path).read_text())


def test_a_page_sets_parameters_that_exist():
    for node, *words in words_after('ros2 run active_recon', LINES):
        given = {word.partition(':=')[0] for flag, word in zip(words, words[1:], strict=False)
                 if flag == '-p'}
        assert given <= names(node)
    for node, name, _ in words_after('ros2 param set', LINES):
        assert name in names(node)


@pytest.mark.parametrize(('command', 'studies'), [
    ('policies', views.STUDIES), ('study', lifting.STUDIES)])
def test_a_benchmark_runs_studies_that_are_accepted(command, studies, parser):
    for arguments in studies.values():
        accepted(parser, [command, *shlex.split(arguments)])


@pytest.mark.skipif(shutil.which('make') is None, reason='needs make')
@pytest.mark.parametrize('size', ['small', 'large'])
def test_weights_are_made_by_commands_that_are_accepted(size, parser, tmp_path):
    said = subprocess.run(
        ['make', '-n', '-f', 'weights.mk', 'AR=active-recon', f'SIZE={size}', 'MESHES=meshes',
         f'RUN={tmp_path}'], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    for words in words_after('active-recon', said.replace('\\\n', ' ').splitlines()):
        accepted(parser, words)
