"""The ChArUco board: printing it, and detecting its corners in images."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
import re

from active_recon.errors import ConfigError, DataError
import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image

DICTIONARIES = tuple(sorted(name.removeprefix('DICT_').lower() for name in dir(cv2.aruco)
                            if re.fullmatch(r'DICT_\dX\d_\d+', name)))
PIXELS_PER_MM = 12
_MARGIN = 0.5  # white margin of the printed board, in squares
_FEWEST_CORNERS = 6
_ENOUGH_CORNERS = 12  # below, corners beside a single marker are taken as well
_ASIDE = 0.01  # of the image's longer side: farther from the others' plane a corner is another's
_SIDE = 60  # side of a square that the detector reliably finds, pixels


@dataclass(frozen=True)
class Board:
    """
    A ChArUco board of `columns` x `rows` squares.

    `square` and `marker` are the sides of a square and of a marker, metres; `dictionary` is one
    of DICTIONARIES. Raises ConfigError where such a board is impossible.
    """

    columns: int = 7
    rows: int = 5
    square: float = 0.03
    marker: float = 0.0225
    dictionary: str = '4x4_50'

    def __post_init__(self) -> None:
        """Reject boards on which OpenCV would crash."""
        if min(self.columns, self.rows) < 3 or max(self.columns, self.rows) < 4:
            raise ConfigError('board: too few squares: expected 4 x 3 or more, got '
                              f'{self.columns} x {self.rows}')
        if not 0 < self.marker < self.square < np.inf:
            raise ConfigError('board: wrong sizes: expected markers smaller than the squares, '
                              f'both above 0, got markers of {self.marker * 1e3:g} mm in squares '
                              f'of {self.square * 1e3:g} mm')
        if self.dictionary not in DICTIONARIES:
            raise ConfigError('board: unknown dictionary: expected one of '
                              f'{", ".join(DICTIONARIES)}, got {self.dictionary!r}')
        there = len(self._dictionary.bytesList)
        if self.columns * self.rows // 2 > there:
            raise ConfigError(f'board: too many markers: expected at most the {there} of '
                              f'{self.dictionary}, got {self.columns * self.rows // 2}; use '
                              'a larger dictionary or fewer squares')

    @property
    def _dictionary(self) -> cv2.aruco.Dictionary:
        return cv2.aruco.getPredefinedDictionary(
            getattr(cv2.aruco, f'DICT_{self.dictionary.upper()}'))

    @cached_property
    def _charuco(self) -> cv2.aruco.CharucoBoard:
        return cv2.aruco.CharucoBoard(
            (self.columns, self.rows), self.square, self.marker, self._dictionary)

    @property
    def corners(self) -> NDArray[np.float64]:
        """All inner corners in the board's frame, metres, (N, 3), indexed by their ids."""
        return np.asarray(self._charuco.getChessboardCorners(), np.float64)

    def drawn(self, pixels_per_mm: float = PIXELS_PER_MM) -> NDArray[np.uint8]:
        """Return an image of the board without a margin, (rows x side, columns x side) uint8."""
        side = round(self.square * 1e3 * pixels_per_mm)
        return np.asarray(self._charuco.generateImage(
            (self.columns * side, self.rows * side)), np.uint8)

    @cached_property
    def _first_pixel(self) -> NDArray[np.float64]:
        """The detector's (0, 0) in our pixels: in OpenCV 5 a pixel's centre, in 4 its corner."""
        drawn = self.drawn(_SIDE / self.square / 1e3)
        corners, ids, *_ = cv2.aruco.CharucoDetector(self._charuco).detectBoard(
            np.pad(drawn, _SIDE, constant_values=255))
        true = self.corners[np.ravel(ids), :2] / self.square * _SIDE + _SIDE
        apart = true - np.asarray(corners, np.float64).reshape(-1, 2)
        return np.asarray(np.round(2 * np.median(apart, axis=0)) / 2)

    def printed_size(self) -> tuple[float, float]:
        """Return width and height of all squares together as `save` draws them, metres."""
        side = round(self.square * 1e3 * PIXELS_PER_MM) / PIXELS_PER_MM / 1e3
        return self.columns * side, self.rows * side

    def save(self, path: Path) -> None:
        """
        Write the board with a margin as a PNG file with its resolution, so that it prints to size.

        Raises DataError where the file cannot be written, ConfigError where the squares are too
        small or too large to be drawn.
        """
        try:
            drawn = self.drawn()
        except cv2.error as error:
            raise ConfigError(f'board: cannot be drawn with squares of {self.square * 1e3:g} mm '
                              f'and markers of {self.marker * 1e3:g} mm at {PIXELS_PER_MM:g} '
                              'pixels a mm; are they in millimetres?') from error
        margin = round(_MARGIN * drawn.shape[1] / self.columns)
        sheet = np.pad(drawn, margin, constant_values=255)
        density = PIXELS_PER_MM * 25.4
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            Image.fromarray(sheet).save(path, dpi=(density, density))
        except (OSError, ValueError) as error:
            raise DataError(f'{path}: image not written: expected the path of a PNG file, got: '
                            f'{error}') from error

    def detect(self, image: NDArray[np.uint8], name: str) -> 'Detection | None':
        """
        Return the corners detected in an image, (H, W) or (H, W, 3) uint8.

        Returns None where they are too few for a pose. Raises DataError where the image shows
        another board, with markers that this one does not have.
        """
        corners, ids, _, markers = cv2.aruco.CharucoDetector(self._charuco).detectBoard(image)
        known = self.columns * self.rows // 2
        unknown = [] if markers is None else [int(one) for one in markers.ravel() if one >= known]
        if len(unknown) >= _FEWEST_CORNERS:
            raise DataError(f'{name}: another board: expected one of {self.columns} x {self.rows} '
                            f'squares with markers 0 to {known - 1}, got marker '
                            f'{max(unknown)}; give the number of squares by --squares')
        numbers = np.empty(0, np.intp) if ids is None else np.asarray(ids, np.intp).ravel()
        pixels = np.asarray(corners if len(numbers) else np.empty(0), np.float64).reshape(-1, 2)
        if markers is not None and len(numbers) < _ENOUGH_CORNERS:
            numbers, pixels = self._beside_one_marker(image)
        if len(numbers) < _FEWEST_CORNERS or self._charuco.checkCharucoCornersCollinear(
                numbers.astype(np.int32)):
            return None
        return Detection(name, self.corners[numbers], pixels + self._first_pixel,
                         (image.shape[1], image.shape[0]))

    def _beside_one_marker(self, image: NDArray[np.uint8]
                           ) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
        """Return ids and pixels of the corners where an object covers most of the board."""
        lenient = cv2.aruco.CharucoParameters()
        lenient.minMarkers = 1
        corners, ids, *_ = cv2.aruco.CharucoDetector(self._charuco, lenient).detectBoard(image)
        if ids is None or len(ids) < _FEWEST_CORNERS:
            return np.empty(0, np.intp), np.empty((0, 2))
        numbers, pixels = np.ravel(ids).astype(np.intp), np.asarray(corners, np.float64)
        pixels = pixels.reshape(-1, 2)
        _, fitting = cv2.findHomography(self.corners[numbers, :2], pixels, cv2.RANSAC,
                                        _ASIDE * max(image.shape[:2]))
        kept = np.zeros(len(numbers), np.bool_)
        if fitting is not None:
            kept = np.ravel(fitting).astype(np.bool_)
        return numbers[kept], pixels[kept]


@dataclass(frozen=True, eq=False)
class Detection:
    """
    The corners of the board detected in one image.

    - name: of the image
    - points: their positions in the board's frame, metres, (N, 3)
    - pixels: their positions in the image, (N, 2); the centre of the first pixel is (0.5, 0.5)
    - size: the image's width and height, pixels
    """

    name: str
    points: NDArray[np.float64]
    pixels: NDArray[np.float64]
    size: tuple[int, int]


def detect_all(board: Board, images: Iterable[tuple[str, NDArray[np.uint8]]], fewest: int
               ) -> tuple[list[Detection], list[str]]:
    """
    Return the detections of the board in named images, and the names of images without one.

    Raises DataError where there are fewer than `fewest` detections, or the images differ in size.
    """
    found, missing = [], []
    for name, image in images:
        seen = board.detect(image, name)
        if seen is None:
            missing.append(name)
        else:
            found.append(seen)
    if len(found) < fewest:
        lost = f' (not in {", ".join(missing)})' if missing else ''
        raise DataError(f'too few images: expected the board in {fewest} or more, found it in '
                        f'{len(found)} of {len(found) + len(missing)}{lost}; check that it has '
                        f'{board.columns} x {board.rows} squares and the dictionary '
                        f'{board.dictionary}, and that it is sharp, flat and large in the image '
                        f'(at least {_FEWEST_CORNERS} corners)', 'too_few_images')
    for other in found:
        if other.size != found[0].size:
            raise DataError(f'images differ in size: expected one size, got {found[0].size} of '
                            f'{found[0].name} and {other.size} of {other.name}', 'image_size')
    return found, missing
