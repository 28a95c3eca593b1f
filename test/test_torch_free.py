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


def imported_with(*modules):
    """Return whether torch comes with modules, each in an interpreter that had none of them."""
    found = []
    for module in modules:
        ended = subprocess.run(
            [sys.executable, '-c', f'import sys, {module}; print("torch" in sys.modules)'],
            cwd=ROOT, capture_output=True, text=True)
        assert ended.returncode == 0, ended.stderr
        found.append(ended.stdout.strip() == 'True')
    return found


def test_torch_would_be_noticed():
    assert imported_with('active_recon.runtimes.torch') == [True]


@pytest.mark.parametrize('module', MODULES)
def test_a_module_around_the_networks_leaves_torch_out(module):
    assert imported_with(module) == [False]
