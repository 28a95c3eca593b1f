"""Nodes that run the default network hold no torch in their processes."""

from pathlib import Path

import pytest

pytest.importorskip('openvino')
pytestmark = pytest.mark.ros


@pytest.mark.parametrize(('node', 'parameters'), [
    ('reconstructor', {}), ('view_planner', {'policy': 'attention'})])
def test_a_node_maps_openvino_and_no_torch(start_node, node, parameters):
    # A program of its own: those that are forked have imported all that any node may need
    process = start_node(node, program=('-m', f'active_recon.nodes.{node}'), **parameters)
    libraries = {Path(line.split()[-1]).name
                 for line in Path(f'/proc/{process.pid}/maps').read_text().splitlines()}
    assert any(name.startswith('libopenvino') for name in libraries)
    assert not any(name.startswith('libtorch') for name in libraries)
