"""`active-recon view` and `play`: what they hand to their nodes, and what they refuse."""

import os
from pathlib import Path

from active_recon.cli.main import app
from active_recon.errors import ConfigError
import pytest
from typer.testing import CliRunner
import yaml

GOLDEN = Path(__file__).parents[1] / 'bags' / 'golden' / 'run'


@pytest.fixture
def begun(monkeypatch):
    words = []

    def replaced(program, given):
        words.extend(given)
        raise SystemExit

    monkeypatch.setattr(os, 'execv', replaced)
    return words


def parameters(words):
    return {name: yaml.safe_load(value)
            for name, _, value in (word.partition(':=') for word in words if ':=' in word)}


def test_the_page_of_a_running_loop_has_its_port_and_size(begun):
    assert CliRunner().invoke(app, ['view', '--port', '8123', '--object-size', '0.2']
                              ).exit_code == 0
    assert parameters(begun) == {'port': 8123, 'object_size': 0.2}


@pytest.mark.parametrize(('options', 'named'), [
    (['--image', '/wrist/image'], '--image'), (['--object-yaw-deg', '90'], '--object-yaw-deg'),
    (['--background', '255,255,255', '--object-size', '1'], '--background'),
    (['--turned-object', '--max-pose-gap', '0.5'], '--max-pose-gap, --turned-object')])
def test_options_of_a_bag_are_refused_without_one(options, named, begun):
    result = CliRunner().invoke(app, ['view', *options])
    assert isinstance(result.exception, ConfigError)
    assert str(result.exception).startswith(f'{named} without a bag')
    assert not begun


def test_topics_of_a_bag_are_not_remapped(begun):
    result = CliRunner().invoke(app, ['view', str(GOLDEN), '--remap', 'a:=b'])
    assert isinstance(result.exception, ConfigError)
    assert '--remap with a bag' in str(result.exception)


@pytest.mark.parametrize('name', ['ba"g', 'ba\\new', '📷 bag'])
def test_a_bag_of_any_name_is_played(name, begun, tmp_path):
    bag = tmp_path / name
    bag.symlink_to(GOLDEN)
    result = CliRunner().invoke(app, ['play', str(bag)])
    assert result.exit_code == 0, result.output
    assert parameters(begun) == {'bag': str(bag), 'rate': 1.0, 'topics': ''}
    assert '\\u' not in ' '.join(begun)  # ROS's YAML has no pairs of them
