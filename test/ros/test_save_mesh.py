"""The reconstructor's service `save_mesh`, and a camera that publishes best effort."""

from pathlib import Path

import pytest
from rclpy.qos import qos_profile_sensor_data
import trimesh

from .conftest import FakeCamera

pytestmark = pytest.mark.ros


@pytest.mark.parametrize('mesh_format', ['ply', 'glb'])
def test_the_mesh_is_written_where_the_answer_says(start_node, bench, tmp_path, mesh_format):
    # A threshold so low that any image leaves a surface
    start_node('reconstructor', take_views='all', threshold=0.01, mesh_format=mesh_format,
               output_dir=tmp_path / 'meshes')
    answer = bench.call('save_mesh')
    assert not answer.success
    assert 'no view in this episode yet: expected one before a mesh' in answer.message
    FakeCamera(bench, qos_profile_sensor_data).show()
    answer = bench.call('save_mesh')
    assert answer.success
    path = Path(answer.message)
    assert (path.parent, path.suffix) == (tmp_path / 'meshes', f'.{mesh_format}')
    assert len(trimesh.load(path, force='mesh').faces) > 0


def test_a_mesh_that_cannot_be_written_is_said_and_survived(start_node, bench, tmp_path):
    (tmp_path / 'meshes').write_text('a file, where a folder is wanted')
    start_node('reconstructor', take_views='all', threshold=0.01, output_dir=tmp_path / 'meshes')
    camera = FakeCamera(bench)
    camera.show()
    answer = bench.call('save_mesh')
    assert not answer.success
    assert 'was not written' in answer.message
    camera.show()
