"""The direction of the imports: a subpackage knows those below it, and three know ROS."""

import ast
from collections.abc import Iterator
from pathlib import Path
import re

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ('active_recon', 'msg_tools')
# A subpackage imports itself and what stands in the rows above its own
ROWS: tuple[set[str], ...] = (
    {'errors', 'interrupts'},
    {'config', 'file_names', 'freed_memory', 'geometry', 'json_text', 'npz_files', 'objects',
     'plugins', 'reporting', 'view_colors', 'whole_files', 'yaml_text'},
    {'cluster', 'png_files', 'volumes'},
    {'acquisition', 'calibration', 'meshes', 'models', 'quality', 'shapes'},
    {'capture', 'datasets', 'runtimes'},
    {'environment', 'exporting', 'policies', 'simulation'},
    {'parameters', 'planner', 'reconstructor', 'segmentation'},
    {'evaluation', 'msg_tools', 'photos', 'saved_states'},
    {'bags', 'training'},
    {'paper', 'report', 'viewer'},
    {'batch', 'nodes', 'watching'},
    {'launching'},
    {'demo'},
    {'cli'},
)
ROW_OF = {subpackage: row for row, subpackages in enumerate(ROWS) for subpackage in subpackages}
# What runs on a robot needs nothing of what only researchers need, and the other way round
RESEARCH = {'evaluation', 'training', 'paper'}
ROBOT = {'msg_tools', 'bags', 'batch', 'report', 'viewer', 'watching', 'nodes', 'launching',
         'demo'}
KNOW_ROS = {'nodes', 'msg_tools', 'launching'}
IMPORTED_BY = {'msg_tools': {'bags', 'nodes', 'launching'}, 'nodes': {'launching'},
               'launching': {'demo', 'cli'}}
ROS = re.compile(r'(rclpy|rosidl_\w+|rmw_\w+|ament_\w+|tf2_\w+|launch(_\w+)?|cv_bridge|'
                 r'message_filters|\w+_msgs|\w+_srvs|\w+_interfaces)(\.|$)')


def subpackage_of(module: str) -> str:
    """Return the subpackage of a module of ours: what stands first below active_recon."""
    package, _, rest = module.partition('.')
    return rest.partition('.')[0] if package == 'active_recon' else package


def may_import(subpackage: str, other: str) -> bool:
    """Return whether modules of a subpackage may import those of another."""
    apart = {subpackage, other} & RESEARCH and {subpackage, other} & ROBOT
    # The package itself offers what a notebook needs, and has its version
    return subpackage in ('', other) or other in ('', '__version__') or (
        ROW_OF[other] < ROW_OF[subpackage] and not apart
        and subpackage in IMPORTED_BY.get(other, ROW_OF))


def imports_of(code: str, package: str) -> Iterator[str]:
    """Yield the dotted name of all that is imported, at any depth, inside functions too."""
    for node in ast.walk(ast.parse(code)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            parents = package.split('.')[:len(package.split('.')) - node.level + 1]
            base = '.'.join([*(parents if node.level else ()), *filter(None, [node.module])])
            yield from (f'{base}.{alias.name}' for alias in node.names)


def wrong_imports(module: str, code: str, package: str = '') -> list[str]:
    """Return what a module of ours imports against the direction."""
    subpackage = subpackage_of(module)
    return [name for name in imports_of(code, package or module.rpartition('.')[0])
            if (name.partition('.')[0] in PACKAGES
                and not may_import(subpackage, subpackage_of(name)))
            or (ROS.match(name) and subpackage not in KNOW_ROS)]


def modules() -> list[Path]:
    return sorted(path for package in PACKAGES for path in (ROOT / package).rglob('*.py'))


@pytest.mark.parametrize('path', modules(), ids=lambda path: str(path.relative_to(ROOT)))
def test_imports_follow_the_direction(path):
    parts = path.relative_to(ROOT).with_suffix('').parts
    module = '.'.join(parts[:-1] if parts[-1] == '__init__' else parts)
    assert not wrong_imports(module, path.read_text(), '.'.join(parts[:-1]))


def test_every_subpackage_has_its_row():
    found = {subpackage_of('.'.join(path.relative_to(ROOT).with_suffix('').parts))
             for path in modules()}
    assert found - {'__init__'} == set(ROW_OF)


@pytest.mark.parametrize(('module', 'code'), [
    ('active_recon.volumes.voxels', 'import rclpy'),
    ('active_recon.models.encoder', 'from sensor_msgs.msg import Image'),
    ('active_recon.volumes.voxels', 'from msg_tools.images import image_from_msg'),
    ('active_recon.volumes.voxels', 'def late():\n    import msg_tools'),
    ('active_recon.volumes.voxels', 'from active_recon import nodes'),
    ('active_recon.volumes.voxels', 'from .. import nodes'),
    ('active_recon.policies.attention', 'from ..training.policy import reward'),
    ('active_recon.reconstructor', 'from active_recon.nodes.runtime.run import run_node'),
    ('active_recon.planner', 'from active_recon.cli.main import main'),
    ('active_recon.evaluation.metrics', 'from active_recon.training.losses import loss'),
    ('active_recon.bags.storage.writer', 'import rclpy.serialization'),
    ('active_recon.viewer.page', 'import rclpy'),
    ('active_recon.viewer.page', 'from msg_tools.voxels import voxel_grid_from_msg'),
    ('active_recon.cli.demo', 'from active_recon.nodes import reconstructor'),
    ('active_recon.geometry.cameras', 'from active_recon.volumes.voxels import VoxelGrid'),
    ('active_recon.parameters.viewer', 'from active_recon.viewer.address import HOST'),
    ('active_recon.bags.runs.run', 'from active_recon.evaluation.metrics import iou'),
    ('active_recon.training.loop', 'from active_recon.bags.runs.run import RecordedRun'),
    ('msg_tools.images', 'from active_recon.bags.storage.writer import BagWriter'),
    ('msg_tools.images', 'from active_recon.nodes.runtime.qos import LATCHED_QOS'),
])
def test_import_against_the_direction_is_noticed(module, code):
    assert len(wrong_imports(module, code)) == 1


@pytest.mark.parametrize(('module', 'code'), [
    ('active_recon.volumes.voxels', 'import torch, numpy as np'),
    ('active_recon.volumes.voxels', 'from active_recon import errors'),
    ('active_recon.models.decoder', 'from .encoder import Encoder'),
    ('msg_tools.images', 'from sensor_msgs.msg import Image\nfrom active_recon import errors'),
    ('active_recon.nodes.recorder', 'import rclpy, msg_tools, active_recon.bags.storage.writer'),
    ('active_recon.cli.train', 'from active_recon.training.policy import train'),
])
def test_import_along_the_direction_is_let_through(module, code):
    assert not wrong_imports(module, code)
