"""The last step of every calibration: all corners of all images fitted at once."""

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

_LARGEST_ERROR = 1 / 128  # of the image's width
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


def fit(seen: Sequence[Detection], lens: Intrinsics, poses: BoardPoses,
        start: NDArray[np.float64],
        expected: Callable[[NDArray[np.float64]], NDArray[np.float64]] = lambda _: np.zeros(0),
        depends: NDArray[np.bool_] | None = None) -> NDArray[np.float64]:
    """
    Return the parameters, (P,), under which the corners fall where they are seen.

    `expected` says, in units of what is likely, how far parameters are from what was expected of
    them. `depends` says of each image, and then of each such expectation, which parameters it
    depends on, (N + M, P); None: on all. A corner that lies far off counts less than its square.
    """
    def apart(parameters: NDArray[np.float64]) -> NDArray[np.float64]:
        off = [(project(lens, one.points, pose) - one.pixels).ravel()
               for one, pose in zip(seen, poses(parameters), strict=True)]
        together = np.concatenate([*off, expected(parameters)])
        return np.asarray(np.nan_to_num(together, nan=_BEHIND))

    sparsity = None
    if depends is not None:
        counts = [2 * len(one.points) for one in seen]
        sparsity = csr_matrix(np.repeat(
            depends, [*counts, *[1] * (len(depends) - len(seen))], axis=0).astype(int))
    return np.asarray(least_squares(apart, start, x_scale='jac', loss='soft_l1', f_scale=_OUTLIER,
                                    jac_sparsity=sparsity).x)


def fitted_images(seen: Sequence[Detection], lens: Intrinsics,
                  poses: Sequence[NDArray[np.float64]]) -> list[ImageFit]:
    """
    Return the images with the board where it was fitted, camera from board (4, 4) of each.

    Raises DataError where that is far from where it is seen.
    """
    images = [ImageFit(one, project(lens, one.points, pose), pose)
              for one, pose in zip(seen, poses, strict=True)]
    largest = lens.width * _LARGEST_ERROR
    if not (error := overall_error(images)) <= largest:
        worst = max(images, key=lambda one: one.error)
        raise DataError(
            'images contradict the motion: expected the board to be where the motion says, within '
            f'{largest:.0f} pixels, got {error:.1f} (worst: {worst.error:.1f} in '
            f'{worst.seen.name}); are the squares, '
            'the poses and the camera info those of these images, and did neither the camera nor '
            'the board slip?', 'reprojection')
    return images


def rigid(turn: NDArray[np.float64], shift: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the (4, 4) of a rotation vector, radians (3,), and a translation, metres (3,)."""
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_rotvec(turn).as_matrix()
    pose[:3, 3] = shift
    return pose


def parameters_of(pose: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return rotation vector and translation, (6,), of a rigid (4, 4): `rigid` the other way."""
    return np.concatenate([Rotation.from_matrix(pose[:3, :3]).as_rotvec(), pose[:3, 3]])
