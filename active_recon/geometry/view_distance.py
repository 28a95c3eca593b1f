"""How far views are from each other: angles at the object between cameras, and nearest ones."""

from collections.abc import Sequence
import math

from active_recon.geometry.cameras import Camera
import numpy as np
from numpy.typing import ArrayLike, NDArray

_ONE_ELEVATION = math.radians(10)
_RING_ELEVATION, _RING_DISTANCE = math.radians(2), 1.05


def view_distance(a: Camera, b: Camera) -> float:
    """
    Return the angle at the object's centre between two cameras, radians in [0, pi].

    Distance and roll make no difference. Goals, the view gate and policies all use this measure.
    """
    return float(direction_distance(a.direction, b.direction))


def view_distances(cameras: Sequence[Camera], others: Sequence[Camera]) -> NDArray[np.float64]:
    """Return the `view_distance` of each camera to each of M others, (N, M)."""
    own, theirs = (pose_directions(np.array([each.pose for each in one]).reshape(-1, 4, 4))
                   for one in (cameras, others))
    return direction_distance(own[:, None], theirs)


def direction_distance(a: ArrayLike, b: ArrayLike) -> NDArray[np.float64]:
    """Return the angles between directions (..., 3) and (..., 3), radians; shapes broadcast."""
    # By components: products and sums over the last axis take several times as long
    (ax, ay, az), (bx, by, bz) = (np.moveaxis(np.asarray(each, np.float64), -1, 0)
                                  for each in (a, b))
    across = np.sqrt((ay * bz - az * by) ** 2 + (az * bx - ax * bz) ** 2
                     + (ax * by - ay * bx) ** 2)
    # The arc cosine alone would be off by 1e-8 near 0
    return np.asarray(np.arctan2(across, ax * bx + ay * by + az * bz))


def nearest_camera(camera: Camera, cameras: Sequence[Camera]) -> int:
    """Return the index of the camera with the smallest `view_distance`; of equals the first."""
    return int(nearest_cameras([camera], cameras)[0])


def nearest_cameras(cameras: Sequence[Camera], among: Sequence[Camera]) -> NDArray[np.int64]:
    """Return the `nearest_camera` among some of each camera, (N,)."""
    return np.asarray(view_distances(cameras, among).argmin(axis=1))


def pose_directions(poses: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return unit vectors from the origin to cameras, (..., 3), of poses (..., 4, 4)."""
    return directions_of(poses[..., :3, 3])


def directions_of(positions: NDArray[np.floating]) -> NDArray[np.float64]:
    """Return unit vectors from the origin to positions (..., 3)."""
    exact = np.asarray(positions, np.float64)
    return np.asarray(exact / np.linalg.norm(exact, axis=-1, keepdims=True))


def at_one_elevation(directions: NDArray[np.float64],
                     within: float = _ONE_ELEVATION) -> NDArray[np.bool_]:
    """
    Return whether the elevations of directions (..., N, 3) differ by at most `within` rad, (...).

    By 10 degrees, a camera goes around the object as on a turntable, give or take how it is held.
    """
    heights = directions[..., 2].clip(-1, 1)
    return np.asarray(np.arcsin(heights.max(axis=-1)) - np.arcsin(heights.min(axis=-1)) <= within)


def on_one_ring(positions: NDArray[np.floating]) -> bool:
    """
    Return whether positions (N, 3) lie on one ring about the z axis, as those of a turntable do.

    Their elevations may differ by 2 degrees, their distances by 5 %. Two drawn at random hardly
    ever agree in both.
    """
    distance = np.linalg.norm(positions, axis=-1)
    return bool(at_one_elevation(directions_of(positions), _RING_ELEVATION)
                and distance.max() <= _RING_DISTANCE * distance.min())
