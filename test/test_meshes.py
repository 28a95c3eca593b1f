"""Meshes from files: turned upright by their format or by options, fitted, or refused."""

import itertools

from active_recon.errors import ConfigError, MeshError
from active_recon.volumes.meshes import fit_to_grid, load_mesh, upright
import numpy as np
import pytest
import trimesh

# A wedge unlike any of its mirror images: which way each axis went can be read from it.
WEDGE = trimesh.Trimesh(
    [[0, 0, 0], [4, 0, 0], [0, 2, 0], [0, 0, 1]],
    [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], process=False)


def turned_by(path, **axes):
    """Return where the wedge's long x, y and z edges point after loading, (3, 3)."""
    loaded = load_mesh(path, **axes)
    corner, *ends = loaded.vertices[np.argsort(
        [np.linalg.norm(WEDGE.vertices - v, axis=1).argmin() for v in WEDGE.vertices])]
    return np.round([(end - corner) / np.linalg.norm(end - corner) for end in ends], 6)


@pytest.mark.parametrize('suffix', ['glb', 'gltf'])
def test_gltf_is_y_up_with_the_front_at_plus_z(suffix, tmp_path):
    path = tmp_path / f'wedge.{suffix}'
    trimesh.Scene(WEDGE).export(path)
    np.testing.assert_allclose(turned_by(path), [[0, 1, 0], [0, 0, 1], [1, 0, 0]])


@pytest.mark.parametrize('suffix', ['ply', 'obj', 'off', 'stl'])
def test_other_formats_are_taken_as_z_up_with_the_front_at_plus_x(suffix, tmp_path):
    path = tmp_path / f'wedge.{suffix}'
    WEDGE.export(path)
    loaded = load_mesh(path)
    np.testing.assert_allclose(loaded.extents, [1, 0.5, 0.25], atol=1e-6)
    assert loaded.volume == pytest.approx(WEDGE.volume / 64)
    assert loaded.center_mass[0] < 0  # the thick end, as in the file


def test_options_say_which_axes_are_up_and_front(tmp_path):
    path = tmp_path / 'wedge.ply'
    WEDGE.export(path)
    np.testing.assert_allclose(turned_by(path, up='y', front='-z'),
                               [[0, -1, 0], [0, 0, 1], [-1, 0, 0]])
    trimesh.Scene(WEDGE).export(tmp_path / 'wedge.glb')
    np.testing.assert_allclose(turned_by(tmp_path / 'wedge.glb', up='z', front='x'), np.eye(3))


AXES = [sign + axis for sign in ('', '+', '-') for axis in 'xyz']


@pytest.mark.parametrize(('up', 'front'), [
    pair for pair in itertools.product(AXES, AXES) if pair[0][-1] != pair[1][-1]])
def test_every_pair_of_axes_is_a_rotation_that_brings_them_to_z_and_x(up, front):
    rotation = upright(up, front)
    assert np.linalg.det(rotation) == pytest.approx(1)
    for axis, target in ((up, [0, 0, 1]), (front, [1, 0, 0])):
        vector = np.eye(3)['xyz'.index(axis[-1])] * (-1 if axis[0] == '-' else 1)
        np.testing.assert_allclose(rotation @ vector, target)


@pytest.mark.parametrize(('up', 'front', 'message'), [
    ('w', 'x', "up: not an axis: expected x, y or z, .*got 'w'"),
    ('z', '--x', "front: not an axis: expected x, y or z, .*got '--x'"),
    ('z', '-z', 'on the same axis: expected two, got z and -z')])
def test_axes_that_make_no_frame_are_refused(up, front, message):
    with pytest.raises(ConfigError, match=message):
        upright(up, front)


def test_a_fitted_mesh_is_centred_and_one_metre_long_and_the_given_one_stays():
    mesh = trimesh.creation.box((3, 2, 6))
    mesh.apply_translation([5, 5, 5])
    fitted = fit_to_grid(mesh)
    np.testing.assert_allclose(fitted.bounds, [[-0.25, -1 / 6, -0.5], [0.25, 1 / 6, 0.5]])
    np.testing.assert_allclose(mesh.bounds[0], [3.5, 4, 2])


def test_the_parts_of_a_scene_are_one_mesh_and_keep_their_places(tmp_path):
    scene = trimesh.Scene()
    scene.add_geometry(trimesh.creation.box((1, 1, 1)))
    scene.add_geometry(trimesh.creation.box((1, 1, 1)),
                       transform=trimesh.transformations.translation_matrix([3, 0, 0]))
    scene.export(tmp_path / 'two.glb')
    loaded = load_mesh(tmp_path / 'two.glb')
    assert loaded.body_count == 2
    np.testing.assert_allclose(loaded.extents, [0.25, 1, 0.25])



@pytest.mark.parametrize(('name', 'content'), [
    ('empty.ply', b''), ('empty.glb', b''), ('empty.obj', b''), ('text.ply', b'no mesh at all'),
    ('text.glb', b'no mesh at all'), ('text.stl', b'no mesh at all'), ('text.off', b'no mesh'),
    ('faceless.obj', b'v 0 0 0\nv 1 0 0\nv 0 1 0\n'), ('picture.png', b'\x89PNG\r\n\x1a\n'),
    ('nameless', b'v 0 0 0'),
    ('flat.obj', b'v 0 0 0\nv 0 0 0\nv 0 0 0\nf 1 2 3\n'),
    ('needle.obj', b'v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n'),
    ('nan.obj', b'v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n'),
    ('inf.obj', b'v inf 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n'),
    ('beyond.obj', b'v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n')])
def test_what_holds_no_face_with_an_area_is_refused_with_its_path(name, content, tmp_path):
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(MeshError, match=f'{name}: (no mesh|a mesh without|no surface: expected '
                       'faces)'):
        load_mesh(path)


def test_a_truncated_glb_is_refused(tmp_path):
    trimesh.Scene(WEDGE).export(tmp_path / 'whole.glb')
    whole = (tmp_path / 'whole.glb').read_bytes()
    for share in (0.1, 0.5, 0.9):
        (tmp_path / 'cut.glb').write_bytes(whole[:int(len(whole) * share)])
        with pytest.raises(MeshError, match='cut.glb: no mesh that can be read'):
            load_mesh(tmp_path / 'cut.glb')


@pytest.mark.parametrize('corner', [4, -1])
@pytest.mark.parametrize('suffix', ['ply', 'glb'])
def test_a_face_with_a_corner_that_the_file_lacks_is_refused(suffix, corner, tmp_path):
    path = tmp_path / f'mesh.{suffix}'
    path.write_bytes(WEDGE.export(file_type=suffix).replace(
        np.int32([1, 2, 3]).tobytes(), np.int32([1, 2, corner]).tobytes()))
    with pytest.raises(MeshError, match=f'mesh.{suffix}: no mesh that can be read'):
        load_mesh(path)


def test_a_missing_file_and_a_folder_are_refused(tmp_path):
    for path in (tmp_path / 'none.ply', tmp_path):
        with pytest.raises(MeshError, match='no such mesh file'):
            load_mesh(path)
