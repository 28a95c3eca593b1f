"""`active-recon up`: the nodes of a file start together, and end together."""

import os
from pathlib import Path
import signal
import subprocess
import sys

from active_recon.errors import ConfigError
from active_recon.launching.processes import NodeProcesses
from active_recon.launching.up import run_up, Start
from geometry_msgs.msg import PoseStamped
import pytest
from rclpy.node import Node
import yaml

from .conftest import BUDGET_S, FakeCamera
from .processes import ROOT

pytestmark = pytest.mark.ros


@pytest.fixture
def up(ros_domain, tmp_path):
    """Start the command on a parameters file of this text; its output is in `up.log`."""
    started = []

    def start(text, *options):
        file = tmp_path / 'nodes.yaml'
        file.write_text(text)
        with (tmp_path / 'up.log').open('wb') as log:
            started.append(subprocess.Popen(
                [sys.executable, '-m', 'active_recon.cli.main', 'up', '--params', str(file),
                 *options], cwd=tmp_path, stdout=log, stderr=subprocess.STDOUT,
                env={**os.environ, 'PYTHONPATH': str(ROOT)}))
        return started[-1]

    yield start
    for process in started:
        process.kill()
        process.wait()


def node_pids(folder):
    """Return the processes of nodes that were started with a file in this folder."""
    pids = []
    for each in Path('/proc').glob('[0-9]*'):
        try:
            command = (each / 'cmdline').read_text()
        except OSError:  # it has just ended
            continue
        if str(folder) in command and 'active_recon.nodes.' in command:
            pids.append(int(each.name))
    return pids


@pytest.mark.parametrize('name', [
    'plain', 'a "b" c', "a 'b' c", 'C:\\new\\table', 'ends with \\', 'Größe', 'chair 🪑', '{a: 1}',
    '2', 'true', 'a # b', 'two\nlines', ''])
def test_a_node_reads_a_name_as_it_was_given(ros, monkeypatch, name):
    commands = []
    monkeypatch.setattr(subprocess, 'Popen', lambda command, **options: commands.append(command))
    NodeProcesses().start('recorder', {'name': name})
    command, = commands
    words = command[command.index('--ros-args'):]
    assert yaml.safe_load(words[-1].removeprefix('name:=')) == name
    node = Node('given', cli_args=words, automatically_declare_parameters_from_overrides=True)
    assert node.get_parameter('name').value == name
    node.destroy_node()


TWO = ('/**/view_planner: {ros__parameters: {policy: farthest}}\n'
       '/**/recorder: {ros__parameters: {record_at_start: false}}\n')


def test_the_nodes_of_a_file_run_in_a_namespace_until_ctrl_c(up, bench, tmp_path):
    process = up(TWO, '--namespace', 'cell', '--remap', 'next_view:=wanted')
    bench.until(lambda: {'/cell/view_planner', '/cell/recorder'} <= set(
        bench.node.get_fully_qualified_node_names()), 'the nodes')
    bench.until(lambda: bench.node.count_publishers('/cell/wanted'), 'the remapped topic')
    process.send_signal(signal.SIGINT)
    assert process.wait(BUDGET_S) == 0
    assert not node_pids(tmp_path)
    said = (tmp_path / 'up.log').read_text()
    assert 'starting view_planner, recorder' in said
    assert 'the nodes are stopped' in said
    assert 'Traceback' not in said


def test_nodes_that_are_still_starting_are_stopped_without_a_traceback(up, tmp_path):
    process = up(TWO)
    while len(node_pids(tmp_path)) < 2:
        assert process.poll() is None
    process.send_signal(signal.SIGINT)
    assert process.wait(BUDGET_S) == 0
    assert not node_pids(tmp_path)
    assert 'Traceback' not in (tmp_path / 'up.log').read_text()


@pytest.fixture
def hears_of_terminal():
    """What is started hears that its terminal is closed, also where the tests run by nohup."""
    before = signal.signal(signal.SIGHUP, signal.SIG_DFL)
    yield
    signal.signal(signal.SIGHUP, before)


@pytest.mark.usefixtures('hears_of_terminal')
def test_a_terminal_that_is_closed_stops_the_nodes_and_completes_the_bag(up, bench, tmp_path):
    process = up('/**/recorder: {ros__parameters: {output_dir: bags}}\n')
    bench.until(lambda: '/recorder' in bench.node.get_fully_qualified_node_names(), 'the node')
    process.send_signal(signal.SIGHUP)
    assert process.wait(BUDGET_S) == 0
    assert not node_pids(tmp_path)
    bag, = (tmp_path / 'bags').iterdir()
    assert (bag / 'metadata.yaml').is_file()


def test_where_one_node_ends_the_others_are_stopped_and_the_command_fails(up, bench, tmp_path):
    process = up(TWO.replace('/**', ''), '--namespace', '/')
    bench.until(lambda: len(node_pids(tmp_path)) == 2, 'the nodes')
    bench.until(lambda: '/view_planner' in bench.node.get_fully_qualified_node_names(), 'one')
    os.kill(node_pids(tmp_path)[0], signal.SIGKILL)
    assert process.wait(BUDGET_S) == 2
    assert not node_pids(tmp_path)
    said = (tmp_path / 'up.log').read_text()
    assert 'ended with code -9 (killed: was there enough memory?)' in said


def test_a_file_that_cannot_be_used_starts_nothing(up, tmp_path):
    assert up('recorder: {ros__parameters: {output_dri: bags}}').wait(BUDGET_S) == 2
    said = (tmp_path / 'up.log').read_text()
    assert 'recorder has no parameter output_dri; did you mean output_dir?' in said


def test_a_file_of_another_namespace_starts_nothing(up):
    assert up(TWO.replace('/**/recorder', 'recorder'), '--namespace', 'cell').wait(BUDGET_S) == 2


@pytest.mark.parametrize(('namespace', 'remaps', 'said'), [
    ('cell-1', (), '--namespace /cell-1: no namespace of ROS: expected'),
    ('größer', (), '--namespace /größer: no namespace of ROS: expected'),
    ('', ('__ns:=/cell',), '-r __ns:=/cell: another name for nodes'),
    ('', ('recorder:__node:=mine',), '-r recorder:__node:=mine: another name for nodes')])
def test_names_that_nodes_cannot_have_or_by_which_they_get_nothing_of_the_file_start_nothing(
        tmp_path, namespace, remaps, said):
    file = tmp_path / 'nodes.yaml'
    file.write_text(TWO)
    with pytest.raises(ConfigError, match=f'^{said}'):
        run_up(Start(file, namespace, remaps), lambda _line: None)


def test_nodes_that_share_a_process_answer_a_view_with_a_goal(up, bench, tmp_path):
    process = up('/**/reconstructor: {ros__parameters: {take_views: all}}\n'
                 '/**/view_planner: {ros__parameters: {max_views: 9}}\n'
                 '/**/recorder: {ros__parameters: {record_at_start: false}}\n',
                 '--single-process')
    goals = bench.subscribe(PoseStamped, 'next_view')
    seen = FakeCamera(bench).show()
    bench.until(lambda: any(msg.header.stamp.sec * 10 ** 9 + msg.header.stamp.nanosec > seen
                            for msg in goals), 'a goal after the view')
    assert len(node_pids(tmp_path)) == 2  # the recorder has a process of its own
    process.send_signal(signal.SIGINT)
    assert process.wait(BUDGET_S) == 0
    assert not node_pids(tmp_path)
    assert 'Traceback' not in (tmp_path / 'up.log').read_text()
