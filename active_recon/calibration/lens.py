"""Lens parameters: read and written as ROS's calibration YAML, or estimated from images."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
import math
from pathlib import Path

from active_recon.calibration.board import Detection
from active_recon.errors import DataError, ViewError
from active_recon.geometry.cameras import Camera, Intrinsics
from active_recon.geometry.lenses import Distortion, MODELS
from active_recon.whole_files import whole_file
from active_recon.yaml_text import yaml_value
import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray
import yaml

_ENOUGH_TILT = math.radians(15)
_FEW = (cv2.CALIB_FIX_PRINCIPAL_POINT | cv2.CALIB_FIX_ASPECT_RATIO | cv2.CALIB_ZERO_TANGENT_DIST
        | cv2.CALIB_FIX_K1 | cv2.CALIB_FIX_K2 | cv2.CALIB_FIX_K3)
_STRAIGHT = Distortion('plumb_bob', (0.0,) * 5)


def board_pose(lens: Intrinsics, seen: Detection) -> NDArray[np.float64]:
    """Return the board's pose, camera from board (4, 4), from a single image."""
    plane = (seen.pixels - [lens.cx, lens.cy]) / [lens.fx, lens.fy]
    if lens.distortion is not None:
        plane = lens.distortion.undistort(plane)
    pinhole, none = np.eye(3), np.zeros(5)
    _, turn, shift = cv2.solvePnP(seen.points, plane, pinhole, none, flags=cv2.SOLVEPNP_IPPE)
    turn, shift = cv2.solvePnPRefineLM(seen.points, plane, pinhole, none, turn, shift)
    pose = np.eye(4)
    pose[:3, :3] = cv2.Rodrigues(turn)[0]
    pose[:3, 3] = np.ravel(shift)
    return pose


def project(lens: Intrinsics, points: NDArray[np.float64], pose: NDArray[np.float64]
            ) -> NDArray[np.float64]:
    """Return the pixels (N, 2) of points (N, 3) in a frame; `pose`, (4, 4): camera from frame."""
    return Camera(np.asarray(np.linalg.inv(pose)), lens).project(points)[0]


def write_lens(lens: Intrinsics, path: Path) -> None:
    """Write the lens parameters in the YAML format of ROS's camera_calibration."""
    matrix = _as_ros_counts(lens)
    distortion = lens.distortion or _STRAIGHT
    text = yaml.safe_dump({
        'image_width': lens.width, 'image_height': lens.height, 'camera_name': 'camera',
        'camera_matrix': _table(matrix),
        'distortion_model': distortion.model,
        'distortion_coefficients': _table(np.array([distortion.coefficients])),
        'rectification_matrix': _table(np.eye(3)),
        'projection_matrix': _table(np.column_stack([matrix, np.zeros(3)])),
    }, sort_keys=False, default_flow_style=None)
    with whole_file(path) as unfinished:
        unfinished.write_text(text)


def read_lens(path: Path) -> Intrinsics:
    """Read ROS's calibration YAML; raises DataError where it is invalid or of another model."""
    try:
        content = yaml_value(path.read_text())
        matrix = np.array(content['camera_matrix']['data'], np.float64).reshape(3, 3)
        coefficients = tuple(map(float, content['distortion_coefficients']['data']))
        size = int(content['image_width']), int(content['image_height'])
        model = content['distortion_model']
        # An ideal lens may have neither coefficients nor a model, as in a CameraInfo
        distortion = None if not any(coefficients) and model in ('', *MODELS) else (
            Distortion(model, coefficients))
    except FileNotFoundError as error:
        raise DataError(f"{path}: no such file: expected a YAML file of ROS's camera_calibration"
                        ) from error
    except (OSError, KeyError, OverflowError, TypeError, ValueError) as error:
        raise DataError(f"{path}: no calibration: expected a YAML file of ROS's "
                        f'camera_calibration, got: {type(error).__name__}: {error}') from error
    except ViewError as error:
        raise DataError(f'{path}: {error}') from error
    if not np.isfinite(matrix).all() or min(matrix[0, 0], matrix[1, 1], *size) <= 0:
        raise DataError(f'{path}: camera not calibrated: expected focal lengths and sizes above '
                        f'0, got the matrix {matrix.tolist()} for images of {size[0]} x {size[1]}')
    return _lens(matrix, distortion, size)


@dataclass(frozen=True)
class EstimatedLens:
    """
    Lens parameters, and whether the images determined all of them.

    `whole` is false where the board always had the same tilt: such images determine only the
    focal length, and the principal point and distortion are those of an ideal camera.
    """

    lens: Intrinsics
    whole: bool


def estimate_lens(seen: Sequence[Detection], focal: float | None = None) -> EstimatedLens:
    """
    Estimate the lens parameters from images of the board.

    The search begins at the focal length `focal`, pixels; None: the image's width.

    A board that rotates flat under a fixed camera stays in one plane. A single plane, in however
    many images, does not separate principal point and distortion from its tilt. Raises DataError
    where no lens fits.
    """
    try:
        return _estimated(seen, focal)
    except cv2.error as error:
        raise DataError('lens not estimated: expected the board from several sides, and large in '
                        f'the images, got corners that no lens fits ({len(seen)} images); take '
                        'more, or give the lens by --camera-info', 'too_few_images') from error


def _estimated(seen: Sequence[Detection], focal: float | None) -> EstimatedLens:
    points = [one.points.astype(np.float32) for one in seen]
    pixels = [(one.pixels - 0.5).astype(np.float32) for one in seen]
    width, height = size = seen[0].size
    first = focal or width
    start = _as_ros_counts(Intrinsics(first, first, width / 2, height / 2, width, height))
    calibrate = partial(cv2.calibrateCamera, points, pixels, size)
    _, matrix, _, turns, _ = calibrate(
        start, np.zeros(5), flags=cv2.CALIB_USE_INTRINSIC_GUESS | _FEW)
    normals = np.array([cv2.Rodrigues(turn)[0][:, 2] for turn in turns])
    middle = normals.mean(0) / np.linalg.norm(normals.mean(0))
    if np.arccos(np.clip(normals @ middle, -1, 1)).max() < _ENOUGH_TILT:
        return EstimatedLens(_lens(matrix, None, size), False)
    _, matrix, distortion, *_ = calibrate(
        matrix, np.zeros(5), flags=cv2.CALIB_USE_INTRINSIC_GUESS | cv2.CALIB_FIX_K3)
    coefficients = tuple(np.ravel(distortion)[:5].tolist())
    return EstimatedLens(_lens(matrix, Distortion('plumb_bob', coefficients), size), True)


def _lens(matrix: ArrayLike, distortion: Distortion | None, size: tuple[int, int]
          ) -> Intrinsics:
    # (0, 0) is the first pixel's centre in OpenCV and ROS, its corner in our cameras
    (fx, _, cx), (_, fy, cy), _ = np.asarray(matrix, np.float64).tolist()
    return Intrinsics(fx, fy, cx + 0.5, cy + 0.5, *size, distortion)


def _as_ros_counts(lens: Intrinsics) -> NDArray[np.float64]:
    matrix = lens.matrix
    matrix[:2, 2] -= 0.5
    return matrix


def _table(values: NDArray[np.float64]) -> dict[str, object]:
    rows, columns = values.shape
    return {'rows': rows, 'cols': columns, 'data': values.ravel().tolist()}
