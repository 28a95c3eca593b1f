"""Shapes as files of the command line: coloured meshes, robot descriptions, their numbers."""

from pathlib import Path
import sys
from types import SimpleNamespace
from xml.etree import ElementTree

from active_recon.cli.shape_files import ShapeFiles
from active_recon.errors import ConfigError, DataError
from active_recon.geometry.cameras import orbit_camera
from active_recon.meshes.files import write_mesh
from active_recon.volumes.binvox import write_binvox
from active_recon.volumes.voxel_files import write_npz
from active_recon.volumes.voxels import VoxelGrid
import numpy as np
import pytest
from recorded_messages import small_disk
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


def test_a_shape_without_a_surface_is_told_and_keeps_no_other_from_its_files(tmp_path, capsys):
    empty, files = VoxelGrid(0 * GRID.occupancy, 0.2), ShapeFiles(
        tmp_path / 'mug.stl', tmp_path / 'mug.npz')
    files.write([(GRID, []), (empty, []), (GRID, [])], 0.5)
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        'mug-1.npz', 'mug-1.stl', 'mug-2.npz', 'mug-3.npz', 'mug-3.stl']
    assert 'mug-2.stl: not written: no cell is above the threshold 0.5' in capsys.readouterr().out
    for shapes in ([(empty, [])], [(empty, []), (empty, [])]):
        with pytest.raises(DataError, match='there is no surface yet'):
            files.write(shapes, 0.5)


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


def test_voxels_have_the_name_that_was_given(tmp_path, capsys):
    ShapeFiles(None, tmp_path / 'mug.NPZ').write([(GRID, [])], 0.5)
    assert [path.name for path in tmp_path.iterdir()] == ['mug.NPZ']
    with np.load(tmp_path / 'mug.NPZ') as voxels:
        np.testing.assert_array_equal(voxels['occupancy'], GRID.occupancy)


@pytest.mark.parametrize('name', ['mug.ply', 'mug.npz', 'mug.binvox', 'mug.urdf'])
def test_a_file_that_cannot_be_written_is_told(name, tmp_path):
    (tmp_path / 'taken').write_text('a file')
    path = tmp_path / 'taken' / name
    mesh, voxels = (path, None) if path.suffix in ('.ply', '.urdf') else (None, path)
    with pytest.raises(DataError, match=f'{name}: not written: expected a folder with room'):
        ShapeFiles(mesh, voxels).write([(GRID, RED_VIEWS)], 0.5)


@pytest.mark.parametrize('write', [
    lambda path: write_mesh(GRID.mesh(0.5), path.with_suffix('.stl')),
    lambda path: write_binvox(GRID, path.with_suffix('.binvox')),
    lambda path: write_npz(GRID, path.with_suffix('.npz'), 0.5)], ids=['mesh', 'binvox', 'npz'])
def test_a_shape_is_written_whole_or_what_was_there_stays(write, tmp_path):
    write(tmp_path / 'mug')
    path, = tmp_path.iterdir()
    path.write_text('before')
    with small_disk(100), pytest.raises(OSError):
        write(tmp_path / 'mug')
    assert path.read_text() == 'before'
    assert list(tmp_path.iterdir()) == [path]
