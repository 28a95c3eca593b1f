"""`active-recon call`, `set` and `status` on real nodes."""

import os
from pathlib import Path
import re
import subprocess
import sys
import time

from active_recon.launching import running_nodes
from active_recon.launching.processes import private_environment
from command_line import command, refusal
from diagnostic_msgs.msg import DiagnosticArray
import pytest
from rcl_interfaces.srv import GetParameters
from rclpy.node import Node

pytestmark = pytest.mark.ros

WARNED_S = 60.0  # a node waits some seconds before it warns of a topic that nobody publishes
WARNED = r'^/view_planner  WARN  .*/episode: no messages.*\n((?:  .*\n)+)'


@pytest.fixture(scope='module')
def nodes(start_shared_node):
    """Start a planner, and a recorder in a namespace."""
    start_shared_node('view_planner', policy='farthest')
    start_shared_node('recorder', namespace='cell', record_at_start=False)


@pytest.fixture
def told(nodes, monkeypatch, capsys):
    """Run a command that ends with this code; return what it prints, failures as errors."""
    def run(code, *arguments):
        capsys.readouterr()
        assert command(monkeypatch, *arguments) == code
        output, errors = capsys.readouterr()
        assert not (output if code else errors)
        return errors if code else output

    return run


def planned(shared_bench, name):
    """Return the value of a parameter of the planner, as a message."""
    value, = shared_bench.ask(GetParameters, 'view_planner/get_parameters',
                              GetParameters.Request(names=[name])).values
    return value


def test_a_parameter_that_is_set_is_told_with_the_value_before(told, shared_bench):
    assert told(0, 'set', 'view_planner', 'target_quality', '0.5') == (
        '/view_planner: target_quality was 0.0, is 0.5\n')
    assert planned(shared_bench, 'target_quality').double_value == 0.5
    assert told(0, 'set', '/view_planner', 'target_quality', '0') == (
        '/view_planner: target_quality was 0.5, is 0.0\n')


def test_lists_and_words_are_set_as_the_parameter_has_them(told, shared_bench):
    told(0, 'set', 'view_planner', 'azimuth_range', '[-1, 2.2]')
    assert list(planned(shared_bench, 'azimuth_range').double_array_value) == [-1.0, 2.2]
    told(0, 'set', 'view_planner', 'forbidden_sectors', '[0.4, 0.7]')
    assert 'was [0.4, 0.7], is []' in told(0, 'set', 'view_planner', 'forbidden_sectors', '[]')
    assert 'was farthest, is uniform' in told(0, 'set', 'view_planner', 'policy', 'uniform')


@pytest.mark.parametrize(('name', 'value', 'reason'), [
    ('target_quality', '-1.5', 'target_quality stays 0.0: .*out of range.*-1.5'),
    ('policy', 'off', 'policy stays .*: invalid value: expected one of auto.*, got .*off'),
    ('weights', 'mine.safetensors',
     "weights stays '': .*read-only.*: set it where the node is started")])
def test_a_refused_value_is_told_with_the_reason_of_the_node(told, name, value, reason):
    said = told(1, 'set', 'view_planner', name, value)
    assert re.fullmatch(f'/view_planner: {reason}.*\n', said), said


def test_what_is_no_parameter_or_no_value_is_refused(nodes, monkeypatch, capsys):
    said = refusal(monkeypatch, capsys, 'set', 'view_planner', 'target_qualty', '0.5')
    assert '/view_planner has no parameter target_qualty; did you mean target_quality?' in said
    said = refusal(monkeypatch, capsys, 'set', 'view_planner', 'target_quality', '[0.5')
    assert "[0.5: no parameter's value: expected, in YAML" in said


def test_a_service_is_called_and_its_answer_is_printed(told):
    begun = told(0, 'call', 'start', '--namespace', 'cell')
    assert (Path(begun.strip()).parent.name, told(0, 'call', '/cell/stop')) == ('bags', begun)


def test_a_service_that_does_not_succeed_makes_the_command_fail(told):
    assert told(1, 'call', 'stop_episode') == (
        'no episode to stop: expected a running one, there is none\n')


def test_what_nobody_offers_is_told_with_what_is_there(nodes, monkeypatch, capsys):
    said = refusal(monkeypatch, capsys, 'call', 'start')
    assert 'no service /start: expected a Trigger service of a running node, found ' in said
    assert {'/cell/start', '/cell/stop', '/plan', '/stop_episode'} <= set(
        re.findall(r'/[\w/]+', said.partition('found ')[2]))
    assert 'name one with its namespace' in said
    said = refusal(monkeypatch, capsys, 'set', 'recorder', 'topics', '[]')
    assert 'no node /recorder: expected a running node with parameters, found ' in said
    assert {'/cell/recorder', '/view_planner'} <= set(
        re.findall(r'/[\w/]+', said.partition('found ')[2]))


@pytest.mark.parametrize(('arguments', 'missing'), [
    (('call', 'save_mesh'), 'service /save_mesh'),
    (('set', 'view_planner', 'policy', 'auto'), 'node /view_planner'),
    (('status',), 'diagnostics')], ids=lambda each: each[0] if isinstance(each, tuple) else '')
def test_where_no_node_runs_the_domain_is_named(monkeypatch, capsys, arguments, missing):
    environment = private_environment()
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    said = refusal(monkeypatch, capsys, *arguments, '--timeout', '0.5')
    assert f'no {missing}: expected ' in said
    assert f'found none within 0.5 s on ROS domain {environment["ROS_DOMAIN_ID"]}; start' in said


def test_the_status_tells_of_a_node_that_is_out_of_reach(nodes, monkeypatch, capsys):
    # As one of another user: it is discovered, and nothing else of it arrives
    monkeypatch.setattr(running_nodes, 'endpoint_node', lambda _endpoint: None)
    said = refusal(monkeypatch, capsys, 'status', '--namespace', 'elsewhere', '--timeout', '0.5')
    assert 'found a node of which nothing gets here, not even its name: run all nodes' in said


def warned_status(told):
    """Return the status once the planner warns of its inputs and the recorder has messages."""
    told(0, 'call', '/cell/start')
    deadline = time.monotonic() + WARNED_S
    while True:
        said = told(0, 'status')
        if (re.search(WARNED, said, re.MULTILINE) and '  messages ' in said
                or time.monotonic() > deadline):
            told(0, 'call', '/cell/stop')
            return said


def test_the_status_tells_level_message_and_values_of_each_node(told):
    said = warned_status(told)
    planner = re.search(WARNED, said, re.MULTILINE)
    assert planner, said
    assert re.search(r'^  State +active *$', planner[1], re.MULTILINE)
    assert re.search(r'^  warned/never_heard/episode +1 *$', planner[1], re.MULTILINE)
    assert re.search(r'^/cell/recorder  OK  ok\n(  .*\n)*  messages ', said, re.MULTILINE)


def test_the_status_of_a_namespace_is_of_its_nodes_alone(told):
    warned_status(told)
    assert re.findall(r'^/[\w/]+', told(0, 'status', '--namespace', 'cell'), re.MULTILINE) == [
        '/cell/recorder']
    said = told(2, 'status', '--namespace', '/cel', '--timeout', '3')
    assert 'no diagnostics in the namespace /cel: expected a running node, found ' in said
    assert '/cell/recorder, ' in said


def test_the_status_names_a_node_that_tells_nothing(told, shared_bench):
    warned_status(told)
    publisher = shared_bench.node.create_publisher(DiagnosticArray, '/diagnostics', 10)
    said = told(0, 'status', '--timeout', '3')
    shared_bench.node.destroy_publisher(publisher)
    assert re.search(r'^/bench  nothing heard in 3 s: it is busy', said, re.MULTILINE)
    assert re.search(r'^/view_planner  WARN', said, re.MULTILINE)


@pytest.mark.parametrize('namespace', ['/cell', pytest.param('/', marks=pytest.mark.slow)])
def test_the_status_names_a_silent_node_whose_name_is_like_that_of_another(
        told, shared_bench, namespace):
    warned_status(told)
    # Beside /view_planner one of its name in a namespace, and one whose name begins that name
    silent = Node('view_planner' if namespace == '/cell' else 'view', namespace=namespace,
                  context=shared_bench.node.context)
    try:
        silent.create_publisher(DiagnosticArray, '/diagnostics', 10)
        name = silent.get_fully_qualified_name()
        assert f'\n{name}  nothing heard in 3 s' in told(0, 'status', '--timeout', '3')
    finally:
        silent.destroy_node()


@pytest.mark.slow
def test_the_status_leaves_hidden_nodes_out(told, shared_bench):
    warned_status(told)
    hidden = Node('_watching', context=shared_bench.node.context)
    try:
        hidden.create_publisher(DiagnosticArray, '/diagnostics', 10)
        shared_bench.until(lambda: '_watching' in {
            each.node_name for each in shared_bench.node.get_publishers_info_by_topic(
                '/diagnostics')}, 'the hidden node')
        assert '_watching' not in told(0, 'status', '--timeout', '3')
    finally:
        hidden.destroy_node()


def test_a_command_needs_no_home_to_join_the_nodes(ros_domain):
    joining = ('from active_recon.launching.loop_client import joined_domain\n'
               'with joined_domain("_command"):\n'
               '    pass')
    environment = {name: value for name, value in os.environ.items()
                   if name not in ('HOME', 'ROS_HOME', 'ROS_LOG_DIR')}
    ended = subprocess.run([sys.executable, '-c', joining], env=environment, capture_output=True,
                           text=True, cwd=Path(__file__).parents[2])
    assert (ended.returncode, ended.stderr) == (0, '')
