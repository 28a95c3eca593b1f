"""The last step of every calibration: a joint fit to all corners of all images."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from active_recon.calibration.board import Detection
from active_recon.calibration.lens import project
from active_recon.errors import DataError
from active_recon.geometry.cameras import Intrinsics
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.sparse import csr_matrix
from scipy.spatial.transform import Rotation

_LARGEST_ERROR = 1 / 128  # in image widths
_OUTLIER = 1.0  # pixels
_MOST_STEPS = 100  # a fit takes 2 to 20; without a limit, contradictions take minutes
_BEHIND = 1e4  # pixels: residual of points that a step has put behind the camera

BoardPoses = Callable[[NDArray[np.float64]], Sequence[NDArray[np.float64]]]
"""Maps parameters (P,) to the board's pose in each image, camera from board (4, 4)."""


@dataclass(frozen=True, eq=False)
class ImageFit:
    """The detection in an image, the fitted corners (N, 2) in pixels, and the board's pose."""

    seen: Detection
    fitted: NDArray[np.float64]
    camera_from_board: NDArray[np.float64]

    @property
    def error(self) -> float:
        """Root mean square distance of fitted and detected corners, pixels."""
        return root_mean_square(self.fitted - self.seen.pixels)


def root_mean_square(apart: NDArray[np.float64]) -> float:
    """Return the root mean square length of differences (N, 2)."""
    return float(np.sqrt(np.mean(np.sum(apart ** 2, axis=1))))


def overall_error(images: Sequence[ImageFit]) -> float:
    """Return the root mean square distance over all corners of all images, pixels."""
    return root_mean_square(np.concatenate([one.fitted - one.seen.pixels for one in images]))


def fit(seen: Sequence[Detection], lens: Intrinsics, poses: BoardPoses,
        start: NDArray[np.float64], depends: NDArray[np.bool_],
        expected: Callable[[NDArray[np.float64]], NDArray[np.float64]] = lambda _: np.zeros(0)
        ) -> NDArray[np.float64]:
    """
    Return the parameters (P,) that minimise the reprojection error of the corners.

    `expected` returns M further residuals, the deviations of parameters from prior values in
    standard deviations. `depends` (N + M, P) marks the parameters on which each image, and then
    each further residual, depends: without it the time would rise with the square of the number
    of images. The loss is soft L1, which limits the influence of outliers.
    """
    def apart(parameters: NDArray[np.float64]) -> NDArray[np.float64]:
        off = [(project(lens, one.points, pose) - one.pixels).ravel()
               for one, pose in zip(seen, poses(parameters), strict=True)]
        together = np.concatenate([*off, expected(parameters)])
        return np.asarray(np.nan_to_num(together, nan=_BEHIND))

    counts = [2 * len(one.points) for one in seen]
    sparsity = csr_matrix(np.repeat(
        depends, [*counts, *[1] * (len(depends) - len(seen))], axis=0).astype(int))
    return np.asarray(least_squares(apart, start, x_scale='jac', loss='soft_l1', f_scale=_OUTLIER,
                                    jac_sparsity=sparsity, max_nfev=_MOST_STEPS).x)


def fitted_images(seen: Sequence[Detection], lens: Intrinsics,
                  poses: Sequence[NDArray[np.float64]]) -> list[ImageFit]:
    """
    Return the fit of each image, from the fitted poses of the board, camera from board (4, 4).

    Raises DataError where the overall error is above 1/128 of the image's width.
    """
    images = [ImageFit(one, project(lens, one.points, pose), pose)
              for one, pose in zip(seen, poses, strict=True)]
    largest = lens.width * _LARGEST_ERROR
    if not (error := overall_error(images)) <= largest:
        worst = max(images, key=lambda one: one.error)
        raise DataError(
            'images contradict the motion: expected a reprojection error of at most '
            f'{largest:.0f} pixels, got {error:.1f} (worst: {worst.error:.1f} in '
            f'{worst.seen.name}); check that the squares, the poses and the camera info are those '
            'of these images, and that neither the camera nor the board slipped', 'reprojection')
    return images


def rigid(turn: NDArray[np.float64], shift: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the pose (4, 4) of a rotation vector (3,), radians, and a shift (3,), metres."""
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_rotvec(turn).as_matrix()
    pose[:3, 3] = shift
    return pose


def parameters_of(pose: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the rotation vector and translation (6,) of a pose (4, 4): the inverse of `rigid`."""
    return np.concatenate([Rotation.from_matrix(pose[:3, :3]).as_rotvec(), pose[:3, 3]])
