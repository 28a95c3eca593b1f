"""A turntable's axis and angles from the board's pose in each image: initial values of the fit."""

from collections.abc import Sequence
from dataclasses import dataclass
import math

from active_recon.errors import DataError
from active_recon.geometry.cameras import azimuth_difference
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

_LEAST_TURN = math.radians(20)
_LARGEST_TILT = math.radians(60)
_ANGLE_TOLERANCE = math.radians(5)


@dataclass(frozen=True, eq=False)
class Axis:
    """
    A turntable's axis in the camera's frame.

    - up: unit vector along the axis, away from the plate, (3,)
    - center: the point of the axis at the height of the board, metres, (3,)
    - turned: rotation of the table from the first image to each, counter-clockwise seen from
      above, radians, (N,)
    """

    up: NDArray[np.float64]
    center: NDArray[np.float64]
    turned: NDArray[np.float64]


def find_axis(poses: NDArray[np.float64]) -> Axis:
    """
    Return the axis of rotation of a board, from its poses, camera from board (N, 4, 4).

    Raises DataError where the board hardly turned, or does not lie on the plate.
    """
    turns = Rotation.from_matrix(poses[:, :3, :3])
    first, second = np.triu_indices(len(poses), 1)
    between = (turns[second] * turns[first].inv()).as_rotvec()
    if np.linalg.norm(between, axis=1).max() < _LEAST_TURN:
        raise DataError('the board hardly turned: expected a rotation of '
                        f'{math.degrees(_LEAST_TURN):.0f} degrees or more between two images',
                        'angles')
    up = np.linalg.eigh(between.T @ between)[1][:, -1]
    facing = -poses[:, :3, 2].mean(0)  # the board's z points into the paper
    up *= np.sign(facing @ up)
    if facing @ up < math.cos(_LARGEST_TILT) * np.linalg.norm(facing):
        raise DataError('the board is tilted: expected one that lies on the table, got an angle '
                        f'of {_angle_deg(facing, up):.0f} degrees to it', 'board_tilt')
    x, y, z, w = (turns * turns[0].inv()).as_quat().T
    turned = 2 * np.arctan2(np.stack([x, y, z], axis=1) @ up, w)
    return Axis(up, _center(poses, up, turned), np.asarray(azimuth_difference(turned, 0)))


def _center(poses: NDArray[np.float64], up: NDArray[np.float64], turned: NDArray[np.float64]
            ) -> NDArray[np.float64]:
    """Return the centre of the circle that the board's origin moved on, metres, (3,)."""
    about = Rotation.from_rotvec(turned[:, None] * up).as_matrix()
    corner = poses[:, :3, 3]
    left = (np.eye(3) - about).reshape(-1, 3)
    right = (corner - about @ corner[0]).ravel()
    center = np.linalg.lstsq(left, right, rcond=1e-6)[0]
    return np.asarray(center + up * (up @ (corner.mean(0) - center)))


@dataclass(frozen=True, eq=False)
class AngleFit:
    """
    The fit of a turntable's given angles to those in the images.

    The angles in the images are `direction` times the given ones plus `offset`, radians, plus the
    residuals `off`, (N,). `direction` is +1 where the given angle increases counter-clockwise seen
    from above, else -1.
    """

    direction: int
    offset: float
    off: NDArray[np.float64]


def compare_angles(turned: NDArray[np.float64], angles: NDArray[np.float64],
                   names: Sequence[str]) -> AngleFit:
    """
    Fit given angles to the table's counter-clockwise angles in the images, radians, (N,).

    Raises DataError where they do not determine the direction, or an image contradicts its angle.
    """
    agreement = {direction: abs(np.exp(1j * (turned - direction * angles)).mean())
                 for direction in (1, -1)}
    direction = max(agreement, key=lambda one: agreement[one])
    offset = float(np.angle(np.exp(1j * (turned - direction * angles)).mean()))
    off = np.asarray(azimuth_difference(turned - direction * angles, offset))
    worst = int(np.argmax(np.abs(off)))
    if abs(off[worst]) > _ANGLE_TOLERANCE:
        raise DataError(
            f'{names[worst]}: wrong angle: expected the table at '
            f'{math.degrees(angles[worst]):.1f} degrees, as given, got one '
            f'{abs(math.degrees(off[worst])):.1f} degrees off; check the angles or the step, and '
            'that the names of the images are in the order in which they were taken', 'angles')
    if agreement[direction] - agreement[-direction] < 0.01:
        raise DataError('direction unknown: expected angles that determine it, got half turns '
                        'only, which are the same in both directions', 'direction')
    return AngleFit(direction, offset, off)


def _angle_deg(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    return math.degrees(math.acos(float(a @ b) / float(np.linalg.norm(a) * np.linalg.norm(b))))
