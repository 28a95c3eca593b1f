"""Rotations as matrices and quaternions, held to scipy's."""

from active_recon.geometry.rotations import (
    matrix_from_quaternion,
    quaternion_from_matrix,
    rotation_between,
)
import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

HALF_TURNS = [Rotation.from_rotvec(np.pi * axis) for axis in np.eye(3)]
ROTATIONS = [Rotation.identity(), *HALF_TURNS, *Rotation.random(40, random_state=0)]


@pytest.mark.parametrize('rotation', ROTATIONS)
def test_a_matrix_is_that_of_its_quaternion_whatever_its_length(rotation):
    quaternion = rotation.as_quat()
    np.testing.assert_allclose(
        matrix_from_quaternion(3 * quaternion), rotation.as_matrix(), atol=1e-15)
    np.testing.assert_array_equal(
        matrix_from_quaternion(quaternion), matrix_from_quaternion(-quaternion))


@pytest.mark.parametrize('rotation', ROTATIONS)
def test_a_matrix_comes_back_from_its_unit_quaternion(rotation):
    quaternion = quaternion_from_matrix(rotation.as_matrix())
    assert np.linalg.norm(quaternion) == pytest.approx(1, abs=1e-15)
    np.testing.assert_allclose(
        matrix_from_quaternion(quaternion), rotation.as_matrix(), atol=1e-15)


@pytest.mark.parametrize('fraction', [0.0, 0.1, 0.5, 0.9, 1.0])
@pytest.mark.parametrize('turn', [0.0, 1e-12, 1e-6, 0.3, 3.1])
def test_a_rotation_between_two_is_the_one_that_scipy_finds(turn, fraction):
    start = ROTATIONS[5]
    end = start * Rotation.from_rotvec(turn * np.array([0.6, 0.0, 0.8]))
    np.testing.assert_allclose(
        rotation_between(start.as_matrix(), end.as_matrix(), fraction),
        Slerp([0, 1], Rotation.concatenate([start, end]))(fraction).as_matrix(), atol=1e-12)


def test_the_way_back_is_the_way_there():
    there, back = ROTATIONS[6].as_matrix(), ROTATIONS[7].as_matrix()
    np.testing.assert_allclose(
        rotation_between(there, back, 0.3), rotation_between(back, there, 0.7), atol=1e-14)
