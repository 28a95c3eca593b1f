"""A turntable's angle and a fixed camera tell where the camera stands around the object."""

import math

from active_recon.errors import ConfigError, ViewError
from active_recon.geometry.cameras import azimuth_difference, Camera, orbit_camera
from active_recon.geometry.turntable_pose import FixedCamera
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

START = orbit_camera(0.8, math.radians(25), 0.7).pose
ANGLES = [-7.0, -0.3, 0.0, 1.0, math.pi, 20.0]


def test_at_zero_the_camera_stands_where_it_was_calibrated():
    np.testing.assert_allclose(FixedCamera(START).pose_at(0.0), START, atol=1e-15)


@pytest.mark.parametrize('angle', ANGLES)
@pytest.mark.parametrize('direction', [1, -1])
def test_the_camera_s_azimuth_falls_by_what_the_object_turns_counter_clockwise(angle, direction):
    camera = Camera(FixedCamera(START, direction).pose_at(angle))
    assert abs(azimuth_difference(camera.azimuth, 0.8 - direction * angle)) < 1e-9
    assert camera.elevation == pytest.approx(math.radians(25))
    assert camera.distance == pytest.approx(0.7)


@pytest.mark.parametrize('angle', ANGLES)
def test_a_camera_that_looks_at_the_object_is_the_orbit_s_camera_of_that_azimuth(angle):
    np.testing.assert_allclose(FixedCamera(START).pose_at(angle),
                               orbit_camera(0.8 - angle, math.radians(25), 0.7).pose, atol=1e-9)


@pytest.mark.parametrize('angle', ANGLES)
def test_a_point_on_the_turned_object_is_seen_where_the_fixed_camera_sees_it(angle):
    on_object = np.array([0.1, -0.05, 0.2])
    in_room = Rotation.from_euler('z', angle).apply(on_object)  # rooms and objects agree at 0
    seen, depth = Camera(FixedCamera(START).pose_at(angle)).project(on_object[None])
    expected, expected_depth = Camera(START).project(in_room[None])
    np.testing.assert_allclose(seen, expected)
    np.testing.assert_allclose(depth, expected_depth)


def test_a_camera_is_made_of_the_parameters_that_a_calibration_writes():
    quaternion = Rotation.from_matrix(START[:3, :3]).as_quat()
    camera = FixedCamera.from_parameters(START[:3, 3].tolist(), quaternion.tolist(), -1)
    np.testing.assert_allclose(camera.pose_at_zero, START, atol=1e-12)
    assert camera.direction == -1


@pytest.mark.parametrize('angle', [math.nan, math.inf])
def test_an_angle_that_is_not_finite_is_refused(angle):
    with pytest.raises(ViewError, match="invalid joint position: expected a finite angle of the "
                       "turntable's joint") as refusal:
        FixedCamera(START).pose_at(angle)
    assert refusal.value.kind == 'joint'


@pytest.mark.parametrize(('position', 'orientation', 'direction', 'said'), [
    ([1, 2], [0, 0, 0, 1], 1, 'camera_position: .*got .*calibrate'),
    ([0, 0, 0], [0, 0, 0, 1], 1, 'camera_position'),
    ([1, 2, math.nan], [0, 0, 0, 1], 1, 'camera_position'),
    ([1, 2, 3], [0, 0, 0], 1, 'camera_orientation: .*got .*calibrate'),
    ([1, 2, 3], [0, 0, 0, 0], 1, 'camera_orientation'),
    ([1, 2, 3], [0, 0, 0, math.nan], 1, 'camera_orientation'),
    ([1, 2, 3], [0, 0, 0, 1], 0,
     'turntable_direction: invalid direction: expected 1 or -1, got 0'),
])
def test_parameters_of_no_camera_are_refused(position, orientation, direction, said):
    with pytest.raises(ConfigError, match=said):
        FixedCamera.from_parameters(position, orientation, direction)
