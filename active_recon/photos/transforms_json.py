"""
Cameras in `transforms.json`, as NeRF, instant-ngp and nerfstudio write it.

`transform_matrix` is world from camera with OpenGL's camera axes (x right, y up, z backward) and
z up in the world. Intrinsics stand in the file or in a frame: `fl_x`, `fl_y`, `cx`, `cy`, `w`,
`h` in pixels, where (0.5, 0.5) is the centre of the first, or `camera_angle_x` alone, the
horizontal field of view in radians. Distortion: `k1`, `k2`, `k3`, `p1`, `p2` of OpenCV's model, or
`k1` to `k4` of its fisheye model. `depth_file_path` of a frame names its depth image.

The format: https://docs.nerf.studio/quickstart/data_conventions.html
"""

from collections.abc import Mapping
import math
from pathlib import Path
from typing import Any

from active_recon.errors import DataError, ViewError
from active_recon.geometry.cameras import Intrinsics
from active_recon.geometry.lenses import Distortion
from active_recon.json_text import json_value
from active_recon.photos.camera_file import CameraFile, Entry, Lens, rigid, sized
import numpy as np
from numpy.typing import NDArray

FLIP = np.diag([1.0, -1.0, -1.0, 1.0])
"""OpenGL's camera axes in those of OpenCV, and the other way round, (4, 4)."""
_LAST_ROW = (0.0, 0.0, 0.0, 1.0)
_STRAIGHT = {'PINHOLE', 'SIMPLE_PINHOLE', 'OPENCV', 'PERSPECTIVE'}
_FISHEYE = {'OPENCV_FISHEYE', 'FISHEYE'}


def read_transforms(path: Path) -> CameraFile:
    """Read the file; raises DataError that names the frame and the key that are wrong."""
    try:
        content = json_value(path.read_text(encoding='utf-8-sig'))  # Windows writes its mark
        frames = content['frames']
        if not isinstance(frames, list) or not frames:
            raise ValueError('no frames')
    except (OSError, UnicodeDecodeError, ValueError, KeyError, TypeError) as error:
        raise DataError(f'{path}: no cameras: expected JSON with a list `frames`, got: '
                        f'{type(error).__name__}: {error}') from error
    entries = []
    for number, frame in enumerate(frames):
        where = f'{path}, frame {number}'
        try:
            matrix, name = _matrix(frame), str(frame['file_path'])
            if not np.allclose(matrix[3:], _LAST_ROW, atol=1e-4):
                raise ValueError('transform_matrix: expected 0, 0, 0, 1 as its last row, got '
                                 f'{matrix[3].tolist()}; is it transposed?')
            lens = _lens({**content, **frame})
        except (KeyError, ValueError, OverflowError, ViewError) as error:
            got = f'none of {error}' if isinstance(error, KeyError) else error
            raise DataError(f'{where}: no camera: expected file_path, transform_matrix and '
                            f'intrinsics, got: {got}') from error
        pose = rigid(matrix[:3, :3], matrix[:3, 3], where) @ FLIP
        depth = frame.get('depth_file_path')
        entries.append(Entry(name, pose, lens, path.parent / str(depth) if depth else None))
    return CameraFile(str(path), entries, up=np.array([0.0, 0.0, 1.0]), looks='opengl')


def _matrix(frame: Any) -> NDArray[np.float64]:
    """Return a frame's `transform_matrix`, (3, 4) or (4, 4)."""
    if not isinstance(frame, Mapping):
        raise ValueError(f'{frame!r}')
    given = frame['transform_matrix']
    try:
        matrix = np.array(given, np.float64)
    except (TypeError, ValueError) as error:
        raise ValueError(f'transform_matrix of {given!r}: expected rows of numbers') from error
    if matrix.shape not in ((4, 4), (3, 4)):
        raise ValueError(f'transform_matrix of the shape {matrix.shape}')
    return matrix


def _lens(values: Mapping[str, Any]) -> Lens:
    distortion = _distortion(values)
    if 'fl_x' not in values and 'camera_angle_x' not in values:
        raise ValueError('neither fl_x nor camera_angle_x')
    if 'fl_x' in values and {'w', 'h'} <= values.keys():
        width, height = (int(_positive(values, name)) for name in ('w', 'h'))
        across = _positive(values, 'fl_x')
        return sized(Intrinsics(
            across, _positive({'fl_y': across, **values}, 'fl_y'), *_centre(values, width, height),
            width, height, distortion))
    for angle in ('camera_angle_x', 'camera_angle_y'):
        if angle in values and not 0 < _number(values, angle) < math.pi:
            raise ValueError(f'{angle} of {values[angle]}: expected radians from 0 to pi')
    _centre(values, 1, 1)

    def of_size(size: tuple[int, int]) -> Intrinsics:
        width, height = size
        across = (_positive(values, 'fl_x') if 'fl_x' in values
                  else width / 2 / math.tan(_positive(values, 'camera_angle_x') / 2))
        down = (_positive(values, 'fl_y') if 'fl_y' in values
                else height / 2 / math.tan(_positive(values, 'camera_angle_y') / 2)
                if 'camera_angle_y' in values else across)
        return Intrinsics(across, down, *_centre(values, width, height), width, height, distortion)
    if {'w', 'h'} <= values.keys():
        return sized(of_size((int(_positive(values, 'w')), int(_positive(values, 'h')))))
    return of_size


def _centre(values: Mapping[str, Any], width: int, height: int) -> tuple[float, float]:
    """Return the principal point, by default the middle of a photo of that size."""
    x, y = (_number(values, name, half) for name, half in (('cx', width / 2), ('cy', height / 2)))
    if not (math.isfinite(x) and math.isfinite(y)):
        raise ValueError(f'cx, cy of {x}, {y}: expected pixels')
    return x, y


def _distortion(values: Mapping[str, Any]) -> Distortion | None:
    model = str(values.get('camera_model', 'OPENCV')).upper()
    if model not in _STRAIGHT | _FISHEYE:
        raise ValueError(f'camera_model {model}: expected one of '
                         f'{", ".join(sorted(_STRAIGHT | _FISHEYE))}')
    k1, k2, k3, k4, p1, p2 = (_number(values, name, 0) for name in (
        'k1', 'k2', 'k3', 'k4', 'p1', 'p2'))
    if model in _FISHEYE or values.get('is_fisheye'):
        return Distortion('equidistant', (k1, k2, k3, k4))
    if k4:
        raise ValueError('k4 of a lens that is no fisheye: expected 0')
    return Distortion('plumb_bob', (k1, k2, p1, p2, k3)) if any((k1, k2, k3, p1, p2)) else None


def _positive(values: Mapping[str, Any], name: str) -> float:
    value = _number(values, name)
    if not 0 < value < math.inf:
        raise ValueError(f'{name} of {value}: expected a number above 0')
    return value


def _number(values: Mapping[str, Any], name: str, otherwise: float | None = None) -> float:
    """Return a number by its name, or another one, which may be needed, where there is none."""
    value = values[name] if otherwise is None else values.get(name, otherwise)
    try:
        return float(value)
    except (TypeError, ValueError) as error:
        raise ValueError(f'{name} of {value!r}: expected a number') from error
