"""The demo's object and its true cells."""

from active_recon.demo.known_object import KnownObject
import pytest
import trimesh


def saved(mesh, path):
    mesh.export(path)
    return path


@pytest.mark.parametrize('resolution', [32, pytest.param(64, marks=pytest.mark.slow)])
def test_a_scan_without_an_underside_is_as_solid_as_cameras_can_tell(tmp_path, resolution):
    box = trimesh.creation.box((0.6, 0.6, 0.9))
    whole = KnownObject(saved(box, tmp_path / 'whole.ply')).occupied(resolution)
    box.update_faces(box.face_normals[:, 2] > -0.5)
    scan = KnownObject(saved(box, tmp_path / 'scan.ply')).occupied(resolution)
    assert scan.sum() > 0.9 * whole.sum()
    assert not (scan & ~whole).any()
