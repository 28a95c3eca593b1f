"""
Cameras of a COLMAP model, text or binary: `cameras` and `images`, with the suffix txt or bin.

An image has the pose camera from world as a quaternion w, x, y, z and a translation; the camera's
axes are OpenCV's, and (0.5, 0.5) is the centre of the first pixel. Nothing else of the model is
read: the library pycolmap would bring a hundred megabytes for these two files.

The format: https://colmap.github.io/format.html; the models: src/colmap/sensor/models.h.
"""

from collections.abc import Iterator, Mapping
from pathlib import Path
import struct

from active_recon.errors import DataError, ViewError
from active_recon.geometry.cameras import Intrinsics
from active_recon.geometry.lenses import Distortion
from active_recon.photos.camera_file import CameraFile, Entry, Lens, rigid, sized
import numpy as np
from scipy.spatial.transform import Rotation

_MODELS = (('SIMPLE_PINHOLE', 3), ('PINHOLE', 4), ('SIMPLE_RADIAL', 4), ('RADIAL', 5),
           ('OPENCV', 8), ('OPENCV_FISHEYE', 8), ('FULL_OPENCV', 12), ('FOV', 5),
           ('SIMPLE_RADIAL_FISHEYE', 4), ('RADIAL_FISHEYE', 5), ('THIN_PRISM_FISHEYE', 12))
_COUNTS = dict(_MODELS)
_ONE_FOCAL = {'SIMPLE_PINHOLE', 'SIMPLE_RADIAL', 'RADIAL', 'SIMPLE_RADIAL_FISHEYE',
              'RADIAL_FISHEYE'}
_Image = tuple[str, int, tuple[float, ...]]
"""Name, camera id, and quaternion with translation."""


def read_colmap(folder: Path) -> CameraFile:
    """
    Read the model in a folder; its world has no direction of its own that is up.

    Raises DataError on files that are missing, cut off, or of a lens without an equivalent.
    """
    binary = (folder / 'images.bin').is_file() and (folder / 'cameras.bin').is_file()
    suffix = '.bin' if binary else '.txt'
    lenses_file, images_file = folder / f'cameras{suffix}', folder / f'images{suffix}'
    try:
        if binary:
            lenses = dict(_binary_lenses(lenses_file.read_bytes()))
            images = list(_binary_images(images_file.read_bytes()))
        else:
            lenses = dict(_text_lenses(lenses_file.read_text()))
            images = list(_text_images(images_file.read_text()))
    except (OSError, UnicodeDecodeError, ValueError, IndexError, struct.error,
            ViewError) as error:
        raise DataError(f'{folder}: no COLMAP model: expected cameras and images as .txt or .bin, '
                        f'got: {error}') from error
    entries = [_entry(image, lenses, images_file) for image in images]
    if not entries:
        raise DataError(f'{images_file}: no cameras: expected a pose for each image, got none')
    return CameraFile(str(folder), entries, stored=True)  # COLMAP does not turn photos by EXIF


def _entry(image: _Image, lenses: Mapping[int, Lens], path: Path) -> Entry:
    name, camera, numbers = image
    if camera not in lenses:
        raise DataError(f'{path}: {name} has camera {camera}: expected one of '
                        f'{", ".join(map(str, lenses))}')
    quaternion, moved = np.array(numbers[:4]), np.array(numbers[4:])
    if not 0.5 < np.linalg.norm(quaternion) < 2:
        raise DataError(f'{path}: {name}: no rotation: expected a unit quaternion, got '
                        f'{quaternion}')
    rotation = Rotation.from_quat(np.roll(quaternion, -1)).as_matrix()
    return Entry(name, rigid(rotation.T, -rotation.T @ moved, f'{path}: {name}'), lenses[camera])


def colmap_lens(model: str, width: int, height: int, numbers: tuple[float, ...]) -> Lens:
    """Return the lens of a camera by its model's name and numbers; raises ValueError if unfit."""
    if model not in _COUNTS or len(numbers) != _COUNTS[model]:
        raise ValueError(f'a camera of the model {model} with {len(numbers)} parameters')
    across, *rest = numbers
    down = across if model in _ONE_FOCAL else rest.pop(0)
    cx, cy, *bent = rest
    if not min(across, down, width, height) > 0:
        raise ValueError(f'a camera of focal lengths {across}, {down} and {width} x {height} '
                         'pixels: expected all above 0')
    return sized(Intrinsics(across, down, cx, cy, width, height, _distortion(model, bent)))


def _distortion(model: str, given: list[float]) -> Distortion | None:
    if model in ('FOV', 'THIN_PRISM_FISHEYE'):
        raise ValueError(f'a lens of the model {model}: run `colmap image_undistorter` first')
    if model.endswith('FISHEYE'):
        return Distortion('equidistant', tuple((*given, 0.0, 0.0, 0.0)[:4]))
    if not any(given):
        return None
    if model == 'FULL_OPENCV':
        return Distortion('rational_polynomial', tuple(given))
    return Distortion('plumb_bob', tuple((*given, 0.0, 0.0, 0.0)[:4]))


def _text_lenses(text: str) -> Iterator[tuple[int, Lens]]:
    for line in _lines(text):
        if not line:
            continue
        identity, model, width, height, *numbers = line.split()
        yield int(identity), colmap_lens(
            model, int(width), int(height), tuple(map(float, numbers)))


def _text_images(text: str) -> Iterator[_Image]:
    lines = iter(_lines(text))
    for line in lines:
        if not line:
            continue
        _, *numbers, camera, name = line.split(maxsplit=9)
        if len(numbers) != 7:
            raise ValueError(f'a pose of {len(numbers)} numbers in the line {line[:60]!r}')
        yield name, int(camera), tuple(map(float, numbers))
        next(lines, '')  # the image's points, perhaps none


def _lines(text: str) -> list[str]:
    return [line.strip() for line in text.splitlines() if not line.startswith('#')]


def _binary_lenses(data: bytes) -> Iterator[tuple[int, Lens]]:
    count, = struct.unpack_from('<Q', data)
    at = 8
    for _ in range(count):
        identity, kind, width, height = struct.unpack_from('<iiQQ', data, at)
        if not 0 <= kind < len(_MODELS):
            raise ValueError(f'a camera of the model number {kind}')
        model, size = _MODELS[kind]
        numbers = struct.unpack_from(f'<{size}d', data, at + 24)
        at += 24 + 8 * size
        yield identity, colmap_lens(model, width, height, numbers)


def _binary_images(data: bytes) -> Iterator[_Image]:
    count, = struct.unpack_from('<Q', data)
    at = 8
    for _ in range(count):
        _, *numbers, camera = struct.unpack_from('<i7di', data, at)
        end = data.index(b'\0', at + 64)
        name = data[at + 64:end].decode()
        points, = struct.unpack_from('<Q', data, end + 1)
        at = end + 9 + 24 * points
        if at > len(data):
            raise ValueError('a file that is cut off')
        yield name, camera, tuple(numbers)
