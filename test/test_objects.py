"""The models that ship: they load, they are credited, and they are what the credits say."""

import hashlib
import re

from active_recon.errors import MeshError
from active_recon.objects import find_object, shipped_objects
from active_recon.volumes.meshes import load_mesh
from active_recon.volumes.voxelisation import voxelise
import pytest

CREDITS = (find_object('chair').parent / 'CREDITS.md').read_text()


@pytest.mark.parametrize('name', shipped_objects())
def test_a_shipped_object_is_a_solid_that_fits_the_grid(name):
    mesh = load_mesh(find_object(name))
    assert abs(mesh.bounds).max() <= 0.5 + 1e-6
    assert 300 < voxelise(mesh).occupied(0.5).sum() < 16_000


@pytest.mark.parametrize('name', shipped_objects())
def test_a_shipped_object_is_credited_with_its_licence_and_hash(name):
    sha256 = hashlib.sha256(find_object(name).read_bytes()).hexdigest()
    assert re.search(rf'\| `{name}.glb` \|.*\| CC0-1.0 \|', CREDITS)
    assert f'{sha256}  {name}.glb' in CREDITS


def test_all_objects_together_are_small():
    assert sum(find_object(name).stat().st_size for name in shipped_objects()) < 200_000


def test_a_path_is_taken_as_it_is_and_an_unknown_name_refused(tmp_path):
    (tmp_path / 'mug.stl').write_text('')
    assert find_object(str(tmp_path / 'mug.stl')) == tmp_path / 'mug.stl'
    with pytest.raises(MeshError, match='teapot: no such mesh file, and none of bed, car, chair'):
        find_object('teapot')
