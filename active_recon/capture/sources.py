"""What images come from: a video device, a video file, or a folder; by OpenCV."""

import os
from pathlib import Path
from typing import Any, Protocol

from active_recon.calibration.files import decoded, image_paths, read_image
from active_recon.errors import ConfigError, DataError
from active_recon.geometry.cameras import Intrinsics
import cv2
import numpy as np
from numpy.typing import NDArray

FOLDER_RATE = 10.0
"""Images of a folder per second, where no other rate is asked for."""
_DEVICE = '/dev/video'
_FILM_RATE = 30.0  # of a file that does not tell
_HIGHEST_RATE = 1000.0
_TRIES = 5  # to find another image of a file
# The reason is said in one line here, not by the libraries
os.environ.setdefault('OPENCV_FFMPEG_LOGLEVEL', '-8')
_SILENT = 0
# OpenCV 4, which numpy below 2 needs, has it elsewhere than OpenCV 5
(getattr(cv2, 'setLogLevel', None) or cv2.utils.logging.setLogLevel)(_SILENT)


class ImageSource(Protocol):
    """
    Images one after the other.

    - name: in words; size: width and height, pixels
    - rate: per second; None: a device, which tells by its own pace
    """

    name: str
    size: tuple[int, int]
    rate: float | None

    def read(self) -> NDArray[np.uint8] | None:
        """
        Return the next image, (H, W, 3) uint8 RGB, None at the end.

        Raises DataError where an image cannot be read, kind 'device' where the device is gone.
        """
        ...

    def close(self) -> None:
        """Give the device or file back."""
        ...


def open_source(place: str, width: int = 0, height: int = 0, rate: float = 0.0) -> ImageSource:
    """
    Open /dev/videoN, or N alone, a video file, or a folder of images.

    `width`, `height` and `rate` are asked of a device, 0 for its own; `rate` is that of files
    too. Raises ConfigError without a place or with a size of files, DataError where nothing can
    be read from it.
    """
    if not place:
        raise ConfigError('no source: expected a video device, a video file, or a folder of '
                          'images, got none')
    if place.isascii() and place.isdigit():
        place = f'{_DEVICE}{place}'
    path = Path(place)
    if place.startswith(_DEVICE) or path.is_char_device():  # also /dev/v4l/by-id/...
        return _Device(path, width, height, rate)
    if width or height:
        raise ConfigError(f'{place}: no device, so no size can be asked for: expected 0 x 0, got '
                          f'{width} x {height}; files keep the size of their images')
    if path.is_dir():
        return _Folder(path, rate or FOLDER_RATE)
    if not path.is_file():
        raise DataError(f'{place}: no such file, folder or device', 'device')
    return _Film(path, rate)


def frame_count(path: Path) -> int:
    """Return how many images a video file has: as it says, or counted where it does not."""
    capture = cv2.VideoCapture(str(path), cv2.CAP_FFMPEG)
    try:
        told = int(capture.get(cv2.CAP_PROP_FRAME_COUNT))
        return told if told > 0 else sum(1 for _ in iter(capture.grab, False))
    finally:
        capture.release()


def fitting_lens(lens: Intrinsics, size: tuple[int, int], where: str) -> Intrinsics:
    """Return a lens if it is that of images of a size; raises DataError where it is not."""
    if (lens.width, lens.height) != size:
        raise DataError(f'{where}: calibration for another size: expected {size[0]} x {size[1]} '
                        f'pixels, as the images are, got {lens.width} x {lens.height}',
                        'image_size')
    return lens


class _Captured:
    """An OpenCV capture, whose first image tells its size."""

    rate: float | None = None

    def __init__(self, path: Path, capture: cv2.VideoCapture) -> None:
        self.name = str(path)
        self._capture = capture
        self._first: NDArray[np.uint8] | None = self._next()
        if self._first is None:
            self.close()
            raise DataError(f'{path}: no image comes: expected a working camera, or a video file '
                            'that OpenCV can read', 'device')
        self.size = self._first.shape[1], self._first.shape[0]

    def _next(self) -> NDArray[np.uint8] | None:
        there, image = self._capture.read() if self._capture.isOpened() else (False, None)
        if not there or image is None:
            return None
        return np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2RGB if image.ndim == 3 else
                                       cv2.COLOR_GRAY2RGB), np.uint8)

    def read(self) -> NDArray[np.uint8] | None:
        """Return the next image; see ImageSource."""
        first, self._first = self._first, None
        return self._next() if first is None else first

    def close(self) -> None:
        """Give it back; see ImageSource."""
        self._capture.release()


class _Device(_Captured):
    def __init__(self, path: Path, width: int, height: int, rate: float) -> None:
        if not path.exists():
            there = ', '.join(sorted(map(str, path.parent.glob('video*')))) or 'none'
            raise DataError(f'{path}: no such device: expected one of those there are: {there}',
                            'device')
        capture = cv2.VideoCapture(str(path), cv2.CAP_V4L2)
        for key, value in ((cv2.CAP_PROP_FRAME_WIDTH, width),
                           (cv2.CAP_PROP_FRAME_HEIGHT, height), (cv2.CAP_PROP_FPS, rate)):
            if value:
                capture.set(key, value)
        super().__init__(path, capture)

    def read(self) -> NDArray[np.uint8]:
        """Return the next image; see ImageSource: a device has no end."""
        image = super().read()
        if image is None:
            raise DataError(f'{self.name}: no image comes any more: is the camera unplugged?',
                            'device')
        return image


class _Film(_Captured):
    def __init__(self, path: Path, rate: float) -> None:
        capture = cv2.VideoCapture(str(path), cv2.CAP_FFMPEG)
        own = capture.get(cv2.CAP_PROP_FPS)
        super().__init__(path, capture)
        self.rate = rate or (own if 0 < own <= _HIGHEST_RATE else _FILM_RATE)

    def _next(self) -> NDArray[np.uint8] | None:
        """Return the next image that is whole: after damage OpenCV says once that none comes."""
        tries = (super(_Film, self)._next() for _ in range(_TRIES))
        return next((image for image in tries if image is not None), None)


class _Folder:
    def __init__(self, folder: Path, rate: float) -> None:
        self.name = str(folder)
        self.rate: float | None = rate
        self._left = image_paths([folder])
        self.size = _first_size(self._left)

    def read(self) -> NDArray[np.uint8] | None:
        """Return the next image; see ImageSource."""
        if not self._left:
            return None
        path = self._left.pop(0)
        image = _on_white(path)
        if (image.shape[1], image.shape[0]) != self.size:
            raise DataError(f'{path}: another size: expected {self.size[0]} x {self.size[1]} '
                            f'pixels as before, got {image.shape[1]} x {image.shape[0]}',
                            'image_size')
        return np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2RGB), np.uint8)

    def close(self) -> None:
        """Nothing is to be given back."""


def _on_white(path: Path) -> NDArray[np.uint8]:
    """Return a file's image laid on white where it is transparent, as those of messages are."""
    stored: Any = decoded(path, cv2.IMREAD_UNCHANGED)
    channels = stored.shape[2] if stored is not None and stored.ndim == 3 else 1
    if channels == 3 and stored.dtype == np.uint8:
        return np.asarray(stored)
    if channels < 4:  # grey, of more bits, or not readable
        return read_image(path)
    bgra = stored / (np.iinfo(stored.dtype).max if stored.dtype.kind == 'u' else 1)
    shown = 1 - (1 - bgra[..., :3]) * bgra[..., 3:]
    return np.asarray(np.rint(255 * shown).clip(0, 255), np.uint8)


def _first_size(paths: list[Path]) -> tuple[int, int]:
    """Return width and height of the first image that can be read; raises DataError if none."""
    problems = []
    for path in paths:
        try:
            height, width, _ = read_image(path).shape
            return width, height
        except DataError as error:
            problems.append(error)
    raise problems[0]
