"""What depth says of a cell follows from the distance along the ray, and from nothing else."""

from dataclasses import replace
import math

from active_recon.geometry.cameras import Camera, Intrinsics, orbit_camera
from active_recon.geometry.lenses import Distortion
from active_recon.volumes.depth_evidence import depth_evidence, no_evidence, REACH
import numpy as np
import pytest

SIDE = 16
LENS = Intrinsics(300.0, 280.0, 150.0, 160.0, 310, 330)
CAMERAS = [orbit_camera(0.7, 0.4, 2.1, LENS), orbit_camera(3.0, -0.3, 1.7, LENS)]
ALONG = (np.arange(SIDE) + 0.5) / SIDE - 0.5
CENTERS = np.stack(np.meshgrid(ALONG, ALONG, ALONG, indexing='ij'), -1)


def plane_depth(camera, distance):
    """Return the depth of a wall at right angles to the optical axis."""
    return np.full((camera.intrinsics.height, camera.intrinsics.width), distance, np.float32)


@pytest.mark.parametrize('camera', CAMERAS)
def test_shares_are_those_of_the_signed_distance_along_the_ray(camera):
    free, near, behind = depth_evidence(plane_depth(camera, 2.0), camera, SIDE)
    _, depth = camera.project(CENTERS.reshape(-1, 3))
    depth = depth.reshape(free.shape)
    distance = np.linalg.norm(CENTERS - camera.position, axis=-1)
    signed = np.clip((2.0 - depth) * distance / depth / REACH, -1, 1)
    np.testing.assert_allclose(free - behind, signed, atol=2e-5)
    np.testing.assert_allclose(free + near + behind, 1, atol=1e-6)
    assert (np.minimum(free, behind) == 0).all()
    assert min(free.max(), behind.max(), near.max()) > 0.9


@pytest.mark.parametrize('value', [0.0, -1.0, math.nan, math.inf])
def test_a_pixel_without_a_value_says_nothing(value):
    camera = CAMERAS[0]
    assert not depth_evidence(plane_depth(camera, value), camera, SIDE).any()
    half = plane_depth(camera, 2.0)
    half[:, :150] = value
    pixels, _ = camera.project(CENTERS.reshape(-1, 3))
    known = depth_evidence(half, camera, SIDE).sum(axis=0).ravel() > 0
    np.testing.assert_array_equal(known, pixels[:, 0] >= 150)


def test_cells_outside_the_image_and_behind_the_camera_have_nothing():
    narrow = Camera(CAMERAS[0].pose, Intrinsics(4000.0, 4000.0, 50.0, 50.0, 100, 100))
    known = depth_evidence(plane_depth(narrow, 2.0), narrow, SIDE).sum(axis=0) > 0
    pixels, _ = narrow.project(CENTERS.reshape(-1, 3))
    inside = ((pixels >= 0) & (pixels < 100)).all(axis=1)
    np.testing.assert_array_equal(known.ravel(), inside)
    away = CAMERAS[0].pose @ np.diag([1.0, -1, -1, 1])  # turned about its own x
    assert not depth_evidence(plane_depth(narrow, 2.0), Camera(away, LENS), SIDE).any()


def test_the_size_of_the_image_does_not_count():
    camera = CAMERAS[0]
    small = replace(camera, intrinsics=LENS.resized(62, 66))
    np.testing.assert_allclose(depth_evidence(plane_depth(small, 2.1), small, SIDE),
                               depth_evidence(plane_depth(camera, 2.1), camera, SIDE), atol=1e-5)


def test_a_camera_turned_by_a_quarter_sees_the_grid_turned_by_a_quarter():
    camera = CAMERAS[0]
    depth = np.random.default_rng(0).uniform(1.5, 2.5, (330, 310)).astype(np.float32)
    found = depth_evidence(depth, camera.turned(math.pi / 2), SIDE)
    expected = np.rot90(depth_evidence(depth, camera, SIDE), axes=(1, 2))
    # A cell on the border of two pixels may take either
    assert (np.abs(found - expected).max(axis=0) > 1e-4).mean() < 0.01


def test_a_lens_without_distortion_is_a_pinhole():
    camera = CAMERAS[0]
    depth = np.random.default_rng(0).uniform(1.5, 2.5, (330, 310)).astype(np.float32)
    lens = replace(LENS, distortion=Distortion('plumb_bob', (0.0,) * 5))
    bent = replace(camera, intrinsics=lens)
    differs = np.abs(depth_evidence(depth, bent, SIDE)
                     - depth_evidence(depth, camera, SIDE)).max(axis=0) > 1e-4
    assert differs.mean() < 0.01


def test_a_distorted_camera_beside_the_grid_casts_no_point_that_is_not_finite():
    camera = orbit_camera(0.3, 0.1, 0.4, replace(
        LENS, distortion=Distortion('plumb_bob', (-0.28, 0.07, 0.001, -0.002, 0.01))))
    assert np.isfinite(depth_evidence(plane_depth(camera, 0.5), camera, SIDE)).all()


def test_before_the_first_image_there_is_no_evidence():
    assert no_evidence(SIDE).shape == (3, SIDE, SIDE, SIDE)
    assert not no_evidence(SIDE).any()
