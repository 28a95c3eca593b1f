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
from active_recon.calibration.hand_eye import hand_eye
from active_recon.calibration.lens import board_pose
from active_recon.errors import DataError
from active_recon.geometry.cameras import Intrinsics
import numpy as np
from numpy.typing import NDArray

FEWEST_IMAGES = 5
_POSE_ERROR = np.repeat([math.radians(0.1), 0.0005], 3)  # typical of an arm, rad and metres


@dataclass(frozen=True, eq=False)
class ArmFit:
    """
    The poses of the camera on its mount and of the board in the arm's base, (4, 4) each.

    `scale_known`: whether a wrong size of the squares would have been noticed.
    """

    mount_from_camera: NDArray[np.float64]
    base_from_board: NDArray[np.float64]
    scale_known: bool
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
    begun = hand_eye(mounts, boards, [one.name for one in seen])
    start = np.concatenate([parameters_of(begun.mount_from_camera),
                            parameters_of(mounts[0] @ begun.mount_from_camera @ boards[0])])

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
    found = fit(seen, lens, board_poses, np.append(start, exact), depends,
                lambda parameters: parameters[12:] / np.tile(_POSE_ERROR, count))[:12]
    return ArmFit(rigid(found[:3], found[3:6]), rigid(found[6:9], found[9:]), begun.scale_known,
                  fitted_images(seen, lens, board_poses(np.append(found, exact))))
