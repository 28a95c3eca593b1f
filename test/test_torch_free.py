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
    'active_recon.demo.run', 'active_recon.launching.up', 'active_recon.cli.main',
    *(module for folder in ('active_recon/bags', 'active_recon/photos', 'active_recon/report',
                            'active_recon/viewer', 'msg_tools') for module in modules_of(folder))]


IMPORTED = """
import importlib, sys, traceback

for module in sys.argv[1:]:
    try:
        importlib.import_module(module)
        print(module, 'torch' in sys.modules)
    except Exception:
        traceback.print_exc()
    if 'torch' in sys.modules:
        break
"""


def imported_with(*modules):
    """
    Return by module whether torch comes with it, and what was said of what cannot be imported.

    One process imports them all, up to the first with torch.
    """
    ended = subprocess.run([sys.executable, '-c', IMPORTED, *modules], cwd=ROOT,
                           capture_output=True, text=True)
    return dict(line.split() for line in ended.stdout.splitlines()), ended.stderr


@pytest.fixture(scope='module')
def found():
    return imported_with(*MODULES)


@pytest.mark.slow
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


LOOP = """
import sys

from active_recon.geometry.cameras import orbit_camera
from active_recon.planner import Planner
from active_recon.reconstructor import Reconstructor
import numpy as np

reconstructor, planner = Reconstructor.load(threads=1), Planner.load('attention', threads=1)
reconstructor.warm_up()
camera = orbit_camera(0.3, 0.4)
seen = reconstructor.add_view(np.full((137, 137, 3), 90, np.uint8), camera)
decision = planner.add_view(seen.latent, camera, seen.grid.entropy(), seen.grid, seen.quality)
assert decision.goal is not None and np.ptp(decision.goal.scores) > 0
print(reconstructor.provenance['computed_by'], planner.provenance['computed_by'], sep='\\n')
print('torch' in sys.modules)
"""

COMMAND = """
import sys
from active_recon.cli.main import app

try:
    app(sys.argv[1:])
except SystemExit as ended:
    assert not ended.code, ended.code
print('torch' in sys.modules)
"""


def last_lines(code, *arguments):
    """Return what a process of its own that runs some code says."""
    ended = subprocess.run([sys.executable, '-c', code, *map(str, arguments)], cwd=ROOT,
                           capture_output=True, text=True)
    assert ended.returncode == 0, ended.stdout + ended.stderr
    return ended.stdout.splitlines()


def test_the_reconstructor_starts_before_what_makes_meshes_is_there():
    imported, = last_lines(
        'import sys, active_recon.nodes.reconstructor\n'
        "print({'scipy.spatial', 'trimesh', 'numpy'} & sys.modules.keys())")
    assert imported == "{'numpy'}"


def test_nodes_are_started_by_a_process_without_ros():
    imported, = last_lines('import sys, active_recon.launching.up\n'
                           "print({'active_recon.launching.up', 'rclpy'} & sys.modules.keys())")
    assert imported == "{'active_recon.launching.up'}"


def test_views_are_reconstructed_and_planned_without_torch():
    pytest.importorskip('openvino')
    *computed_by, with_torch = last_lines(LOOP)
    assert with_torch == 'False'
    assert [words.split()[0] for words in computed_by] == ['openvino', 'openvino']


@pytest.mark.parametrize('command', [
    ('replay', 'bags/golden/run'), ('report', 'bags/golden/run', '--out', '{}'),
    pytest.param(('bag', 'info', 'bags/golden/run'), marks=pytest.mark.slow)],
    ids=lambda command: command[0])
def test_a_command_on_a_bag_leaves_torch_out(command, tmp_path):
    pytest.importorskip('openvino')
    page = tmp_path / 'page.html'
    assert last_lines(COMMAND, *(word.format(page) for word in command))[-1] == 'False'
