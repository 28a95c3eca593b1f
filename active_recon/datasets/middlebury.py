"""
Calibrated photographs in Middlebury's format: images, cameras and a bounding box in one folder.

    *_par.txt    the number of images, then a line for each: name, K, R and t, row-major; R and t
                 transform world to camera coordinates; pixel (0, 0) is the centre of the first
    README.txt   two lines `(x y z)`: the corners of the object's bounding box
    masks/       optional: for each image a mask of the same name, bright where the object is;
                 without masks, pixels that are not nearly black are taken as the object

The format: Seitz et al., "A comparison and evaluation of multi-view stereo reconstruction
algorithms", CVPR 2006, https://vision.middlebury.edu/mview/data/.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
import re

from active_recon.errors import ConfigError, DataError, ViewError
from active_recon.geometry.cameras import Camera, Intrinsics
from active_recon.volumes.meshes import upright
import cv2
import numpy as np
from numpy.typing import NDArray

MARGIN = 1.09  # side of the cube relative to the longest side of the box
_NUMBERS = 21  # K, R, t
_DARK = 0.19  # brightness in [0, 1] up to which a pixel is background
_GROWN, _SHRUNK = 10, 7  # pixels by which a mask is dilated, then eroded, to close dark spots
_NUMBER = r'([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)'
_CORNER = re.compile(rf'^\s*\(\s*{_NUMBER}\s+{_NUMBER}\s+{_NUMBER}\s*\)\s*$', re.MULTILINE)
_FRONTS = {'x': 'y', 'y': 'x', 'z': 'x'}


@dataclass(frozen=True, eq=False)
class PosedPhotographs:
    """
    V photographs of one object; lengths are in sides of its cube.

    - images: (H, W, 3) uint8 RGB each
    - masks: (H, W) bool each, true on the object
    """

    folder: Path
    names: tuple[str, ...]
    images: tuple[NDArray[np.uint8], ...]
    masks: tuple[NDArray[np.bool_], ...]
    cameras: tuple[Camera, ...]

    def __len__(self) -> int:
        """Return the number of photographs."""
        return len(self.images)


def read_photographs(folder: Path, box: Sequence[float] | None = None,
                     up: str = 'y') -> PosedPhotographs:
    """
    Read photographs in Middlebury's format.

    `box` holds the minimum and then the maximum x, y, z of the object in the frame of the camera
    file; None reads them from README.txt. `up` is the axis of that frame that points up. Raises
    DataError where a file is missing or invalid, ConfigError on an invalid box.
    """
    if not folder.is_dir():
        raise DataError(f'{folder}: no such folder: expected one of photographs')
    files = sorted(folder.glob('*_par.txt'))
    if len(files) != 1:
        raise DataError(f'{folder}: wrong number of camera files: expected one *_par.txt, found '
                        f'{len(files)}')
    least, greatest = read_box(folder, box)
    side = MARGIN * float((greatest - least).max())
    turn = upright(up, _FRONTS.get(up.lstrip('+-'), 'x'))
    names, images, masks, cameras = [], [], [], []
    for number, (name, numbers) in camera_lines(files[0]):
        images.append(_image(folder / name))
        masks.append(_mask(folder / 'masks' / name, images[-1]))
        names.append(name)
        try:
            cameras.append(_camera(numbers, turn, (least + greatest) / 2, side,
                                   images[-1].shape[1::-1]))
        except ViewError as error:
            raise DataError(f'{files[0]}, line {number}: {error}') from error
    if not images:
        raise DataError(f'{files[0]}: no cameras: expected a line for each image, got none')
    return PosedPhotographs(folder, tuple(names), tuple(images), tuple(masks), tuple(cameras))


def read_box(folder: Path, box: Sequence[float] | None = None) -> NDArray[np.float64]:
    """
    Return the minimum and the maximum corner of the object, (2, 3), from README.txt or as given.

    Raises DataError where there is none, ConfigError where the given one is invalid.
    """
    if box is None:
        read = [found for path in sorted(folder.glob('README*'))
                for found in _CORNER.findall(path.read_text(errors='replace'))]
        if len(read) != 2:
            raise DataError(f'{folder}: no box of the object: expected its corners as two lines '
                            f'(x y z) in README.txt, found {len(read)}; give them by --box')
        box = [float(number) for corner in read for number in corner]
    corners = np.array(box, np.float64)
    if corners.size != 6 or not np.isfinite(corners).all() or (
            corners[:3] >= corners[3:]).any():
        raise ConfigError('box: invalid corners: expected six numbers, the minimum x, y, z and '
                          f'then the maximum, got {" ".join(map(str, box))}')
    return corners.reshape(2, 3)


def camera_lines(path: Path) -> Iterator[tuple[int, tuple[str, NDArray[np.float64]]]]:
    """
    Yield the line's number, and name and numbers (21,) of each camera: K, R and t.

    Raises DataError where a line is no camera.
    """
    for number, line in enumerate(path.read_text(errors='replace').splitlines()[1:], start=2):
        if line.strip():
            yield number, _fields(path, number, line)


def _fields(path: Path, number: int, line: str) -> tuple[str, NDArray[np.float64]]:
    name, *rest = line.split()
    try:
        numbers = np.array(rest, np.float64)
    except ValueError:
        numbers = np.empty(0)
    if numbers.size != _NUMBERS or not np.isfinite(numbers).all():
        raise DataError(f'{path}, line {number}: not a camera: expected a name and {_NUMBERS} '
                        f'numbers (K, R, t), got {line[:60]!r}')
    return name, numbers


def _camera(numbers: NDArray[np.float64], turn: NDArray[np.float64],
            centre: NDArray[np.float64], side: float, size: tuple[int, int]) -> Camera:
    lens = lens_of(numbers, size)
    world = pose_of(numbers)
    pose = np.eye(4)
    pose[:3, :3] = turn @ world[:3, :3]
    pose[:3, 3] = turn @ (world[:3, 3] - centre) / side
    return Camera(pose, lens)


def lens_of(numbers: NDArray[np.float64], size: tuple[int, int]) -> Intrinsics:
    """Return the lens of a line (21,) for photos of (width, height); raises ViewError."""
    lens = numbers[:9].reshape(3, 3)
    if abs(lens[0, 1]) > 1e-3 * lens[0, 0] or min(lens[0, 0], lens[1, 1]) <= 0:
        raise ViewError('invalid lens: expected focal lengths above 0 and no skew, got '
                        f'{lens.tolist()}')
    return Intrinsics(lens[0, 0], lens[1, 1], lens[0, 2] + 0.5, lens[1, 2] + 0.5, *size)


def pose_of(numbers: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the pose of a line (21,), world from optical frame, (4, 4); raises ViewError."""
    rotation, moved = numbers[9:18].reshape(3, 3), numbers[18:]
    left, _, right = np.linalg.svd(rotation)
    if not np.allclose(left @ right, rotation, atol=1e-3):
        raise ViewError('invalid rotation: expected an orthogonal matrix, got '
                        f'{rotation.tolist()}')
    pose = np.eye(4)
    pose[:3, :3] = (left @ right).T  # of the nearest rotation: files round theirs
    pose[:3, 3] = -pose[:3, :3] @ moved
    return pose


def _image(path: Path) -> NDArray[np.uint8]:
    bgr = cv2.imread(str(path), cv2.IMREAD_COLOR)
    if bgr is None:
        found = 'no whole image' if path.is_file() else 'no file'
        raise DataError(f'{path}: no readable photograph: expected an image file, found {found}')
    return np.asarray(cv2.cvtColor(bgr, cv2.COLOR_BGR2RGB), np.uint8)


def _mask(path: Path, image: NDArray[np.uint8]) -> NDArray[np.bool_]:
    if path.is_file():
        mask = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
        if mask is None or mask.shape != image.shape[:2]:
            raise DataError(f'{path}: no mask of the right size: expected {image.shape[1]} x '
                            f'{image.shape[0]} pixels, got '
                            f'{None if mask is None else mask.shape[::-1]}')
        return np.asarray(mask > 127)
    bright = (image.max(axis=2) > _DARK * 255).astype(np.uint8)
    grown, shrunk = (cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * reach + 1,) * 2)
                     for reach in (_GROWN, _SHRUNK))
    return np.asarray(cv2.erode(cv2.dilate(bright, grown), shrunk) > 0)
