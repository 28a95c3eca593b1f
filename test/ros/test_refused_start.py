"""A node that cannot start says why in one line, with what was expected, and ends."""

import os
import re
import subprocess
import sys

from active_recon.models.weights_files import SHIPPED
import numpy as np
import pytest
from safetensors.numpy import save_file
import trimesh

from .processes import ROOT

pytestmark = pytest.mark.ros


def refusal(start_node, name, **parameters):
    """Return the one line with which the node gave up."""
    node = start_node(name, ready=False, **parameters)
    assert node.wait() == 1
    line, = node.log()
    assert '[FATAL]' in line
    return line


def refused_arguments(module, given):
    """Return the one line with which an executable gave up that was given arguments of its own."""
    ended = subprocess.run(
        [sys.executable, '-m', f'active_recon.nodes.{module}', *given, '--ros-args', '--log-level',
         'info'], cwd=ROOT, capture_output=True, text=True)
    assert ended.returncode == 1
    line, = ended.stderr.splitlines()
    return line


@pytest.mark.parametrize(('name', 'parameters', 'said'), [
    ('turntable_camera', {'speed': 0.0}, 'speed: invalid value: expected a number from 0.001 to '
                                         '100, got 0.0'),
    ('turntable_camera', {'rate': '.inf'}, 'rate: invalid value: expected a number from 0.1 to '
                                           '1000, got inf'),
    ('turntable_camera', {}, 'mesh, dataset: neither given: expected one of them'),
    ('view_planner', {'policy': 'guess'}, "policy: invalid value: expected one of auto, atten.*, "
                                          "got 'guess'"),
    ('view_planner', {'policy': 'random', 'max_views': 0},
     'max_views: invalid value: expected an integer from 1 to 1000, got 0'),
    ('reconstructor', {'object_size': -1}, 'object_size: invalid value: expected a number.*, got '
                                           '-1'),
    ('reconstructor', {'threshold': 1.5}, 'threshold: invalid value: expected.*0.01 to 0.99, or '
                                          'nan, got 1.5'),
])
def test_a_parameter_out_of_range_is_refused_with_its_range(start_node, name, parameters, said):
    assert re.search(f'parameters? {said}', refusal(start_node, name, **parameters))


@pytest.mark.parametrize(('folders', 'said'), [
    ({}, 'no folder: expected HOME or ROS_LOG_DIR to name one, got neither'),
    ({'HOME': '/dev/null'}, '/dev/null/.ros/log: cannot be written: expected a folder that files '
                            'can be made in, got: Not a directory; set ROS_LOG_DIR to another '
                            'folder'),
], ids=['no home', 'home that is no folder'])
def test_a_node_without_a_folder_for_its_log_says_how_to_name_one(ros_domain, folders, said):
    environment = {name: value for name, value in os.environ.items()
                   if name not in ('HOME', 'ROS_HOME', 'ROS_LOG_DIR')}
    ended = subprocess.run([sys.executable, '-m', 'active_recon.nodes.recorder'], cwd=ROOT,
                           env={**environment, **folders}, capture_output=True, text=True)
    assert ended.returncode == 1
    line, = ended.stderr.splitlines()
    assert line.endswith(f"ROS's log: {said}")


@pytest.mark.parametrize('given', [('-p', 'object_size:=0.5'), ('--nonsense',)])
def test_arguments_that_are_not_for_ros_are_refused_by_a_node_that_has_none(ros_domain, given):
    assert refused_arguments('recorder', given).endswith(
        'unknown arguments: expected --ros-args before all others, as in '
        f'--ros-args -p NAME:=VALUE, got {" ".join(given)}')


@pytest.mark.parametrize('named', [(), ('recorder',), ('view_planner', 'view_planner')])
def test_nodes_that_cannot_share_a_process_are_refused_by_name(ros_domain, named):
    assert refused_arguments('composed', named).endswith(
        'which nodes: expected names out of reconstructor, view_planner, '
        f'turntable_camera, each once, got {", ".join(named) or "none"}')


def missing_weights(folder):
    return folder / 'none.safetensors'


def truncated_weights(folder):
    path = folder / 'truncated.safetensors'
    path.write_bytes(SHIPPED.read_bytes()[:100_000])
    return path


def weights_of_another_model(folder):
    path = folder / 'other.safetensors'
    save_file({'layer': np.zeros(3, np.float32)}, path, {
        'model': 'other', 'config': '{}', 'threshold': '0.5'})
    return path


@pytest.mark.parametrize(('make', 'said'), [
    (missing_weights, 'no such file: expected weights'),
    (truncated_weights, 'no whole safetensors file'),
    (weights_of_another_model, "'other': expected one of 2d3d-attention")])
def test_weights_that_cannot_be_used_are_refused(start_node, tmp_path, make, said):
    assert re.search(said, refusal(start_node, 'reconstructor', weights=make(tmp_path)))


def test_a_planner_without_its_weights_is_refused(start_node, tmp_path):
    assert 'no such file' in refusal(
        start_node, 'view_planner', policy='attention', weights=missing_weights(tmp_path))
    assert 'no view policy' in refusal(
        start_node, 'view_planner', policy='attention', weights='2d3d')


def missing_mesh(folder):
    return folder / 'none.ply'


def empty_mesh(folder):
    path = folder / 'empty.obj'
    path.touch()
    return path


def mesh_without_faces(folder):
    path = folder / 'points.ply'
    trimesh.PointCloud(np.eye(3)).export(path)
    return path


def text(folder):
    path = folder / 'text.stl'
    path.write_text('this is no mesh')
    return path


@pytest.mark.parametrize('make', [missing_mesh, empty_mesh, mesh_without_faces, text])
def test_a_mesh_that_cannot_be_shown_is_refused(start_node, tmp_path, make):
    path = make(tmp_path)
    assert re.search(f'{path}: (no mesh|no such mesh|a mesh|no surface: expected faces)', refusal(
        start_node, 'turntable_camera', mesh=path))
