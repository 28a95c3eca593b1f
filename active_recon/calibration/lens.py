"""A lens: from ROS's calibration YAML and to it, or estimated from images of the board."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
import math
from pathlib import Path

from active_recon.calibration.board import Detection
from active_recon.errors import DataError
import cv2
import numpy as np
from numpy.typing import NDArray
import yaml

_MODELS = {'plumb_bob': 5, 'rational_polynomial': 8}
_ENOUGH_TILT = math.radians(15)
_FEW = (cv2.CALIB_FIX_PRINCIPAL_POINT | cv2.CALIB_FIX_ASPECT_RATIO | cv2.CALIB_ZERO_TANGENT_DIST
        | cv2.CALIB_FIX_K1 | cv2.CALIB_FIX_K2 | cv2.CALIB_FIX_K3)


@dataclass(frozen=True, eq=False)
class Lens:
    """
    OpenCV's camera matrix, (3, 3), and distortion, (5,) or (8,), of images of a size.

    `size` is width and height in pixels.
    """

    matrix: NDArray[np.float64]
    distortion: NDArray[np.float64]
    size: tuple[int, int]

    def board_pose(self, seen: Detection) -> NDArray[np.float64]:
        """Return camera from board, (4, 4), by this image alone."""
        _, turn, shift = cv2.solvePnP(seen.points, seen.pixels, self.matrix, self.distortion,
                                      flags=cv2.SOLVEPNP_IPPE)
        turn, shift = cv2.solvePnPRefineLM(
            seen.points, seen.pixels, self.matrix, self.distortion, turn, shift)
        pose = np.eye(4)
        pose[:3, :3] = cv2.Rodrigues(turn)[0]
        pose[:3, 3] = np.ravel(shift)
        return pose

    def project(self, points: NDArray[np.float64], pose: NDArray[np.float64]
                ) -> NDArray[np.float64]:
        """Return the pixels, (N, 2), of points (N, 3) under camera from points, (4, 4)."""
        turn, _ = cv2.Rodrigues(pose[:3, :3])
        pixels, _ = cv2.projectPoints(points, turn, pose[:3, 3], self.matrix, self.distortion)
        return np.asarray(pixels, np.float64).reshape(-1, 2)

    def save(self, path: Path) -> None:
        """Write the lens in the format of ROS's camera_calibration."""
        model = {count: name for name, count in _MODELS.items()}[self.distortion.size]
        path.write_text(yaml.safe_dump({
            'image_width': self.size[0], 'image_height': self.size[1], 'camera_name': 'camera',
            'camera_matrix': _table(self.matrix),
            'distortion_model': model,
            'distortion_coefficients': _table(self.distortion[None]),
            'rectification_matrix': _table(np.eye(3)),
            'projection_matrix': _table(np.column_stack([self.matrix, np.zeros(3)])),
        }, sort_keys=False, default_flow_style=None))


def _table(values: NDArray[np.float64]) -> dict[str, object]:
    rows, columns = values.shape
    return {'rows': rows, 'cols': columns, 'data': values.ravel().tolist()}


def read_lens(path: Path) -> Lens:
    """Read ROS's calibration YAML; raises DataError where it is none, or of another model."""
    try:
        content = yaml.safe_load(path.read_text())
        matrix = np.array(content['camera_matrix']['data'], np.float64).reshape(3, 3)
        distortion = np.array(content['distortion_coefficients']['data'], np.float64).ravel()
        size = int(content['image_width']), int(content['image_height'])
        model = content['distortion_model']
    except (OSError, UnicodeDecodeError, yaml.YAMLError, KeyError, TypeError,
            ValueError) as error:
        raise DataError(f"{path}: expected a camera's calibration as ROS's camera_calibration "
                        f'writes it (YAML): {error!r}') from error
    if _MODELS.get(model) != distortion.size:
        raise DataError(f'{path}: expected plumb_bob with 5 or rational_polynomial with 8 '
                        f'coefficients, got {model} with {distortion.size}')
    if not (np.isfinite(matrix).all() and np.isfinite(distortion).all()
            and matrix[0, 0] > 0 and matrix[1, 1] > 0 and min(size) > 0):
        raise DataError(f'{path}: expected a calibrated camera, got the matrix {matrix.tolist()} '
                        f'for images of {size[0]} x {size[1]}')
    return Lens(matrix, distortion, size)


@dataclass(frozen=True)
class EstimatedLens:
    """
    A lens, and whether the images told all of it.

    `whole` is false where the board was always seen at the same tilt: such images tell the focal
    length alone, and centre and distortion are taken to be those of an ideal camera.
    """

    lens: Lens
    whole: bool


def estimate_lens(seen: Sequence[Detection]) -> EstimatedLens:
    """
    Estimate the lens from the board's images.

    A flat board that turns under a fixed camera stays in one plane, however many images there
    are, and one plane cannot tell centre and distortion from its tilt.
    """
    points = [one.points.astype(np.float32) for one in seen]
    pixels = [one.pixels.astype(np.float32) for one in seen]
    width, height = size = seen[0].size
    start = np.array([[width, 0, (width - 1) / 2], [0, width, (height - 1) / 2], [0, 0, 1.0]])
    calibrate = partial(cv2.calibrateCamera, points, pixels, size)
    _, matrix, distortion, turns, _ = calibrate(
        start, np.zeros(5), flags=cv2.CALIB_USE_INTRINSIC_GUESS | _FEW)
    normals = np.array([cv2.Rodrigues(turn)[0][:, 2] for turn in turns])
    middle = normals.mean(0) / np.linalg.norm(normals.mean(0))
    whole = bool(np.arccos(np.clip(normals @ middle, -1, 1)).max() >= _ENOUGH_TILT)
    if whole:
        _, matrix, distortion, *_ = calibrate(
            matrix, np.zeros(5), flags=cv2.CALIB_USE_INTRINSIC_GUESS | cv2.CALIB_FIX_K3)
    return EstimatedLens(Lens(np.asarray(matrix, np.float64),
                              np.ravel(distortion).astype(np.float64)[:5], size), whole)
