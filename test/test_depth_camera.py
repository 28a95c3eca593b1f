"""Rendered depth is what geometry says, and a simulated camera spoils it as it says."""

import math

from active_recon.errors import ViewError
from active_recon.geometry.cameras import Camera, Intrinsics, orbit_camera
from active_recon.geometry.canonical import framing_camera
from active_recon.geometry.resampling import depth_seen_by
from active_recon.simulation.depth_camera import (
    DepthFaults,
    draw_depth_faults,
    measured_depth,
    measured_evidence,
    surface_normals,
    with_plane,
)
from active_recon.volumes.depth_evidence import depth_evidence
from active_recon.volumes.depth_images import DepthImage, usable_depth
from active_recon.volumes.rendering import Renderer
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
import trimesh

LENS = Intrinsics(150.0, 150.0, 64.0, 64.0, 128, 128)
CAMERA = orbit_camera(0.4, 0.5, 2.0, LENS)
RADIUS = 0.45


def ball_depth(camera):
    """Return the depth of a ball about the origin along each pixel's ray, 0 beside it."""
    rays = camera.ray_directions()
    along = rays @ -camera.position / (rays ** 2).sum(axis=-1)  # of the point nearest to it
    off = ((camera.position + along[..., None] * rays) ** 2).sum(axis=-1)
    half = np.sqrt(np.maximum(RADIUS ** 2 - off, 0) / (rays ** 2).sum(axis=-1))
    return np.where(off < RADIUS ** 2, along - half, 0).astype(np.float32)


BALL = ball_depth(CAMERA)


def rng():
    return np.random.default_rng(0)


def test_the_rendered_depth_of_a_ball_is_its_distance_along_the_axis():
    renderer = Renderer(trimesh.creation.icosphere(5, RADIUS))
    found = renderer.depth(CAMERA)
    both = (found > 0) & (BALL > 0)
    np.testing.assert_array_equal(found > 0, renderer.render(CAMERA, samples=1)[..., 3] > 0)
    assert ((found > 0) ^ (BALL > 0)).sum() < 60
    assert np.median(np.abs(found - BALL)[both]) < 1e-3


def test_a_camera_that_looks_past_the_mesh_measures_nothing():
    aside = Camera(CAMERA.pose, Intrinsics(150.0, 150.0, -900.0, 64.0, 128, 128))
    assert not Renderer(trimesh.creation.box((0.4, 0.4, 0.4))).depth(aside).any()


def test_framed_depth_shows_the_same_points():
    turned = CAMERA.pose.copy()
    turned[:3, :3] = turned[:3, :3] @ Rotation.from_euler('y', 0.12).as_matrix()
    camera = Camera(turned, Intrinsics(300.0, 300.0, 128.0, 128.0, 256, 256))
    target = framing_camera(camera, 1.0, 64)
    framed = depth_seen_by(target, ball_depth(camera), camera)
    known = framed > 0
    points = target.position + framed[known][:, None] * target.ray_directions()[known]
    away = np.abs(np.linalg.norm(points, axis=1) - RADIUS)
    assert known.mean() > 0.15
    assert np.median(away) < 0.003


def test_a_camera_without_faults_measures_what_there_is():
    np.testing.assert_array_equal(measured_depth(BALL, 150.0, DepthFaults(), rng()), BALL)


def test_scale_and_steps_are_those_that_are_asked_for():
    scaled = measured_depth(BALL, 150.0, DepthFaults(scale=-0.01), rng())
    np.testing.assert_allclose(scaled, BALL * 0.99, rtol=1e-6)
    stepped = measured_depth(BALL, 150.0, DepthFaults(step=0.02), rng())
    np.testing.assert_allclose(stepped, np.rint(BALL / 0.02) * 0.02, atol=1e-6)
    assert np.abs(stepped - BALL).max() <= 0.01 + 1e-6


def test_no_fault_gives_a_value_where_there_is_none():
    for seed in range(5):
        draw = np.random.default_rng(seed)
        found = measured_depth(BALL, 150.0, draw_depth_faults(draw), draw)
        assert not found[BALL == 0].any()
        assert 0.2 < (found > 0).sum() / (BALL > 0).sum() <= 1


def test_the_same_generator_gives_the_same_measurement():
    faults = draw_depth_faults(rng())
    np.testing.assert_array_equal(measured_depth(BALL, 150.0, faults, rng()),
                                  measured_depth(BALL, 150.0, faults, rng()))


STEP = np.full((64, 64), 1.0, np.float32)
STEP[:, 32:] = 2.0
BESIDE = np.zeros((64, 64), np.bool_)
BESIDE[:, 31:33] = True


def test_holes_and_flying_pixels_are_beside_edges_alone():
    holes = measured_depth(STEP, 60.0, DepthFaults(edge_holes=1.0), rng())
    np.testing.assert_array_equal(holes == 0, BESIDE)
    flying = measured_depth(STEP, 60.0, DepthFaults(flying=1.0), rng())
    np.testing.assert_array_equal(flying[~BESIDE], STEP[~BESIDE])
    assert ((flying > 1) & (flying < 2))[BESIDE].mean() > 0.95


def test_normals_of_a_ball_point_from_its_centre():
    normals = surface_normals(BALL, 150.0) @ CAMERA.pose[:3, :3].T
    points = CAMERA.position + BALL[..., None] * CAMERA.ray_directions()
    outward = points / np.linalg.norm(points, axis=-1, keepdims=True)
    inner = BALL > 0
    inner[1:-1, 1:-1] &= inner[:-2, 1:-1] & inner[2:, 1:-1] & inner[1:-1, :-2] & inner[1:-1, 2:]
    facing = (outward * CAMERA.direction).sum(axis=-1) > 0.6
    cosine = (normals * outward).sum(axis=-1)[inner & facing]
    assert cosine.min() > 0.98


def test_grazing_surfaces_are_lost_where_a_ball_turns_away():
    found = measured_depth(BALL, 150.0, DepthFaults(grazing=0.5), rng())
    points = CAMERA.position + BALL[..., None] * CAMERA.ray_directions()
    rays = CAMERA.ray_directions()
    rays = rays / np.linalg.norm(rays, axis=-1, keepdims=True)
    cosine = -(points / RADIUS * rays).sum(axis=-1)
    assert (found > 0)[(BALL > 0) & (cosine > 0.6)].mean() > 0.99
    assert (found == 0)[(BALL > 0) & (cosine < 0.4)].mean() > 0.95


def test_shiny_parts_are_one_patch_in_which_the_surface_faces_one_way():
    lost = (measured_depth(BALL, 150.0, DepthFaults(shiny=0.3), rng()) == 0) & (BALL > 0)
    assert 0.01 < lost.sum() / (BALL > 0).sum() < 0.3
    directions = surface_normals(BALL, 150.0)[lost]
    assert (directions @ directions.T).min() > math.cos(2 * 0.3) - 0.05


def test_a_plane_hides_what_is_behind_it_and_shows_where_nothing_is():
    rays = CAMERA.ray_directions()
    floor = with_plane(BALL, rays, CAMERA.position, np.array([0.0, 0, 1]), -RADIUS)
    points = CAMERA.position + floor[..., None] * rays
    np.testing.assert_array_equal(floor[BALL > 0], BALL[BALL > 0])
    np.testing.assert_allclose(points[(BALL == 0) & (floor > 0)][:, 2], -RADIUS, atol=1e-5)
    before = with_plane(BALL, rays, CAMERA.position, CAMERA.direction, 1.0)
    np.testing.assert_allclose(before, 1.0, atol=1e-5)


def test_evidence_of_several_views_is_the_sum_of_each_in_any_order():
    other = orbit_camera(2.0, 0.1, 2.0, LENS)
    views = [(BALL, CAMERA), (ball_depth(other), other)]
    one, two = (measured_evidence(order, DepthFaults(), rng(), 16)
                for order in (views, views[::-1]))
    np.testing.assert_allclose(one, two, atol=1e-6)
    np.testing.assert_allclose(one, sum(depth_evidence(*view, 16) for view in views), atol=1e-6)


SIZE = 0.2
PLACED = CAMERA.scaled(SIZE)


def test_usable_depth_is_in_sides_of_the_cube():
    spoilt = BALL * SIZE
    spoilt[50, 60:63] = math.nan, math.inf, -1
    depth, camera = usable_depth(DepthImage(spoilt), PLACED, SIZE)
    assert camera.distance == pytest.approx(2.0)
    assert not depth[50, 60:63].any()
    spoilt[50, 60:63] = 0
    np.testing.assert_allclose(depth, spoilt / SIZE, rtol=1e-6)


def test_depth_with_a_camera_of_its_own_is_of_that_one_s_size():
    own = Camera(PLACED.pose, LENS.resized(64, 64))
    depth, camera = usable_depth(DepthImage(BALL[::2, ::2] * SIZE, own), PLACED, SIZE)
    assert depth.shape == (64, 64)
    assert camera.intrinsics == own.intrinsics


@pytest.mark.parametrize(('metres', 'said'), [
    (BALL[:100] * SIZE, 'wrong depth image: expected 128 x 128 pixels.*got 128 x 100'),
    (BALL * 0, 'empty depth image'),
    (np.full_like(BALL, math.nan), 'empty depth image'),
    (-BALL, 'empty depth image'),
    (BALL * SIZE / 1000, 'depth contradicts the camera.*metres read as millimetres'),
    (BALL * SIZE * 1000, 'depth contradicts the camera.*millimetres read as metres'),
    (BALL * SIZE * 4, 'depth contradicts the camera.*its unit, its scale and its alignment'),
], ids=['size', 'zeros', 'nan', 'negative', 'too small', 'too large', 'scale'])
def test_depth_that_cannot_be_right_is_refused_in_a_line(metres, said):
    with pytest.raises(ViewError, match=said) as caught:
        usable_depth(DepthImage(metres), PLACED, SIZE)
    assert caught.value.kind == 'depth'
    assert '\n' not in str(caught.value)


@pytest.mark.parametrize('distance', [0.5, 1.0])
def test_a_wrong_distance_before_a_camera_that_is_near_is_not_called_one_in_millimetres(distance):
    near = orbit_camera(0.4, 0.5, distance * SIZE, LENS)
    with pytest.raises(ViewError, match='its unit, its scale and its alignment'):
        usable_depth(DepthImage(np.full_like(BALL, 5 * SIZE)), near, SIZE)


def test_metres_read_as_millimetres_are_noticed_before_a_camera_that_is_near():
    near = orbit_camera(0.4, 0.5, SIZE, LENS)
    with pytest.raises(ViewError, match='metres read as millimetres'):
        usable_depth(DepthImage(np.full_like(BALL, SIZE / 1000)), near, SIZE)
    usable_depth(DepthImage(np.full_like(BALL, SIZE)), near, SIZE)
