"""Rendered images: edges where geometry puts them, straight alpha, colours from the mesh."""

import math

from active_recon.datasets.making import yawed
from active_recon.geometry.cameras import AZIMUTHS, Camera, Intrinsics, orbit_camera
from active_recon.volumes.meshes import load_mesh
from active_recon.volumes.rendering import composite, Renderer
from active_recon.volumes.voxels import iou
import cv2
import numpy as np
from PIL import Image
import pytest
from scipy.spatial import ConvexHull
import trimesh

BOX = trimesh.creation.box((0.8, 0.5, 0.3))


def analytic_silhouette(vertices, camera, scale=16):
    """Return the coverage of a convex solid's projection, (height, width) in [0, 1], its area."""
    pixels, _ = camera.project(vertices)
    hull = pixels[ConvexHull(pixels).vertices]
    lens = camera.intrinsics
    fine = np.zeros((lens.height * scale, lens.width * scale), np.uint8)
    cv2.fillPoly(fine, [np.round((hull * scale - 0.5) * 256).astype(int)], 255, shift=8)
    coverage = cv2.resize(fine, (lens.width, lens.height), interpolation=cv2.INTER_AREA) / 255
    return coverage, ConvexHull(hull).volume


@pytest.mark.parametrize('azimuth', [0.0, 0.7, 2.5])
def test_a_box_covers_what_its_projection_covers(azimuth):
    camera = orbit_camera(azimuth)
    expected, area = analytic_silhouette(BOX.vertices, camera)
    coverage = Renderer(BOX).render(camera, samples=4)[..., 3] / 255
    assert np.abs(coverage - expected).max() < 0.25
    assert np.abs(coverage - expected).mean() < 0.002
    assert coverage.sum() == pytest.approx(area, rel=0.004)


def test_flat_alpha_is_whether_the_pixel_s_centre_is_covered():
    alpha = Renderer(BOX).render(orbit_camera(0.7), samples=1)[..., 3]
    assert set(np.unique(alpha)) == {0, 255}
    expected, _ = analytic_silhouette(BOX.vertices, orbit_camera(0.7))
    assert (alpha[expected == 1] == 255).all()
    assert (alpha[expected == 0] == 0).all()


def test_an_antialiased_pixel_is_the_mean_of_its_rays_with_straight_alpha():
    mesh = trimesh.creation.icosphere(2, 0.4)
    camera = orbit_camera(1.0)
    lens = camera.intrinsics.resized(274, 274)
    fine = Renderer(mesh).render(Camera(camera.pose, lens), samples=1).astype(float)
    blocks = fine.reshape(137, 2, 137, 2, 4).transpose(0, 2, 1, 3, 4).reshape(137, 137, 4, 4)
    alpha = blocks[..., 3].mean(axis=2)
    color = (blocks[..., :3] * blocks[..., 3:]).sum(axis=2) / np.maximum(
        blocks[..., 3:].sum(axis=2), 1)
    image = Renderer(mesh).render(camera, samples=2)
    np.testing.assert_allclose(image[..., 3], alpha, atol=1)
    np.testing.assert_allclose(image[..., :3], color, atol=1)


def test_the_edge_of_a_white_object_on_white_is_not_dark():
    mesh = trimesh.creation.icosphere(3, 0.4)
    mesh.visual.face_colors = [255, 255, 255, 255]
    image = Renderer(mesh).render(orbit_camera(0.3))
    edge = (image[..., 3] > 0) & (image[..., 3] < 255)
    inside = image[image[..., 3] == 255][:, :3]
    assert edge.any()
    assert image[edge][:, :3].min() >= inside.min() - 1


def test_a_turned_object_is_seen_as_by_a_camera_turned_the_other_way():
    mesh = trimesh.util.concatenate(
        [BOX, trimesh.creation.icosphere(2, 0.2).apply_translation([0.3, 0.1, 0.2])])
    moved = mesh.copy().apply_transform(
        trimesh.transformations.rotation_matrix(0.6, [0, 0, 1]))
    turned = Renderer(moved).render(orbit_camera(0.25 + 0.6))
    still = Renderer(mesh).render(orbit_camera(0.25))
    assert np.abs(turned.astype(int) - still).mean() < 0.05
    assert iou(turned[..., 3] > 127, still[..., 3] > 127, (-2, -1)) > 0.995


def test_a_yawed_object_seen_from_the_front_is_the_object_seen_from_minus_the_yaw():
    mesh = trimesh.creation.box((1, 0.2, 0.1))
    turned = yawed(mesh, math.pi / 2)
    image = Renderer(turned).render(orbit_camera(0.0))
    expected = Renderer(mesh).render(orbit_camera(-math.pi / 2))
    assert np.abs(image.astype(int) - expected).mean() < 0.05
    assert yawed(mesh, 0.7).extents.max() == pytest.approx(1)


@pytest.mark.parametrize('azimuth', [0.0, 2.0])
def test_both_windings_of_a_mesh_are_lit_alike(azimuth):
    inside_out = BOX.copy()
    inside_out.invert()
    np.testing.assert_array_equal(Renderer(BOX).render(orbit_camera(azimuth)),
                                  Renderer(inside_out).render(orbit_camera(azimuth)))


def test_no_view_of_a_turntable_is_dark_and_faces_differ_in_brightness():
    renderer = Renderer(BOX)
    for azimuth in AZIMUTHS:
        image = renderer.render(orbit_camera(azimuth), samples=1)
        seen = image[image[..., 3] > 0][:, 0]
        assert seen.min() > 60
        assert len(np.unique(seen)) > 1


def mean_color(mesh, camera):
    image = Renderer(mesh).render(camera, samples=1)
    color = image[image[..., 3] > 0][:, :3].astype(float).mean(axis=0)
    return color / color.max()


def test_a_mesh_without_colours_is_grey():
    np.testing.assert_allclose(mean_color(BOX, orbit_camera(0.3)), [1, 1, 1], atol=0.01)


@pytest.mark.parametrize('kind', ['face', 'vertex', 'material', 'texture'])
def test_colours_come_from_faces_vertices_materials_and_textures(kind):
    mesh = BOX.copy()
    color = np.array([200, 100, 50, 255], np.uint8)
    if kind == 'face':
        mesh.visual.face_colors = color
    elif kind == 'vertex':
        mesh.visual.vertex_colors = color
    elif kind == 'material':
        material = trimesh.visual.material.PBRMaterial(baseColorFactor=color)
        mesh.visual = trimesh.visual.TextureVisuals(material=material)
    else:
        picture = Image.fromarray(np.full((4, 4, 3), color[:3], np.uint8))
        mesh.visual = trimesh.visual.TextureVisuals(np.full((8, 2), 0.5), image=picture)
    np.testing.assert_allclose(mean_color(mesh, orbit_camera(0.3)), [1, 0.5, 0.25], atol=0.02)


@pytest.mark.parametrize('textured', [False, True])
def test_the_parts_of_a_file_keep_their_own_materials(textured, tmp_path):
    scene = trimesh.Scene()
    for color, y in (([200, 0, 0, 255], 0), ([0, 0, 200, 255], 2)):
        part = trimesh.creation.box((1, 1, 1)).apply_translation([0, y, 0])
        picture = Image.fromarray(np.full((4, 4, 3), color[:3], np.uint8)) if textured else None
        part.visual = trimesh.visual.TextureVisuals(
            np.full((8, 2), 0.5), trimesh.visual.material.PBRMaterial(
                baseColorTexture=picture, baseColorFactor=None if textured else color))
        scene.add_geometry(part)
    scene.export(tmp_path / 'parts.glb')
    mesh = load_mesh(tmp_path / 'parts.glb', up='z', front='x')
    image = Renderer(mesh).render(orbit_camera(0.0, 0.0), samples=1)
    left, right = (half[half[..., 3] > 0] for half in (image[:, :68], image[:, 69:]))
    assert left[:, 0].min() > 50
    assert left[:, 2].max() < 10
    assert right[:, 2].min() > 50
    assert right[:, 0].max() < 10


def test_each_face_shows_its_own_colour():
    mesh = trimesh.creation.box((0.5, 0.5, 0.5))
    front = mesh.face_normals[:, 0] > 0.5
    mesh.visual.face_colors = np.where(front[:, None], [255, 0, 0, 255], [0, 0, 255, 255])
    assert mean_color(mesh, orbit_camera(0.0, 0.0))[2] == 0
    assert mean_color(mesh, orbit_camera(math.pi, 0.0))[0] == 0


def test_the_nearer_of_two_objects_hides_the_other():
    near = trimesh.creation.box((0.1, 0.5, 0.5)).apply_translation([0.3, 0, 0])
    near.visual.face_colors = [0, 255, 0, 255]
    far = trimesh.creation.box((0.1, 0.4, 0.4)).apply_translation([-0.3, 0, 0])
    far.visual.face_colors = [255, 0, 0, 255]
    both = trimesh.util.concatenate([near, far])
    assert mean_color(both, orbit_camera(0.0, 0.0))[0] == 0
    assert mean_color(both, orbit_camera(math.pi, 0.0))[0] == 1


def test_what_stands_outside_the_image_leaves_it_empty():
    aside = BOX.copy().apply_translation([0, 30, 0])
    assert not Renderer(aside).render(orbit_camera(0.0, 0.0)).any()


def test_a_camera_inside_the_object_sees_it_everywhere():
    box = trimesh.creation.box((1, 1, 1))
    assert (Renderer(box).render(orbit_camera(0.0, 0.0, 0.2))[..., 3] == 255).all()


def test_an_object_larger_than_the_image_is_cut_at_its_border():
    image = Renderer(BOX).render(orbit_camera(0.7, distance=0.9))
    wide = Renderer(BOX).render(Camera(
        orbit_camera(0.7, distance=0.9).pose,
        Intrinsics(149.84375, 149.84375, 168.5, 168.5, 337, 337)))
    np.testing.assert_array_equal(image, wide[100:237, 100:237])


def test_a_picture_on_a_background_shows_it_where_it_is_transparent():
    rgba = np.zeros((1, 3, 4), np.uint8)
    rgba[0, 1] = [10, 20, 30, 255]
    rgba[0, 2] = [200, 100, 0, 51]
    np.testing.assert_array_equal(composite(rgba, 100)[0],
                                  [[100, 100, 100], [10, 20, 30], [120, 100, 80]])
    background = np.full((1, 3, 3), [1, 2, 3], np.uint8)
    np.testing.assert_array_equal(composite(rgba, background)[0, 0], [1, 2, 3])
