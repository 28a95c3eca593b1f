"""How far views are from each other: angles at the object between cameras, and nearest ones."""

from collections.abc import Sequence

from active_recon.geometry.cameras import Camera
import numpy as np
from numpy.typing import ArrayLike, NDArray


def view_distance(a: Camera, b: Camera) -> float:
    """
    Return the angle at the object's centre between two cameras, radians in [0, pi].

    Distance and roll make no difference. Goals, the view gate and policies all use this measure.
    """
    return float(direction_distance(a.direction, b.direction))


def direction_distance(a: ArrayLike, b: ArrayLike) -> NDArray[np.float64]:
    """Return the angles between directions (..., 3) and (..., 3), radians; shapes broadcast."""
    a, b = np.asarray(a, np.float64), np.asarray(b, np.float64)
    # The arc cosine alone would be off by 1e-8 near 0
    return np.asarray(np.arctan2(np.linalg.norm(np.cross(a, b), axis=-1), (a * b).sum(axis=-1)))


def nearest_camera(camera: Camera, cameras: Sequence[Camera]) -> int:
    """Return the index of the camera with the smallest `view_distance`; of equals the first."""
    directions = np.array([each.direction for each in cameras])
    return int(direction_distance(directions, camera.direction).argmin())


def pose_directions(poses: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return unit vectors from the origin to cameras, (..., 3), of poses (..., 4, 4)."""
    positions = poses[..., :3, 3]
    return np.asarray(positions / np.linalg.norm(positions, axis=-1, keepdims=True))
