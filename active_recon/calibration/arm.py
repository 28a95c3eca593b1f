"""Hand-eye calibration: a camera on an arm, and a fixed board."""

from collections.abc import Sequence
from dataclasses import dataclass
import math

from active_recon.calibration.board import Detection
from active_recon.calibration.fit import (
    fit,
    fitted_images,
    ImageFit,
    parameters_of,
    rigid,
)
from active_recon.calibration.lens import board_pose
from active_recon.errors import DataError
from active_recon.geometry.cameras import Intrinsics
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

FEWEST_IMAGES = 5
_LEAST_TURN = math.radians(10)
_SCALE_TOLERANCE = 0.05
_POSE_ERROR = np.repeat([math.radians(0.1), 0.0005], 3)  # typical of an arm, rad and metres


@dataclass(frozen=True, eq=False)
class ArmFit:
    """The poses of the camera on its mount and of the board in the arm's base, (4, 4) each."""

    mount_from_camera: NDArray[np.float64]
    base_from_board: NDArray[np.float64]
    images: list[ImageFit]


def fit_arm(seen: Sequence[Detection], lens: Intrinsics, mounts: NDArray[np.float64]) -> ArmFit:
    """
    Estimate the pose of a camera on an arm's mount, and of the board in the arm's base frame.

    `mounts`: base from mount of each image, (N, 4, 4), metres. Raises DataError where there are
    too few images, the poses do not determine the result, or they contradict the images.
    """
    if len(seen) < FEWEST_IMAGES:
        raise DataError(f'too few images: expected {FEWEST_IMAGES} images from known poses or '
                        f'more, got {len(seen)}', 'too_few_images')
    boards = np.stack([board_pose(lens, one) for one in seen])
    mount_from_camera = _hand_eye(mounts, boards)
    start = np.concatenate([parameters_of(mount_from_camera),
                            parameters_of(mounts[0] @ mount_from_camera @ boards[0])])

    def board_poses(parameters: NDArray[np.float64]) -> list[NDArray[np.float64]]:
        camera = rigid(parameters[:3], parameters[3:6])
        board = rigid(parameters[6:9], parameters[9:12])
        off = parameters[12:].reshape(-1, 6)
        return [np.linalg.inv(mount @ rigid(one[:3], one[3:]) @ camera) @ board
                for mount, one in zip(mounts, off, strict=True)]

    # An arm's poses have errors of their own, which are fitted too. Otherwise they would be
    # attributed to the camera: rotating it about the board hardly changes the image.
    count = len(seen)
    exact = np.zeros(6 * count)
    own = np.kron(np.eye(count, dtype=bool), np.ones((1, 6), bool))
    depends = np.block([[np.ones((count, 12), bool), own],
                        [np.zeros((6 * count, 12), bool), np.eye(6 * count, dtype=bool)]])
    found = fit(seen, lens, board_poses, np.append(start, exact),
                lambda parameters: parameters[12:] / np.tile(_POSE_ERROR, count), depends)[:12]
    return ArmFit(rigid(found[:3], found[3:6]), rigid(found[6:9], found[9:]),
                  fitted_images(seen, lens, board_poses(np.append(found, exact))))


def _hand_eye(mounts: NDArray[np.float64], boards: NDArray[np.float64]) -> NDArray[np.float64]:
    """
    Return mount from camera, (4, 4), after Park and Martin 1994, which OpenCV 5 lacks.

    It solves a X = X b, with `a` the mount's and `b` the camera's motion between two images.
    """
    first, second = np.triu_indices(len(mounts), 1)
    a = np.linalg.inv(mounts[second]) @ mounts[first]
    b = boards[second] @ np.linalg.inv(boards[first])
    turn_a = Rotation.from_matrix(a[:, :3, :3]).as_rotvec()
    turn_b = Rotation.from_matrix(b[:, :3, :3]).as_rotvec()
    clear = np.linalg.norm(turn_b, axis=1) < math.radians(170)  # the axis of a half turn is +-
    if not clear.any() or np.linalg.svd(turn_b[clear])[1][1] < _LEAST_TURN:
        raise DataError('poses too much alike: expected some that rotate the camera about two '
                        f'axes, by {math.degrees(_LEAST_TURN):.0f} degrees or more about '
                        'each', 'poses')
    rotation = Rotation.align_vectors(turn_a[clear], turn_b[clear])[0].as_matrix()
    # (R_a - 1) t_x - scale R_x t_b = -t_a: the scale is 1 unless the squares have another size
    left = np.concatenate([a[:, :3, :3] - np.eye(3),
                           -(b[:, :3, 3] @ rotation.T)[..., None]], axis=2)
    solved = np.linalg.lstsq(left.reshape(-1, 4), -a[:, :3, 3].ravel(), rcond=None)[0]
    if abs(solved[3] - 1) > _SCALE_TOLERANCE:
        raise DataError("wrong scale: expected the arm's poses and the board to have the same, "
                        f'but by the poses the squares are {solved[3]:.3g} times as large as '
                        'given; measure a square, and check that the poses are those of the mount '
                        "in the arm's base frame, in metres, with quaternions x y z w", 'scale')
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = rotation, solved[:3]
    return pose
