"""Parameters files: those that ship, and what is refused before any node starts."""

from pathlib import Path
import re
import subprocess
import sys

from active_recon.errors import ConfigError
from active_recon.parameters.declaration import declared
from active_recon.parameters.node_parameters import NODE_PARAMETERS
from active_recon.parameters.params_file import (
    check_reach,
    nodes_left_out,
    read_params_file,
)
import pytest

ROOT = Path(__file__).parents[2]
SHIPPED = sorted([*ROOT.glob('config/*.yaml'), *ROOT.glob('examples/*.yaml')])


@pytest.mark.parametrize('path', SHIPPED, ids=lambda path: path.stem)
def test_a_file_that_ships_gives_parameters_that_its_nodes_have(path):
    assert {'reconstructor', 'view_planner'} <= read_params_file(path).keys()


@pytest.mark.parametrize('path', SHIPPED, ids=lambda path: path.stem)
def test_a_file_that_ships_explains_each_of_its_lines(path):
    lines = [line for line in path.read_text().splitlines()
             if line.strip() and not re.match(r'#|/\*\*/\w+:$|  ros__parameters:$', line)]
    assert lines
    assert all(re.search(r' # \S', line) for line in lines)


@pytest.mark.parametrize('path', SHIPPED, ids=lambda path: path.stem)
def test_the_nodes_of_a_file_that_ships_agree_on_the_object(path):
    given = read_params_file(path).values()
    for name in ('object_size', 'object_frame', 'object_yaw', 'use_sim_time'):
        assert len({values[name] for values in given if name in values}) <= 1, name


def test_what_is_given_to_all_is_given_to_each_unless_it_has_its_own(tmp_path):
    path = tmp_path / 'some.yaml'
    path.write_text('/**: {ros__parameters: {object_size: 2, mesh: chair, colour: red}}\n'
                    '/cell/recorder: {ros__parameters: {use_sim_time: true}}\n'
                    'view_planner: {ros__parameters: {object_size: 3}}\n')
    given = read_params_file(path)
    assert list(given) == ['recorder', 'view_planner']
    assert given['view_planner']['object_size'] == 3
    assert given['recorder'] == {'use_sim_time': True, 'colour': 'red'}  # a node warns of it
    assert 'mesh' not in given['view_planner']


def test_numbers_are_read_as_ros_reads_them(tmp_path):
    path = tmp_path / 'some.yaml'
    path.write_text('view_planner: {ros__parameters: {elevation: nan, min_gain: 1e-3, '
                    'azimuth_range: [0.0, 1e-1], start_type_description_service: false}}\n')
    assert list(read_params_file(path)) == ['view_planner']


@pytest.mark.parametrize('date', ['2026-11-28', '2026-11-28 10:30:00', '2026-11-28T10:30:00Z'])
def test_a_date_is_text_as_ros_reads_it(tmp_path, date):
    path = tmp_path / 'some.yaml'
    path.write_text(f'recorder: {{ros__parameters: {{output_dir: {date}}}}}\n')
    assert read_params_file(path) == {'recorder': {'output_dir': date}}


KEYS = {  # what ROS does with each, for view_planner in '', in /cell and in /a/cell
    'view_planner': (True, False, False), '/view_planner': (True, False, False),
    'cell/view_planner': (False, True, False), '/cell/view_planner': (False, True, False),
    '/*/view_planner': (False, True, False), '/**/cell/view_planner': (False, True, True),
    '/a/**/view_planner': (False, False, True), '/**/view_planner': (True, True, True),
    '/cell/**': (False, True, False), '/**': (True, True, True)}


@pytest.mark.parametrize(('namespace', 'reached'), [
    (namespace, {key: reaches[n] for key, reaches in KEYS.items()})
    for n, namespace in enumerate(('', '/cell', '/a/cell'))])
def test_a_file_that_gives_nodes_of_a_namespace_nothing_is_refused(tmp_path, namespace, reached):
    path = tmp_path / 'some.yaml'
    for key, is_reached in reached.items():
        path.write_text(f'"{key}": {{ros__parameters: {{policy: farthest}}}}\n')
        if is_reached:
            check_reach(path, namespace)
        else:
            with pytest.raises(ConfigError, match=f'not in the namespace {namespace or "/"} of '):
                check_reach(path, namespace)


def test_a_file_may_give_nodes_of_other_namespaces_something_else(tmp_path):
    path = tmp_path / 'some.yaml'
    path.write_text('/a/recorder: {ros__parameters: {output_dir: a}}\n'
                    '/b/recorder: {ros__parameters: {output_dir: b}}\n')
    check_reach(path, '/a')


def test_the_driver_of_a_turntable_is_left_out_and_named(tmp_path):
    path = tmp_path / 'some.yaml'
    path.write_text('/**/turntable_driver: {ros__parameters: {turntable_direction: 1}}\n'
                    '/**/recorder: {ros__parameters: {output_dir: bags}}\n')
    assert list(read_params_file(path)) == ['recorder']
    assert nodes_left_out(path) == ['turntable_driver']


@pytest.mark.parametrize(('text', 'said'), [
    ('', 'no parameters file: expected nodes with ros__parameters, got nothing'),
    ('- a', r"no parameters file: expected nodes with ros__parameters, got \['a'\]"),
    ('{', 'no ROS parameters file in YAML'),
    ('/**: {ros__parameters: {a: 1}}', 'no node: expected one or more of reconstructor.*, got '
                                       'none'),
    ('grasper: {ros__parameters: {a: 1}}', 'unknown node: expected one of reconstructor.*, got '
                                           'grasper'),
    ('recorder: {topics: [a]}', 'recorder: wrong keys: expected ros__parameters and nothing '
                                'else, got topics'),
    ('recorder: {}', 'recorder: wrong keys: expected ros__parameters and nothing else, got '
                     'nothing'),
    ('recorder: {ros__parameters: 1}', 'recorder: not a mapping: expected names with values, got '
                                       '1'),
    ('recorder: {ros__parameters: {output: a}}', 'no parameter output; did you mean output_dir'),
    ('view_planner: {ros__parameters: {elevation_range: [0, 1.2]}}',
     'parameter elevation_range: not of one type: expected all numbers of a list with a point, as '
     r'0.0 is, for ROS, got \[0, 1.2\]'),
    ('view_planner: {ros__parameters: {entropy_tolerance: "0.1"}}',
     "parameter entropy_tolerance: text: expected a number from .* without quotes, got '0.1'"),
    ('view_planner: {ros__parameters: {entropy_tolerance: "{"}}',
     "entropy_tolerance: invalid value: expected a number from .*, got '{'"),
    ('view_planner: {ros__parameters: {elevation_range: [0.0, "1.2"]}}',
     "parameter elevation_range: text: expected .* without quotes, got '1.2'"),
    ('view_planner: {ros__parameters: {reachable_views: }}',
     'parameter reachable_views: no value: expected a list.* got nothing; an empty list is '),
    ('recorder: {ros__parameters: {max_bag_size_mb: 0}}',
     'recorder: parameter max_bag_size_mb: invalid value: expected an integer from 1 to 1000000, '
     'got 0')])
def test_a_file_that_cannot_be_used_is_refused_with_its_name(tmp_path, text, said):
    path = tmp_path / 'some.yaml'
    path.write_text(text)
    with pytest.raises(ConfigError, match=f'^{path}: .*{said}'):
        read_params_file(path)


def test_a_file_that_is_not_there_is_refused(tmp_path):
    path = tmp_path / 'none.yaml'
    with pytest.raises(ConfigError, match=f'^{path}: no such file: expected a ROS parameters'):
        read_params_file(path)


def test_a_node_that_is_given_a_file_that_is_no_yaml_says_so_in_one_line(tmp_path):
    path = tmp_path / 'some.yaml'
    path.write_text('recorder:\n  ros__parameters: {max_bag_size_mb: 2\n')
    ended = subprocess.run(
        [sys.executable, '-m', 'active_recon.nodes.recorder', '--ros-args', '--params-file', path],
        cwd=ROOT, capture_output=True, text=True)
    assert ended.returncode == 1
    assert 'Traceback' not in ended.stderr
    said = ended.stderr.splitlines()[-1]
    assert f'{path}: no ROS parameters file in YAML' in said and "expected ',' or '}'" in said


@pytest.mark.parametrize('node', [
    pytest.param(node, marks=[pytest.mark.slow] * (node != 'reconstructor'))
    for node in NODE_PARAMETERS])
def test_a_node_asked_for_help_lists_its_parameters_and_ends(node):
    asked = subprocess.run([sys.executable, '-m', f'active_recon.nodes.{node}', '--help'],
                           cwd=ROOT, capture_output=True, text=True, timeout=600)
    assert asked.returncode == 0 and not asked.stderr
    lines = asked.stdout.splitlines()
    assert lines[0].startswith(f'usage: {node} ') and lines[2]
    assert max(map(len, lines)) <= 80
    for each in declared(NODE_PARAMETERS[node]):
        assert any(line.startswith(f'  {each.name} (default: ') for line in lines)
