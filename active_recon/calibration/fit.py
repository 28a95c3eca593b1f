"""The last step of every calibration: all corners of all images fitted at once."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from active_recon.calibration.board import Detection
from active_recon.calibration.lens import project
from active_recon.cameras import Intrinsics
from active_recon.errors import DataError
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

_LARGEST_ERROR = 5.0  # pixels
_OUTLIER = 1.0  # pixels
_BEHIND = 1e4  # pixels, for what a step too far has put behind the camera

BoardPoses = Callable[[NDArray[np.float64]], Sequence[NDArray[np.float64]]]
"""From parameters, (P,), to camera from board of each image, (4, 4)."""


@dataclass(frozen=True, eq=False)
class ImageFit:
    """What was seen in an image, where the fit puts it, (N, 2) pixels, and the board's pose."""

    seen: Detection
    fitted: NDArray[np.float64]
    camera_from_board: NDArray[np.float64]

    @property
    def error(self) -> float:
        """Root mean square of the distances, pixels."""
        return root_mean_square(self.fitted - self.seen.pixels)


def root_mean_square(apart: NDArray[np.float64]) -> float:
    """Return the root mean square length of differences in pixels, (N, 2)."""
    return float(np.sqrt(np.mean(np.sum(apart ** 2, axis=1))))


def overall_error(images: Sequence[ImageFit]) -> float:
    """Return the root mean square over all corners of all images, pixels."""
    return root_mean_square(np.concatenate([one.fitted - one.seen.pixels for one in images]))


def fit(seen: Sequence[Detection], lens: Intrinsics, poses: BoardPoses, start: NDArray[np.float64]
        ) -> tuple[NDArray[np.float64], list[ImageFit]]:
    """
    Find the parameters, (P,), under which the corners fall where they are seen.

    A corner that lies far off counts less than its square. Raises DataError where even the best
    parameters leave several pixels.
    """
    def apart(parameters: NDArray[np.float64]) -> NDArray[np.float64]:
        off = [(project(lens, one.points, pose) - one.pixels).ravel()
               for one, pose in zip(seen, poses(parameters), strict=True)]
        return np.nan_to_num(np.concatenate(off), nan=_BEHIND)

    found = least_squares(apart, start, x_scale='jac', loss='soft_l1', f_scale=_OUTLIER).x
    images = [ImageFit(one, project(lens, one.points, pose), pose)
              for one, pose in zip(seen, poses(found), strict=True)]
    if (error := overall_error(images)) > _LARGEST_ERROR:
        worst = max(images, key=lambda one: one.error)
        raise DataError(
            f'expected the board to be where the motion says, within {_LARGEST_ERROR:g} pixels, '
            f'got {error:.1f} (worst: {worst.error:.1f} in {worst.seen.name}); are the squares, '
            'the angles or poses and the camera info those of these images, and did neither '
            'the camera nor the board slip?', 'reprojection')
    return found, images


def rigid(turn: NDArray[np.float64], shift: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the (4, 4) of a rotation vector, radians (3,), and a translation, metres (3,)."""
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_rotvec(turn).as_matrix()
    pose[:3, 3] = shift
    return pose


def parameters_of(pose: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return rotation vector and translation, (6,), of a rigid (4, 4): `rigid` the other way."""
    return np.concatenate([Rotation.from_matrix(pose[:3, :3]).as_rotvec(), pose[:3, 3]])
