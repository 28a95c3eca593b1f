"""Files of cameras by what they look like: which reader each has, and where one is searched."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
import glob
from pathlib import Path

from active_recon.datasets.middlebury import camera_lines, lens_of, pose_of, read_box
from active_recon.errors import ConfigError, DataError, ViewError
from active_recon.photos.camera_file import CameraFile, Entry, Lens
from active_recon.photos.colmap import read_colmap
from active_recon.photos.files import PhotoFile
from active_recon.photos.opencv_yaml import read_opencv
from active_recon.photos.transforms_json import FLIP, read_transforms
import numpy as np
from numpy.typing import NDArray

FORMATS = ('transforms.json (NeRF, instant-ngp, nerfstudio), the folder of a COLMAP model, '
           '*_par.txt (Middlebury), or YAML, XML or JSON of OpenCV')
LOOKS = ('opencv', 'opengl')
"""Camera axes: x right, y down, z forward; or x right, y up, z backward."""
_MODEL_FOLDERS = ('.', '0', 'sparse', 'sparse/0', 'colmap/sparse/0')
_MODEL_FILES, _MODEL_ENDINGS = ('cameras', 'images'), ('.bin', '.txt')
_YAML = {'.yml', '.yaml', '.xml'}
_OPENCV_MATRIX = b'opencv-matrix'  # in JSON of OpenCV, which names its types


def read_cameras(path: Path, photos: Sequence[PhotoFile], looks: str | None = None) -> CameraFile:
    """
    Read the cameras in a file, or in a folder that has one of the known formats.

    `looks`, one of LOOKS, replaces the camera axes that the format has. Raises DataError where
    there is no such file or it cannot be used, ConfigError on another value of `looks`.
    """
    if not path.exists():
        raise DataError(f'{path}: no such file or folder: expected {FORMATS}', 'no_cameras')
    found = path if path.is_file() else find_cameras([path])
    if found is None:
        raise DataError(f'{path}: no cameras: expected {FORMATS}', 'no_cameras')
    read = _read(found, photos)
    if looks not in (None, *LOOKS):
        raise ConfigError(f'camera axes: unknown value: expected one of {", ".join(LOOKS)}, got '
                          f'{looks!r}')
    return read if looks in (None, read.looks) else with_other_axes(read)


def with_other_axes(cameras: CameraFile) -> CameraFile:
    """Return cameras as if the file had been read with the other one of LOOKS."""
    entries = [replace(each, pose=each.pose @ FLIP) for each in cameras.entries]
    return replace(cameras, entries=entries, looks=other_looks(cameras.looks))


def other_looks(looks: str) -> str:
    """Return the other one of LOOKS."""
    return LOOKS[1 - LOOKS.index(looks)]


def find_cameras(folders: Sequence[Path]) -> Path | None:
    """
    Return the first file of cameras in folders, or the folder of a COLMAP model, or None.

    NeRF's synthetic scenes have a file for each folder of photos: transforms_test.json for test/.
    """
    own = f'transforms_{folders[0].resolve().name}.json'
    for folder in folders:
        if not folder.is_dir():
            continue
        for pattern in ('transforms.json', glob.escape(own), 'transforms_train.json', '*_par.txt',
                        'cameras.y*ml', 'cameras.xml'):
            found = sorted(path for path in folder.glob(pattern)
                           if not path.name.startswith('.'))
            if len(found) == 1:
                return found[0]
        for model in (folder / name for name in _MODEL_FOLDERS):
            if (model / 'images.bin').is_file() or (model / 'images.txt').is_file():
                return model
    return None


def camera_files(place: Path) -> list[Path]:
    """Return the files that `read_cameras` reads at a place: two of a COLMAP model, or none."""
    found = place if place.is_file() else find_cameras([place])
    if found is None or found.is_file():
        return [] if found is None else [found]
    return sorted(path for path in found.iterdir() if path.stem in _MODEL_FILES
                  and path.suffix in _MODEL_ENDINGS)


def _read(path: Path, photos: Sequence[PhotoFile]) -> CameraFile:
    if path.is_dir():
        return read_colmap(path)
    if path.name.endswith('_par.txt'):
        return _read_middlebury(path)
    if path.suffix.lower() in _YAML or _is_json_of_opencv(path):
        return read_opencv(path, photos)
    if path.suffix.lower() == '.json':
        return read_transforms(path)
    if path.stem in _MODEL_FILES and path.suffix in _MODEL_ENDINGS:
        return read_colmap(path.parent)
    raise DataError(f'{path}: no cameras: expected {FORMATS}', 'no_cameras')


def _is_json_of_opencv(path: Path) -> bool:
    if path.suffix != '.json':  # OpenCV tells its formats by their endings
        return False
    with suppress(OSError):
        return _OPENCV_MATRIX in path.read_bytes()
    return False


def _read_middlebury(path: Path) -> CameraFile:
    """Read Middlebury's cameras; its world has y up."""
    entries = []
    for number, (name, numbers) in camera_lines(path):
        try:
            lens_of(numbers, (1, 1))
            entries.append(Entry(name, pose_of(numbers), _lens(numbers)))
        except ViewError as error:
            raise DataError(f'{path}, line {number}: {error}') from error
    try:
        box = read_box(path.parent)
    except (DataError, ConfigError):  # the object is found without it
        box = None
    return CameraFile(str(path), entries, np.array([0.0, 1.0, 0.0]), box)


def _lens(numbers: NDArray[np.float64]) -> Lens:
    return lambda size: lens_of(numbers, size)
