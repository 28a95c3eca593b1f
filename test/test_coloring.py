"""Colours of a surface: from the photographs that face it, of nothing hidden, evened, filled."""

import math

from active_recon.errors import ViewError
from active_recon.geometry.cameras import Camera, Intrinsics, orbit_camera
from active_recon.meshes.coloring import colored, surface_colors
from active_recon.meshes.exposure import find_exposure
from active_recon.meshes.photos import Album, Photo, PHOTO_SIDE
from active_recon.volumes.rendering import composite, Renderer
from active_recon.volumes.voxels import VoxelGrid
import numpy as np
import pytest
import trimesh

LENS = Intrinsics(160, 160, 64, 64, 128, 128)
RED, BLUE, GREEN = (200, 30, 40), (40, 60, 190), (40, 170, 60)


def painted(mesh, colors):
    return trimesh.Trimesh(mesh.vertices, mesh.faces, face_colors=colors, process=False)


def around(count, elevation=0.4, first=0.0):
    return [orbit_camera(first + 2 * math.pi * number / count, elevation, 2.1, LENS)
            for number in range(count)]


def photographed(mesh, cameras, gains=None):
    """Return photographs with light from the camera, each so much brighter than the mesh."""
    renderer = Renderer(mesh)
    light = np.array([0, 0, -1.0])
    return [Photo((composite(renderer.render(camera, 2, light), 255) * gain).clip(0, 255).astype(
        np.uint8), camera) for camera, gain in zip(cameras, gains or [1.0] * len(cameras),
                                                   strict=True)]


@pytest.fixture(scope='module')
def ball():
    """Return a ball that is red where x > 0 and blue elsewhere."""
    made = trimesh.creation.icosphere(4, 0.35)
    return painted(made, np.where(made.triangles_center[:, :1] > 0, RED, BLUE).astype(np.uint8))


@pytest.mark.parametrize('wrong', [
    np.zeros((128, 128, 3)), np.zeros((64, 128, 3), np.uint8), np.zeros((128, 128), np.uint8),
    np.zeros((128, 128, 2), np.uint8), None], ids=['dtype', 'size', 'gray', 'channels', 'none'])
def test_a_photo_is_of_its_camera_s_size_and_type(wrong):
    with pytest.raises(ViewError, match='wrong image size or type: expected .*128 x 128 x 3 or 4'):
        Photo(wrong, orbit_camera(0.0, intrinsics=LENS))


def off(found, true):
    return np.abs(found.astype(float) - true).max(axis=1)


def truth(vertices):
    return np.where(vertices[:, :1] > 0, RED, BLUE)


def test_colors_are_those_of_the_surface_on_every_side(ball):
    found = surface_colors(ball, photographed(ball, around(8) + around(4, -0.6)))
    inside = np.abs(ball.vertices[:, 0]) > 0.03
    assert found.seen.mean() > 0.95
    assert np.median(off(found.colors, truth(ball.vertices))[inside]) < 12
    assert np.mean(off(found.colors, truth(ball.vertices))[inside] < 40) > 0.97


def test_what_one_camera_does_not_see_is_filled_from_what_is_beside_it(ball):
    found = surface_colors(ball, photographed(ball, [orbit_camera(0.0, 0.0, 2.1, LENS)]))
    assert found.seen[ball.vertices[:, 0] > 0.2].all()
    assert not found.seen[ball.vertices[:, 0] < 0].any()
    assert (found.colors[:, 0] > found.colors[:, 2]).all()  # red, behind too


def test_a_thing_in_front_does_not_colour_what_is_behind_it():
    screen = trimesh.creation.box((0.02, 0.3, 0.3)).apply_translation([0.3, 0, 0])
    wall = trimesh.creation.box((0.02, 0.8, 0.8)).apply_translation([-0.3, 0, 0])
    both = trimesh.util.concatenate([screen, wall]).subdivide().subdivide().subdivide()
    of_screen = both.triangles_center[:, 0] > 0
    mesh = painted(both, np.where(of_screen[:, None], RED, GREEN).astype(np.uint8))
    camera = orbit_camera(0.0, 0.0, 2.1, LENS)
    found = surface_colors(mesh, photographed(mesh, [camera]))
    hidden = (mesh.vertices[:, 0] < 0) & (np.abs(mesh.vertices[:, 1:]) < 0.15).all(axis=1)
    assert hidden.sum() > 10
    assert not found.seen[hidden].any()
    assert (found.colors[hidden, 1] > found.colors[hidden, 0]).all()


def test_a_photograph_that_is_twice_as_bright_changes_hardly_anything(ball):
    cameras = around(8)
    even = surface_colors(ball, photographed(ball, cameras)).colors
    gains = [1, 0.6, 1, 0.5, 1, 0.7, 1, 0.8]
    uneven = surface_colors(ball, photographed(ball, cameras, gains))
    level = np.median(uneven.colors[uneven.seen] / np.maximum(even[uneven.seen], 1))
    away = np.abs(uneven.colors / level - even).max(axis=1)[uneven.seen]
    assert np.percentile(away, 90) < 25


def test_gains_are_found_up_to_their_mean():
    rng = np.random.default_rng(0)
    points, shown = rng.uniform(40, 120, (300, 3)), rng.random((5, 300)) > 0.4
    gains = np.exp(rng.normal(0, 0.3, (5, 3)))
    normals = np.broadcast_to([0, 0, -1.0], (5, 300, 3))
    colors = (points[None] * gains[:, None]).clip(0, 240).astype(np.float32)
    found = find_exposure(colors, shown.astype(np.float32), normals)
    ratio = found.gains / gains
    np.testing.assert_allclose(ratio / ratio.mean(axis=0), 1, atol=0.05)
    even = found.evened(colors, normals)
    spread = np.where(shown[..., None], even, np.nan)
    several = shown.sum(axis=0) > 1
    assert (np.nanstd(spread[:, several], axis=0) / points[several]).max() < 0.1


def test_the_light_of_a_lamp_beside_the_camera_is_found():
    rng = np.random.default_rng(1)
    normals = rng.normal(size=(6, 400, 3))
    normals[..., 2] = -np.abs(normals[..., 2])
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    light = 0.4 + 0.6 * np.maximum(normals @ [-0.45, -0.65, -0.61], 0)
    points = rng.uniform(60, 200, (400, 3))
    colors = (points * light[..., None]).astype(np.float32)
    even = find_exposure(colors, np.ones((6, 400), np.float32), normals).evened(colors, normals)
    before, after = (np.std(np.log(each), axis=0).mean() for each in (colors, even))
    assert after < before / 3
    assert np.median(even / points) == pytest.approx(1, abs=0.12)


def test_a_mesh_that_is_too_wide_does_not_take_the_background(ball):
    wide = trimesh.creation.icosphere(4, 0.39)
    found = surface_colors(wide, photographed(ball, around(8) + around(8, -0.4)))
    assert np.percentile(found.colors[:, 1], 90) < 110  # of white it would be 255


def test_without_a_photograph_of_it_a_mesh_has_no_colors(ball):
    away = Camera(orbit_camera(0.0, 0.0, 2.1).turned(0).pose @ np.diag([-1, 1, -1, 1.0]), LENS)
    nothing = Photo(np.zeros((128, 128, 3), np.uint8), away)
    assert surface_colors(ball, [nothing]) is None
    assert surface_colors(ball, []) is None
    assert colored(ball, [nothing]) is ball


def test_what_a_photograph_does_not_hold_gives_no_color(ball):
    photo, = photographed(ball, [orbit_camera(0.0, 0.0, 2.1, LENS)])
    unknown = np.dstack([photo.image, np.zeros((128, 128), np.uint8)])
    assert surface_colors(ball, [Photo(unknown, photo.camera)]) is None


def test_a_colored_mesh_is_the_mesh():
    grid = VoxelGrid(np.ones((6, 6, 6), np.float32), 0.5)
    mesh = grid.mesh(0.5)
    made = colored(mesh, photographed(mesh, around(3)))
    np.testing.assert_array_equal(made.vertices, mesh.vertices)
    assert made.is_watertight
    assert made.visual.vertex_colors.shape == (len(mesh.vertices), 4)


def test_an_album_keeps_the_views_that_are_spread():
    album = Album(4)
    blank = np.zeros((128, 128, 3), np.uint8)
    azimuths = [0.0, 0.1, 1.5, 3.0, 4.5, 4.55]
    for azimuth in azimuths:
        album.add(Photo(blank, orbit_camera(azimuth, 0.3, 2.1, LENS)))
    assert [round(photo.camera.azimuth, 2) for photo in album.photos] == [0.1, 1.5, 3.0, 4.55]
    album.clear()
    assert not album.photos


def test_a_kept_photograph_is_small_and_shows_the_cube():
    camera = orbit_camera(0.3, 0.4, 0.5, Intrinsics(900, 900, 600, 400, 1200, 800))
    photo = Photo.of(np.full((800, 1200, 3), 99, np.uint8), camera, 0.2)
    assert photo.image.shape[:2] == (PHOTO_SIDE, PHOTO_SIDE)
    pixels, _ = photo.camera.project(np.array([[0, 0, 0.0]]))
    np.testing.assert_allclose(pixels, PHOTO_SIDE / 2, atol=1)
