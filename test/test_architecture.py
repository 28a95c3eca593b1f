"""The direction of the imports: the core knows nobody, and only two packages know ROS."""

import ast
from collections.abc import Iterator
from pathlib import Path
import re

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ('active_recon', 'msg_tools')
MAY_IMPORT = {  # beside itself; what is not named here is part of the core
    'core': set(),
    'msg_tools': {'core'},
    'bags': {'core', 'msg_tools'},
    'viewer': {'core', 'bags'},
    'report': {'core', 'bags'},
    'nodes': {'core', 'msg_tools', 'bags', 'viewer'},
    'demo': {'core', 'bags', 'nodes', 'viewer'},
    'evaluation': {'core'},
    'training': {'core', 'evaluation'},
    'paper': {'core', 'evaluation', 'training'},
    'cli': {'core', 'bags', 'demo', 'evaluation', 'training', 'paper', 'report', 'viewer'},
}
KNOW_ROS = {'nodes', 'msg_tools'}
ROS = re.compile(r'(rclpy|rosidl_\w+|rmw_\w+|ament_\w+|tf2_\w+|launch(_\w+)?|cv_bridge|'
                 r'message_filters|\w+_msgs|\w+_srvs|\w+_interfaces)(\.|$)')


def layer_of(module: str) -> str:
    """Return the layer of a dotted module name of ours."""
    package, _, rest = module.partition('.')
    name = rest.partition('.')[0] if package == 'active_recon' else package
    return name if name in MAY_IMPORT else 'core'


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
    layer = layer_of(module)
    allowed = MAY_IMPORT[layer] | {layer}
    return [name for name in imports_of(code, package or module.rpartition('.')[0])
            if (name.partition('.')[0] in PACKAGES and layer_of(name) not in allowed)
            or (ROS.match(name) and layer not in KNOW_ROS)]


def modules() -> list[Path]:
    return sorted(path for package in PACKAGES for path in (ROOT / package).rglob('*.py'))


@pytest.mark.parametrize('path', modules(), ids=lambda path: str(path.relative_to(ROOT)))
def test_imports_follow_the_direction(path):
    parts = path.relative_to(ROOT).with_suffix('').parts
    module = '.'.join(parts[:-1] if parts[-1] == '__init__' else parts)
    assert not wrong_imports(module, path.read_text(), '.'.join(parts[:-1]))


@pytest.mark.parametrize(('module', 'code'), [
    ('active_recon.voxels', 'import rclpy'),
    ('active_recon.models.encoder', 'from sensor_msgs.msg import Image'),
    ('active_recon.voxels', 'from msg_tools.images import image_from_msg'),
    ('active_recon.voxels', 'def late():\n    import msg_tools'),
    ('active_recon.voxels', 'from active_recon import nodes'),
    ('active_recon.voxels', 'from . import nodes'),
    ('active_recon.policies.attention', 'from ..training.policy import reward'),
    ('active_recon.reconstructor', 'from active_recon.nodes.run import run_node'),
    ('active_recon.planner', 'from active_recon.cli.main import main'),
    ('active_recon.evaluation.metrics', 'from active_recon.training.losses import loss'),
    ('active_recon.bags.writer', 'import rclpy.serialization'),
    ('active_recon.viewer.page', 'import rclpy'),
    ('active_recon.viewer.page', 'from msg_tools.voxels import voxel_grid_from_msg'),
    ('active_recon.cli.demo', 'from active_recon.nodes import reconstructor'),
    ('msg_tools.images', 'from active_recon.bags.writer import BagWriter'),
    ('msg_tools.images', 'from active_recon.nodes.qos import LATCHED'),
])
def test_import_against_the_direction_is_noticed(module, code):
    assert len(wrong_imports(module, code)) == 1


@pytest.mark.parametrize(('module', 'code'), [
    ('active_recon.voxels', 'import torch, numpy as np'),
    ('active_recon.voxels', 'from active_recon import errors'),
    ('active_recon.models.decoder', 'from .encoder import Encoder'),
    ('msg_tools.images', 'from sensor_msgs.msg import Image\nfrom active_recon import errors'),
    ('active_recon.nodes.recorder', 'import rclpy, msg_tools, active_recon.bags.writer'),
    ('active_recon.cli.train', 'from active_recon.training.policy import train'),
])
def test_import_along_the_direction_is_let_through(module, code):
    assert not wrong_imports(module, code)
