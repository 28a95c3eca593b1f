"""Where a turntable's cameras stand, what they see where, and how azimuths wrap."""

import math

from active_recon.errors import ViewError
from active_recon.geometry.cameras import (
    azimuth_difference,
    AZIMUTHS,
    Camera,
    CANONICAL_DISTANCE,
    CANONICAL_INTRINSICS,
    Intrinsics,
    nearest_view,
    orbit_camera,
    pose_azimuths,
    TURN,
    whole_degrees,
    wrap_azimuth,
)
from active_recon.geometry.lenses import Distortion
import numpy as np
import pytest

CAMERAS = [orbit_camera(azimuth, elevation, distance)
           for azimuth in (0.0, 1.0, 3.0, 6.0)
           for elevation, distance in ((0.0, 1.5), (math.radians(30), 2.1), (-1.2, 4.0))]


@pytest.mark.parametrize('azimuth', np.linspace(-20, 20, 41))
def test_a_wrapped_azimuth_is_the_same_direction_in_one_turn(azimuth):
    wrapped = wrap_azimuth(azimuth)
    assert 0 <= wrapped < math.tau
    assert np.exp(1j * wrapped) == pytest.approx(np.exp(1j * azimuth))


def test_the_smallest_negative_azimuth_wraps_into_the_turn():
    assert 0 <= wrap_azimuth(-1e-20) < math.tau


def test_azimuths_of_poses_are_those_of_their_cameras_in_the_turn():
    cameras = [orbit_camera(azimuth) for azimuth in (-1e-20, -1e-17, -1.0, 0.0, 1.0, 3.2, 7.0)]
    found = pose_azimuths(np.stack([camera.pose for camera in cameras]))
    assert (found < TURN).all()
    np.testing.assert_allclose(
        azimuth_difference(found, [camera.azimuth for camera in cameras]), 0, atol=1e-15)


@pytest.mark.parametrize(('azimuth_deg', 'told'), [
    (0, 0), (-0.3, 0), (359.7, 0), (0.6, 1), (-90, 270), (720, 0)])
def test_whole_degrees_are_those_of_one_turn(azimuth_deg, told):
    assert whole_degrees(math.radians(azimuth_deg)) == told


def test_a_difference_of_azimuths_goes_the_short_way_round():
    a, b = np.random.default_rng(0).uniform(-10, 10, (2, 1000))
    apart = azimuth_difference(a, b)
    assert (np.abs(apart) <= math.pi).all()
    np.testing.assert_allclose(np.exp(1j * (b + apart)), np.exp(1j * a), atol=1e-12)
    assert azimuth_difference(0.1, math.tau - 0.1) == pytest.approx(0.2)


def test_the_nearest_view_is_found_across_the_end_of_the_turn():
    assert nearest_view(math.tau - 0.01) == 0
    assert [nearest_view(azimuth + 0.13) for azimuth in AZIMUTHS] == list(range(24))


def test_at_azimuth_zero_the_camera_stands_in_front_and_sees_plus_y_to_the_right():
    camera = orbit_camera(0.0, 0.0, 2.0)
    np.testing.assert_allclose(camera.position, [2, 0, 0], atol=1e-12)
    (right, above), _ = camera.project([[0, 0.1, 0], [0, 0, 0.1]])
    assert right[0] > 68.5
    assert right[1] == pytest.approx(68.5)
    assert above[1] < 68.5  # y runs down
    assert above[0] == pytest.approx(68.5)


def test_azimuth_runs_counter_clockwise_and_elevation_up():
    camera = orbit_camera(math.pi / 2, math.radians(30), 2.0)
    np.testing.assert_allclose(camera.position, [0, math.sqrt(3), 1], atol=1e-12)
    (point,), _ = camera.project([[-0.1, 0, 0]])
    assert point[0] > 68.5


@pytest.mark.parametrize('camera', CAMERAS)
def test_a_pose_is_rigid_and_tells_its_azimuth_elevation_and_distance(camera):
    rotation = camera.pose[:3, :3]
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(rotation) == pytest.approx(1)
    np.testing.assert_allclose(camera.pose @ camera.object_to_camera, np.eye(4), atol=1e-12)
    same = orbit_camera(camera.azimuth, camera.elevation, camera.distance)
    np.testing.assert_allclose(same.pose, camera.pose, atol=1e-12)


@pytest.mark.parametrize('camera', CAMERAS)
def test_the_origin_is_in_the_middle_of_the_image_at_the_camera_s_distance(camera):
    pixels, depths = camera.project([[0, 0, 0]])
    np.testing.assert_allclose(pixels, [[68.5, 68.5]])
    np.testing.assert_allclose(depths, [camera.distance])


BENT = [Camera(orbit_camera(1.0).pose, Intrinsics(90, 95, 70, 66, 137, 137, distortion))
        for distortion in (Distortion('plumb_bob', (-0.28, 0.07, 0.001, -0.002, 0.01)),
                           Distortion('equidistant', (0.05, -0.02, 0.01, -0.004)))]


@pytest.mark.parametrize('samples', [1, 2])
@pytest.mark.parametrize('camera', CAMERAS + BENT)
def test_a_ray_is_projected_to_the_pixel_that_it_came_from(camera, samples):
    rays = camera.ray_directions(samples)
    assert rays.shape == (137 * samples, 137 * samples, 3)
    depth = np.random.default_rng(0).uniform(0.5, 3, rays.shape[:2])
    pixels, depths = camera.project((camera.position + depth[..., None] * rays).reshape(-1, 3))
    np.testing.assert_allclose(depths, depth.ravel())
    row, column = np.indices(rays.shape[:2])
    centers = (np.stack([column, row], axis=-1).reshape(-1, 2) + 0.5) / samples
    np.testing.assert_allclose(pixels, centers, atol=1e-9)


@pytest.mark.parametrize('samples', [1, 2])
@pytest.mark.parametrize('camera', CAMERAS[:1] + BENT)
def test_rays_through_some_pixels_are_those_of_all_pixels(camera, samples):
    left, top, right, bottom = (each * samples for each in (30, 60, 90, 110))
    np.testing.assert_allclose(
        camera.ray_directions(samples, (30, 60, 90, 110)),
        camera.ray_directions(samples)[top:bottom, left:right],
        rtol=0, atol=0 if camera.intrinsics.distortion is None else 1e-9)


@pytest.mark.parametrize('camera', BENT)
def test_cameras_that_share_a_lens_have_the_same_rays_turned_by_their_poses(camera):
    def in_the_optical_frame(each):
        return each.ray_directions() @ each.pose[:3, :3]

    other = Camera(orbit_camera(2.5).pose, camera.intrinsics)
    np.testing.assert_allclose(in_the_optical_frame(other), in_the_optical_frame(camera),
                               atol=1e-12)


def test_the_canonical_camera_just_holds_the_grid_s_sphere():
    camera = orbit_camera(0.3)
    assert camera.distance == CANONICAL_DISTANCE
    radius = math.sqrt(3) / 2
    reach = CANONICAL_INTRINSICS.fx * math.tan(math.asin(radius / camera.distance))
    assert 0.95 < reach / 68.5 < 1


def test_a_lens_on_another_size_of_image_sees_the_same():
    lens = Intrinsics(100, 120, 31, 22, 64, 48)
    point = np.array([[0.1, 0.2, -0.1]])
    pose = orbit_camera(0.4).pose
    small, _ = Camera(pose, lens).project(point)
    large, _ = Camera(pose, lens.resized(192, 96)).project(point)
    np.testing.assert_allclose(large, small * [3, 2])


@pytest.mark.parametrize('pose', [
    np.eye(3), np.full((4, 4), np.nan), np.diag([2.0, 1, 1, 1]), np.diag([-1.0, 1, 1, 1]),
    orbit_camera(0.4).pose.T, np.diag([1.0, 1, 1, 2])],
    ids=['3 x 3', 'nan', 'stretched', 'mirrored', 'transposed', 'scaled'])
def test_a_pose_that_is_not_rigid_is_refused(pose):
    with pytest.raises(ViewError, match='invalid camera pose: expected (a finite|a rotation|0, 0, '
                       '0, 1 as its last row)') as refusal:
        Camera(pose)
    assert refusal.value.kind == 'pose'


def test_a_pose_of_any_number_type_is_kept_in_double_precision():
    for kind in (np.float32, np.float16, np.int64):
        camera = Camera(np.eye(4).astype(kind)).scaled(0.5)
        assert camera.pose.dtype == camera.turned(1.0).pose.dtype == np.float64


def test_a_camera_stays_where_it_is_when_its_array_is_filled_anew():
    pose = orbit_camera(0.4).pose
    camera = Camera(pose)
    pose[:] = orbit_camera(2.0).pose
    assert camera.azimuth == pytest.approx(0.4)


@pytest.mark.parametrize('place', [
    (math.nan, 0.5, 2.0), (0.0, math.inf, 2.0), (0.0, 0.5, 0.0), (0.0, 0.5, -1.0),
    (0.0, math.pi / 2, 2.0)])
def test_a_place_where_no_upright_camera_can_stand_is_refused(place):
    with pytest.raises(ViewError, match='expected'):
        orbit_camera(*place)


def test_a_camera_at_the_origin_still_has_an_elevation():
    assert Camera(np.eye(4)).elevation == 0
