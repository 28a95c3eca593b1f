"""Mesh files: what other software reads is what was written, in metres, where it stands."""

from active_recon.errors import ConfigError
from active_recon.geometry.cameras import orbit_camera
from active_recon.meshes.files import MESH_FORMATS, write_mesh
from active_recon.volumes.meshes import read_mesh
from active_recon.volumes.rendering import Renderer
import numpy as np
import pytest
import trimesh

EXACT = ('ply', 'obj')
"""Formats that keep colours as they are; the linear ones of GLB are coarse where it is dark."""


@pytest.fixture(scope='module')
def mesh():
    """Return a closed surface that no turn and no shift leaves as it is, each corner coloured."""
    made = trimesh.creation.icosphere(2, 0.04)
    made.apply_scale([1, 2, 3])
    made.apply_translation([0.01, -0.02, 0.03])
    colors = np.random.default_rng(0).integers(0, 256, (len(made.vertices), 3), np.uint8)
    return trimesh.Trimesh(made.vertices, made.faces, vertex_colors=colors, process=False)


@pytest.mark.parametrize('suffix', MESH_FORMATS)
def test_a_written_mesh_is_read_as_closed_and_upright_where_it_was(suffix, mesh, tmp_path):
    path = tmp_path / 'new' / f'ball.{suffix}'
    write_mesh(mesh, path)
    read = read_mesh(path)
    read.merge_vertices()
    assert read.is_watertight
    assert read.is_winding_consistent
    assert len(read.faces) == len(mesh.faces)
    assert read.volume == pytest.approx(mesh.volume, rel=1e-4)
    np.testing.assert_allclose(read.bounds, mesh.bounds, atol=1e-6)


@pytest.mark.parametrize('suffix', EXACT)
def test_colors_come_back_at_their_corners(suffix, mesh, tmp_path):
    path = tmp_path / f'ball.{suffix}'
    write_mesh(mesh, path)
    read = trimesh.load(path, force='mesh', process=False)
    np.testing.assert_array_equal(read.visual.vertex_colors, mesh.visual.vertex_colors)


def test_colors_in_glb_are_linear_on_a_surface_that_is_no_metal(mesh, tmp_path):
    grey = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False, vertex_colors=np.full(
        (len(mesh.vertices), 3), 188, np.uint8))  # half of the brightest light
    write_mesh(grey, tmp_path / 'ball.glb')
    scene = trimesh.load(tmp_path / 'ball.glb', force='scene', process=False)
    visual = next(iter(scene.geometry.values())).visual
    assert visual.material.metallicFactor == 0
    light = visual.vertex_attributes['color']
    assert (light[:, :3] == 128).all()
    assert (light[:, 3] == 255).all()


def test_colors_in_glb_are_read_as_they_were_given(mesh, tmp_path):
    write_mesh(mesh, tmp_path / 'ball.glb')
    apart = np.abs(read_mesh(tmp_path / 'ball.glb').visual.vertex_colors.astype(int)
                   - mesh.visual.vertex_colors)
    assert apart.max() <= 7  # half a step of 8 bits where it is darkest
    assert apart.mean() < 1


def test_a_mesh_without_colors_is_written_and_read_as_glb(mesh, tmp_path):
    write_mesh(trimesh.Trimesh(mesh.vertices, mesh.faces, process=False), tmp_path / 'ball.glb')
    assert len(read_mesh(tmp_path / 'ball.glb').faces) == len(mesh.faces)


def test_glb_is_y_up_with_the_front_at_z(mesh, tmp_path):
    write_mesh(mesh, tmp_path / 'ball.glb')
    read = trimesh.load(tmp_path / 'ball.glb', force='mesh', process=False)
    np.testing.assert_allclose(read.vertices, mesh.vertices[:, [1, 2, 0]], atol=1e-6)


def test_writing_leaves_the_mesh_as_it_was(mesh, tmp_path):
    before = mesh.vertices.copy(), mesh.visual.vertex_colors.copy()
    write_mesh(mesh, tmp_path / 'ball.glb')
    np.testing.assert_array_equal(mesh.vertices, before[0])
    np.testing.assert_array_equal(mesh.visual.vertex_colors, before[1])


def test_a_mesh_of_another_format_is_refused(mesh, tmp_path):
    with pytest.raises(ConfigError, match='no mesh has that suffix: expected ply, obj, stl, glb'):
        write_mesh(mesh, tmp_path / 'ball.docx')


def test_a_glb_of_one_material_has_the_color_that_it_has_beside_another(tmp_path):
    parts = [trimesh.creation.box().apply_translation([place, 0, 0]) for place in (0, 2)]
    for part, light in zip(parts, ([0.2, 0.5, 0.05], [0.9, 0.1, 0.5]), strict=True):
        part.visual = trimesh.visual.TextureVisuals(
            material=trimesh.visual.material.PBRMaterial(baseColorFactor=[*light, 1.0]))
    parts[0].export(tmp_path / 'alone.glb')
    trimesh.Scene(parts).export(tmp_path / 'both.glb')
    assert (read_mesh(tmp_path / 'alone.glb').visual.face_colors[:, :3] == [124, 188, 64]).all()
    shown = [Renderer(read_mesh(tmp_path / name)).render(orbit_camera(0.0, 0.5, 6.0))
             for name in ('alone.glb', 'both.glb')]
    colors = [np.unique(each[each[..., 3] == 255][:, :3], axis=0).astype(int) for each in shown]
    apart = np.abs(colors[0][:, None] - colors[1]).max(axis=2).min(axis=1)
    assert apart.max() <= 2


@pytest.mark.parametrize('materials', [
    [{}], [{}, {'metallicFactor': 0.5}], [{'baseColorFactor': [1.0, 1.0, 1.0, 1.0]}]],
    ids=['one', 'two', 'white'])
def test_the_corners_of_a_glb_of_several_parts_have_the_colors_of_their_part(materials, tmp_path):
    def with_materials(tree):
        tree['materials'] = [{'pbrMetallicRoughness': each} for each in materials]
        for number, part in enumerate(tree['meshes']):
            part['primitives'][0]['material'] = number % len(materials)

    parts = [trimesh.creation.box().apply_translation([0, 0, place]) for place in (0, 2, 4)]
    for part, light in zip(parts, ([128, 10, 10], [10, 10, 128], [10, 128, 10]), strict=True):
        part.visual.vertex_colors = np.tile(np.uint8([*light, 255]), (8, 1))
    (tmp_path / 'parts.glb').write_bytes(
        trimesh.Scene(parts).export(file_type='glb', tree_postprocessor=with_materials))
    read = read_mesh(tmp_path / 'parts.glb')
    expected = np.array([[188, 56, 56], [56, 56, 188], [56, 188, 56]])[
        np.rint(read.vertices[:, 0] / 2).astype(int)]  # the file's z is x here
    np.testing.assert_array_equal(read.visual.vertex_colors[:, :3], expected)


def test_a_material_in_glb_colours_the_corners_colors(tmp_path):
    part = trimesh.creation.box()
    part.visual.vertex_colors = np.tile(np.uint8([255, 128, 128, 255]), (8, 1))

    def tinted(tree):
        tree['materials'] = [{'pbrMetallicRoughness': {'baseColorFactor': [0.2, 1.0, 0.4, 1.0]}}]
        tree['meshes'][0]['primitives'][0]['material'] = 0

    (tmp_path / 'box.glb').write_bytes(
        trimesh.Scene([part]).export(file_type='glb', tree_postprocessor=tinted))
    colors = read_mesh(tmp_path / 'box.glb').visual.vertex_colors[:, :3].astype(int)
    assert np.abs(colors - [124, 188, 124]).max() <= 1
