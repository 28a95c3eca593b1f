"""Shapes as files of the command line: coloured meshes, robot descriptions, their numbers."""

from pathlib import Path
import sys
from types import SimpleNamespace
from xml.etree import ElementTree

from active_recon.cli.shape_files import ShapeFiles
from active_recon.errors import ConfigError
from active_recon.geometry.cameras import orbit_camera
from active_recon.volumes.voxels import VoxelGrid
import numpy as np
import pytest
import trimesh

GRID = VoxelGrid(np.pad(np.ones((4, 4, 4), np.float32), 2), 0.2)
RED_VIEWS = [SimpleNamespace(image=np.full((137, 137, 3), (200, 20, 30), np.uint8),
                             camera=orbit_camera(azimuth, 0.4, 0.42)) for azimuth in (0.0, 2.0)]


def test_a_mesh_has_the_colours_of_its_own_views(tmp_path, capsys):
    blue = [SimpleNamespace(image=view.image[..., ::-1].copy(), camera=view.camera)
            for view in RED_VIEWS]
    ShapeFiles(tmp_path / 'mug.ply', None).write([(GRID, RED_VIEWS), (GRID, blue)], 0.5)
    reddest = [int(np.median(trimesh.load(tmp_path / f'mug-{number}.ply').visual.vertex_colors,
                             axis=0)[:3].argmax()) for number in (1, 2)]
    assert reddest == [0, 2]
    assert capsys.readouterr().out.count('wrote ') == 2


def test_a_robot_description_weighs_as_its_density_says(tmp_path, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, 'coacd', None)
    for density in (400.0, None):
        ShapeFiles(tmp_path / 'mug.urdf', None, density).write([(GRID, RED_VIEWS)], 0.5)
        mass = float(ElementTree.parse(tmp_path / 'mug.urdf').find('.//mass').get('value'))
        assert mass == pytest.approx((density or 500) * trimesh.load(
            tmp_path / 'mug_meshes' / 'visual.obj').volume, rel=1e-4)
    assert 'one convex hull for each body' in capsys.readouterr().out


@pytest.mark.parametrize(('mesh', 'said'), [
    (None, 'got no --mesh'), ('mug.ply', 'expected it with --mesh NAME.urdf, got mug.ply')])
def test_a_density_without_a_robot_description_is_refused(mesh, said):
    with pytest.raises(ConfigError, match=said):
        ShapeFiles(mesh and Path(mesh), None, 300.0)
