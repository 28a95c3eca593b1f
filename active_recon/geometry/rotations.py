"""
Rotations as matrices (3, 3) and as unit quaternions x, y, z, w; poses between two.

What scipy.spatial does for many rotations at once; its import is a third of a node's start.
"""

from collections.abc import Iterable
import math

import numpy as np
from numpy.typing import ArrayLike, NDArray


def matrix_from_quaternion(quaternion: Iterable[float]) -> NDArray[np.float64]:
    """Return the matrix (3, 3) of a quaternion x, y, z, w other than zero, of any length."""
    x, y, z, w = _normalised(quaternion)
    return np.array([
        [x * x - y * y - z * z + w * w, 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), -x * x + y * y - z * z + w * w, 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), -x * x - y * y + z * z + w * w]])


def pose_from_quaternion(position: ArrayLike, quaternion: Iterable[float]) -> NDArray[np.float64]:
    """Return the pose (4, 4) of a position (3,) and a quaternion as `matrix_from_quaternion`'s."""
    pose = np.eye(4)
    pose[:3, :3] = matrix_from_quaternion(quaternion)
    pose[:3, 3] = position
    return pose


def quaternion_from_matrix(matrix: NDArray[np.float64]) -> tuple[float, float, float, float]:
    """
    Return the unit quaternion x, y, z, w of a rotation matrix (3, 3), one of the two.

    It is computed from its largest component, so that no digit is lost (Shepperd, Journal of
    Guidance and Control 1, 1978).
    """
    m = matrix.tolist()
    trace = m[0][0] + m[1][1] + m[2][2]
    largest = max(range(3), key=lambda axis: m[axis][axis])
    if trace >= m[largest][largest]:
        return _normalised((m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1], 1 + trace))
    i, j, k = largest, (largest + 1) % 3, (largest + 2) % 3
    parts = [0.0] * 4
    parts[i] = 1 - trace + 2 * m[i][i]
    parts[j] = m[j][i] + m[i][j]
    parts[k] = m[k][i] + m[i][k]
    parts[3] = m[k][j] - m[j][k]
    return _normalised(parts)


def rotation_between(start: NDArray[np.float64], end: NDArray[np.float64],
                     fraction: float) -> NDArray[np.float64]:
    """
    Return the matrix (3, 3) at a fraction, 0 to 1, of the shortest turn from one to another.

    The turn has one axis and one speed (Shoemake, Animating rotation with quaternion curves,
    SIGGRAPH 1985).
    """
    first = np.array(quaternion_from_matrix(start))
    last = np.array(quaternion_from_matrix(end))
    if first @ last < 0:  # a quaternion and its negative are the same rotation
        last = -last
    half = 2 * math.atan2(float(np.linalg.norm(last - first)), float(np.linalg.norm(last + first)))
    if half < 1e-9:
        return matrix_from_quaternion((1 - fraction) * first + fraction * last)
    return matrix_from_quaternion(
        math.sin((1 - fraction) * half) * first + math.sin(fraction * half) * last)


def pose_between(start: NDArray[np.float64], end: NDArray[np.float64],
                 fraction: float) -> NDArray[np.float64]:
    """Return the pose, (4, 4), between two: positions on the line, rotations by slerp."""
    pose = np.eye(4)
    pose[:3, :3] = rotation_between(start[:3, :3], end[:3, :3], fraction)
    pose[:3, 3] = (1 - fraction) * start[:3, 3] + fraction * end[:3, 3]
    return pose


def _normalised(quaternion: Iterable[float]) -> tuple[float, float, float, float]:
    x, y, z, w = map(float, quaternion)
    length = math.sqrt(x * x + y * y + z * z + w * w)
    return x / length, y / length, z / length, w / length
