"""Hand-eye calibration in closed form: where a camera is on an arm's mount, from its motions."""

from collections.abc import Sequence
from dataclasses import dataclass
import math

from active_recon.errors import DataError
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

_LEAST_TURN = math.radians(10)
_LARGEST_MISMATCH = math.radians(5)
_SCALE_TOLERANCE = 0.05
_VISIBLE = 0.0005  # metres: typical of an arm's error


@dataclass(frozen=True, eq=False)
class HandEye:
    """
    Mount from camera, (4, 4), metres, and whether the motions determine the squares' size, too.

    They do not where all images look at one point from one distance.
    """

    mount_from_camera: NDArray[np.float64]
    scale_known: bool


def hand_eye(mounts: NDArray[np.float64], boards: NDArray[np.float64], names: Sequence[str]
             ) -> HandEye:
    """
    Return the camera's pose on the mount after Park and Martin 1994, which OpenCV 5 lacks.

    It solves a X = X b, with `a` the mount's and `b` the camera's motion between two images.
    `mounts` are base from mount and `boards` camera from board of each image, (N, 4, 4), metres,
    and `names` those of the images. Raises DataError where the poses do not determine it,
    contradict the images, or are of another scale.
    """
    first, second = np.triu_indices(len(mounts), 1)
    a = np.linalg.inv(mounts[second]) @ mounts[first]
    b = boards[second] @ np.linalg.inv(boards[first])
    pose = np.eye(4)
    pose[:3, :3] = _rotation(a, b, np.stack([first, second]), names)
    # (R_a - 1) t_x - scale R_x t_b = -t_a: the scale is 1 unless the squares have another size
    turned = (a[:, :3, :3] - np.eye(3)).reshape(-1, 3)
    moved = (b[:, :3, 3] @ pose[:3, :3].T).ravel()
    both = np.stack([moved - a[:, :3, 3].ravel(), moved], axis=1)
    solved = np.linalg.lstsq(turned, both, rcond=None)[0]
    pose[:3, 3] = solved[:, 0]
    apart, seen = (both - turned @ solved).T  # what no position of the camera explains
    known = _SCALE_TOLERANCE * _root_mean_square(seen) > _VISIBLE
    if known:
        _require_scale(apart, seen)
    return HandEye(pose, known)


def _rotation(a: NDArray[np.float64], b: NDArray[np.float64], pairs: NDArray[np.intp],
              names: Sequence[str]) -> NDArray[np.float64]:
    """Return the rotation, (3, 3), that turns the camera's rotations `b` into the mount's `a`."""
    turn_a = Rotation.from_matrix(a[:, :3, :3]).as_rotvec()
    turn_b = Rotation.from_matrix(b[:, :3, :3]).as_rotvec()
    clear = np.linalg.norm(turn_b, axis=1) < math.radians(170)  # the axis of a half turn is +-
    if not clear.any() or np.linalg.svd(turn_b[clear])[1][1] < _LEAST_TURN:
        raise DataError('poses too much alike: expected some that rotate the camera about two '
                        f'axes, by {math.degrees(_LEAST_TURN):.0f} degrees or more about '
                        'each', 'poses')
    turn_a, turn_b, pairs = turn_a[clear], turn_b[clear], pairs[:, clear]
    rotation = Rotation.align_vectors(turn_a, turn_b)[0]
    off = np.linalg.norm(turn_a - rotation.apply(turn_b), axis=1)
    if _root_mean_square(off) > _LARGEST_MISMATCH:
        of_each = [float(np.mean(off[(pairs == image).any(0)])) if image in pairs else 0.0
                   for image in range(len(names))]
        worst = int(np.argmax(of_each))
        raise DataError(
            f'{names[worst]}: wrong pose: expected the camera to turn with its mount, got '
            f'rotations that are {math.degrees(of_each[worst]):.0f} degrees apart; check that the '
            "poses are those of these images, of the mount in the arm's base frame, with "
            'quaternions x y z w', 'rotation')
    return np.asarray(rotation.as_matrix())


def _require_scale(apart: NDArray[np.float64], seen: NDArray[np.float64]) -> None:
    """Raise DataError where another size of the squares explains most of what is `apart`."""
    change = float(apart @ seen / (seen @ seen))
    explained = _root_mean_square(apart - change * seen) < _root_mean_square(apart) / math.sqrt(2)
    if explained and abs(change) > _SCALE_TOLERANCE:
        raise DataError("wrong scale: expected the arm's poses and the board to have the same, "
                        f'but by the poses the squares are {1 - change:.3g} times as large as '
                        'given; measure a square, and check that the poses are in metres',
                        'scale')


def _root_mean_square(values: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(values ** 2)))
