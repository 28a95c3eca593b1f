"""What stands around the networks is there without torch: it takes seconds, and need not be."""

from pathlib import Path
import subprocess
import sys

import pytest

ROOT = Path(__file__).parents[1]


def modules_of(folder):
    return sorted('.'.join(path.relative_to(ROOT).with_suffix('').parts)
                  for path in (ROOT / folder).rglob('*.py') if path.stem != '__init__')


MODULES = [
    'active_recon.reconstructor', 'active_recon.planner', 'active_recon.policies',
    *(f'active_recon.nodes.{node}' for node in (
        'reconstructor', 'view_planner', 'recorder', 'viewer', 'turntable_camera')),
    *(module for folder in ('active_recon/bags', 'active_recon/report', 'active_recon/viewer',
                            'msg_tools') for module in modules_of(folder))]


IMPORTED = """
import importlib, os, sys, traceback
import cv2, geometry_msgs.msg, jinja2, mcap.reader, mcap.writer, numpy, PIL.Image, rclpy.node
import rosbags.rosbag2, scipy.ndimage, scipy.spatial, sensor_msgs.msg, trimesh, viser

for module in sys.argv[1:]:
    if child := os.fork():
        os.waitpid(child, 0)
        continue
    try:
        importlib.import_module(module)
        print(module, 'torch' in sys.modules, flush=True)
    except BaseException:
        traceback.print_exc()
    os._exit(0)
"""


def imported_with(*modules):
    """
    Return by module whether torch comes with it, and what was said of what cannot be imported.

    Each has a process that had none of the others; the libraries of them all are there already.
    """
    ended = subprocess.run([sys.executable, '-c', IMPORTED, *modules], cwd=ROOT,
                           capture_output=True, text=True)
    return dict(line.split() for line in ended.stdout.splitlines()), ended.stderr


@pytest.fixture(scope='module')
def found():
    return imported_with(*MODULES)


def test_torch_would_be_noticed():
    assert imported_with('active_recon.runtimes.torch')[0] == {
        'active_recon.runtimes.torch': 'True'}


def test_a_module_that_cannot_be_imported_would_be_noticed():
    found, said = imported_with('active_recon.nowhere')
    assert (found, "No module named 'active_recon.nowhere'" in said) == ({}, True)


@pytest.mark.parametrize('module', MODULES)
def test_a_module_around_the_networks_leaves_torch_out(module, found):
    with_torch, said = found
    assert with_torch.get(module) == 'False', said
