"""
Cameras in OpenCV's YAML or JSON (`cv::FileStorage`), as its calibration samples write them.

`camera_matrix` or `K`, `distortion_coefficients` or `D` (optional), `image_width`,
`image_height`; and the poses, camera from world in OpenCV's axes, as either

    images                  a list of `name`, `rvec` and `tvec`
    extrinsic_parameters    (N, 6): rvec and tvec of each photo, in the order of the photos, which
                            is that of their names or of their times

(0, 0) is the centre of the first pixel. z is up in the world; for a chessboard that lies on a
table, whose z points down, give --up=-z.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from active_recon.errors import DataError, ViewError
from active_recon.geometry.cameras import Intrinsics
from active_recon.geometry.lenses import Distortion
from active_recon.photos.camera_file import CameraFile, Entry, Lens, rigid, sized
from active_recon.photos.files import PhotoFile
import cv2
import numpy as np
from numpy.typing import NDArray


def read_opencv(path: Path, photos: Sequence[PhotoFile]) -> CameraFile:
    """Read the file; raises DataError where it lacks something or does not fit the photos."""
    try:
        storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
    except (cv2.error, SystemError) as error:
        raise DataError(f'{path}: not readable: expected a file of OpenCV, got: {error}'
                        ) from error
    try:
        if not storage.isOpened():
            raise DataError(f'{path}: not readable: expected a file of OpenCV')
        lens = _lens(storage, path)
        named = [(name, pose, f'{path}: {name}') for name, pose in _poses(storage, path, photos)]
    except cv2.error as error:
        raise DataError(f'{path}: no cameras: expected matrices and lists as OpenCV writes them, '
                        f'got {error.err}') from error
    except UnicodeDecodeError as error:
        raise DataError(f'{path}: not readable: expected names in UTF-8, got {error.object!r}'
                        ) from error
    finally:
        storage.release()
    entries = []
    for name, (rvec, tvec), where in named:
        rotation = np.asarray(cv2.Rodrigues(rvec)[0], np.float64)
        entries.append(Entry(name, rigid(rotation.T, -rotation.T @ tvec, where), lens))
    return CameraFile(str(path), entries, up=np.array([0.0, 0.0, 1.0]))


def _lens(storage: Any, path: Path) -> Lens:
    matrix = _matrix(storage, path, 'camera_matrix', 'K')
    given = _matrix(storage, path, 'distortion_coefficients', 'D')
    width, height = (int(storage.getNode(name).real()) for name in ('image_width', 'image_height'))
    if (matrix is None or matrix.shape != (3, 3) or not np.isfinite(matrix).all()
            or min(width, height, *matrix.diagonal()) <= 0):
        raise DataError(f'{path}: no lens: expected camera_matrix (3 x 3), image_width and '
                        f'image_height, got {matrix} and {width} x {height}')
    fisheye = storage.getNode('fisheye_model').real() > 0
    try:
        distortion = None if given is None or not (given.any() or fisheye) else _distortion(
            given.ravel(), fisheye)
    except ViewError as error:
        raise DataError(f'{path}: {error}') from error
    return sized(Intrinsics(matrix[0, 0], matrix[1, 1], matrix[0, 2] + 0.5, matrix[1, 2] + 0.5,
                            width, height, distortion))


def _distortion(given: NDArray[np.float64], fisheye: bool) -> Distortion:
    """Return OpenCV's model: its fisheye's, or of 4, 5 or 8 coefficients, or 12 with a prism's."""
    if fisheye:
        return Distortion('equidistant', tuple(given.tolist()))
    kept = np.trim_zeros(given, 'b').size
    size = next(size for size in (5, 8, 12, kept) if kept <= size)
    values = np.pad(given, (0, max(0, size - given.size)))[:size]
    return Distortion('plumb_bob' if size == 5 else 'rational_polynomial', tuple(values.tolist()))


def _poses(storage: Any, path: Path, photos: Sequence[PhotoFile]
           ) -> list[tuple[str, tuple[NDArray[np.float64], NDArray[np.float64]]]]:
    listed = storage.getNode('images')
    if not listed.empty() and listed.isSeq():
        found = []
        for number in range(listed.size()):
            node = listed.at(number)
            rvec, tvec = (_vector(node.getNode(name), path) for name in ('rvec', 'tvec'))
            name = node.getNode('name').string()
            if rvec is None or tvec is None or not name:
                raise DataError(f'{path}: images[{number}]: no pose: expected name, rvec and tvec '
                                'of three numbers each')
            found.append((name, (rvec, tvec)))
        return found
    rows = _matrix(storage, path, 'extrinsic_parameters')
    if rows is None or rows.shape != (len(photos), 6):
        got = 'none' if rows is None else ' x '.join(map(str, rows.shape))
        raise DataError(f'{path}: poses do not match the photos: expected a list `images` of '
                        'name, rvec and tvec, or extrinsic_parameters with six numbers for each '
                        f'of {len(photos)} photos, got {got}')
    return [(photo.name, (row[:3], row[3:])) for photo, row in zip(photos, rows, strict=True)]


def _matrix(storage: Any, path: Path, *names: str) -> NDArray[np.float64] | None:
    for name in names:
        node = storage.getNode(name)
        if not node.empty():
            return _numbers(node, path)
    return None


def _numbers(node: Any, path: Path) -> NDArray[np.float64] | None:
    # OpenCV 5 writes beyond its memory where a size is missing, and ends the process
    if node.isMap() and node.getNode('sizes').empty() and not all(
            node.getNode(name).isInt() and node.getNode(name).real() >= 0
            for name in ('rows', 'cols')):
        raise DataError(f'{path}: no cameras: expected rows and cols, 0 or more, of each matrix, '
                        f'got one without: {node.name()}')
    found = node.mat()
    return None if found is None else np.asarray(found, np.float64)


def _vector(node: Any, path: Path) -> NDArray[np.float64] | None:
    """Return three numbers of a matrix or of a plain list."""
    if node.empty():
        return None
    values = [node.at(i).real() for i in range(node.size())] if node.isSeq() else (
        _numbers(node, path))
    found = np.asarray([] if values is None else values, np.float64).ravel()
    return found if found.size == 3 and np.isfinite(found).all() else None
