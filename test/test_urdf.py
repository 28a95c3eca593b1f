"""A shape as a robot description: what a simulator reads, weighs and lets stand."""

import math
import sys
from xml.etree import ElementTree

from active_recon.errors import ConfigError
from active_recon.meshes.collision import convex_parts, NO_COACD
from active_recon.meshes.files import write_mesh
from active_recon.meshes.urdf import write_urdf
from active_recon.volumes.refinement import refined_mesh
from active_recon.volumes.voxels import VoxelGrid
import numpy as np
import pytest
import trimesh


@pytest.fixture(scope='module')
def stool():
    """Return a seat on four legs of 20 cm: its convex hull is far from it."""
    cells = np.zeros((16, 16, 16), np.float32)
    cells[3:13, 3:13, 11:13] = 1
    for x in (3, 11):
        for y in (3, 11):
            cells[x:x + 2, y:y + 2, 3:11] = 1
    return refined_mesh(VoxelGrid(cells, 0.32), 0.5)


@pytest.fixture
def without_coacd(monkeypatch):
    monkeypatch.setitem(sys.modules, 'coacd', None)


def test_mass_and_inertia_are_those_of_a_solid_block(tmp_path, without_coacd):
    block = trimesh.creation.box((0.1, 0.2, 0.3)).apply_translation([0.01, 0.02, 0.03])
    assert write_urdf(block, tmp_path / 'a block.urdf', 1000) == NO_COACD
    inertial = ElementTree.parse(tmp_path / 'a block.urdf').find('link/inertial')
    assert float(inertial.find('mass').get('value')) == pytest.approx(6)
    np.testing.assert_allclose(
        [float(value) for value in inertial.find('origin').get('xyz').split()],
        [0.01, 0.02, 0.03], atol=1e-9)
    inertia = {name: float(value) for name, value in inertial.find('inertia').attrib.items()}
    assert inertia == pytest.approx({
        'ixx': 6 * (0.2 ** 2 + 0.3 ** 2) / 12, 'iyy': 6 * (0.1 ** 2 + 0.3 ** 2) / 12,
        'izz': 6 * (0.1 ** 2 + 0.2 ** 2) / 12, 'ixy': 0, 'ixz': 0, 'iyz': 0}, abs=1e-9)


def test_a_description_that_cannot_be_written_leaves_the_one_before(
        without_coacd, stool, tmp_path, monkeypatch):
    def on_a_full_disk(mesh, path):
        if path.name == 'collision_0.stl':
            raise OSError(28, 'No space left on device')
        write_mesh(mesh, path)

    write_urdf(stool, tmp_path / 'stool.urdf')
    before = {path: path.is_file() and path.read_bytes() for path in tmp_path.rglob('*')}
    assert len(before) > 3
    monkeypatch.setattr('active_recon.meshes.urdf.write_mesh', on_a_full_disk)
    with pytest.raises(OSError, match='No space left'):
        write_urdf(stool.copy().apply_scale(2), tmp_path / 'stool.urdf')
    assert {path: path.is_file() and path.read_bytes() for path in tmp_path.rglob('*')} == before


@pytest.mark.parametrize('density', [0, -1, math.nan, math.inf])
def test_a_density_that_is_none_is_refused(density, stool, tmp_path):
    with pytest.raises(ConfigError, match='density: out of range: expected kg/m'):
        write_urdf(stool, tmp_path / 'stool.urdf', density)


def test_without_coacd_each_body_has_its_hull(without_coacd, stool):
    apart = trimesh.util.concatenate([stool, stool.copy().apply_translation([1, 0, 0])])
    parts, missing = convex_parts(apart)
    assert 'one convex hull for each body' in missing
    assert len(parts) == 2
    assert parts[0].volume == pytest.approx(stool.convex_hull.volume)


@pytest.mark.slow
def test_convex_parts_keep_to_the_shape():
    pytest.importorskip('coacd')
    cells = np.zeros((16, 16, 16), np.float32)
    cells[2:14, 4:12, 2:6] = 1
    cells[2:6, 4:12, 2:14] = 1  # an L
    angle = refined_mesh(VoxelGrid(cells, 0.32), 0.5)
    parts, missing = convex_parts(angle)
    assert not missing
    assert all(part.is_convex for part in parts)
    volume = sum(part.volume for part in parts)
    assert angle.volume < volume < 0.8 * angle.convex_hull.volume


def test_it_stands_on_a_plane_in_mujoco(stool, tmp_path, without_coacd):
    mujoco = pytest.importorskip('mujoco')
    write_urdf(stool, tmp_path / 'stool.urdf', 700)
    spec = mujoco.MjSpec.from_file(str(tmp_path / 'stool.urdf'))
    world = spec.worldbody
    world.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[1, 1, 0.1],
                   pos=[0, 0, stool.bounds[0, 2] - 0.01])
    body = world.first_body()
    body.add_freejoint()
    model = spec.compile()
    assert model.body_mass[1] == pytest.approx(700 * stool.volume, rel=1e-3)
    data = mujoco.MjData(model)
    lowest = 0.0
    while data.time < 2:
        mujoco.mj_step(model, data)
        lowest = min(lowest, data.qpos[2])
    assert -0.015 < lowest <= data.qpos[2] < -0.008  # it fell by the centimetre, not through
    assert abs(data.qpos[3]) > 0.999  # upright
    assert np.abs(data.qvel).max() < 1e-2
