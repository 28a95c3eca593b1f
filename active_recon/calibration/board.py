"""The ChArUco board: how it is printed, and where its corners are in an image."""

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
_MARGIN = 0.5  # white around the printed board, in squares
_FEWEST_CORNERS = 6
_SIDE = 60  # of a square that the detector is sure to find, pixels


@dataclass(frozen=True)
class Board:
    """
    A ChArUco board of `columns` x `rows` squares.

    `square` and `marker` are the sides of a square and of a marker, metres; `dictionary` is one
    of DICTIONARIES. Raises ConfigError where there is no such board.
    """

    columns: int = 7
    rows: int = 5
    square: float = 0.03
    marker: float = 0.0225
    dictionary: str = '4x4_50'

    def __post_init__(self) -> None:
        """Reject what OpenCV would crash on."""
        if min(self.columns, self.rows) < 3 or max(self.columns, self.rows) < 4:
            raise ConfigError('board: too few squares: expected 4 x 3 or more, got '
                              f'{self.columns} x {self.rows}')
        if not 0 < self.marker < self.square < np.inf:
            raise ConfigError('board: wrong sizes: expected markers smaller than the squares, and '
                              f'both above 0, got markers of {self.marker * 1e3:g} mm in squares '
                              f'of {self.square * 1e3:g} mm')
        if self.dictionary not in DICTIONARIES:
            raise ConfigError('board: unknown dictionary: expected one of '
                              f'{", ".join(DICTIONARIES)}, got {self.dictionary!r}')
        there = len(self._dictionary.bytesList)
        if self.columns * self.rows // 2 > there:
            raise ConfigError(f'board: too many markers: expected at most {there}, as '
                              f'{self.dictionary} has, got {self.columns * self.rows // 2}; take '
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
        """All inner corners in the board's frame, metres, (N, 3), by their ids."""
        return np.asarray(self._charuco.getChessboardCorners(), np.float64)

    def drawn(self, pixels_per_mm: float = PIXELS_PER_MM) -> NDArray[np.uint8]:
        """Return the board without a margin, (rows x side, columns x side) uint8."""
        side = round(self.square * 1e3 * pixels_per_mm)
        return np.asarray(self._charuco.generateImage(
            (self.columns * side, self.rows * side)), np.uint8)

    @cached_property
    def _first_pixel(self) -> NDArray[np.float64]:
        """Where the detector's (0, 0) is: OpenCV 5 says the first pixel's centre, 4 its corner."""
        drawn = self.drawn(_SIDE / self.square / 1e3)
        corners, ids, *_ = cv2.aruco.CharucoDetector(self._charuco).detectBoard(
            np.pad(drawn, _SIDE, constant_values=255))
        true = self.corners[np.ravel(ids), :2] / self.square * _SIDE + _SIDE
        apart = true - np.asarray(corners, np.float64).reshape(-1, 2)
        return np.asarray(np.round(2 * np.median(apart, axis=0)) / 2)

    def printed_size(self) -> tuple[float, float]:
        """Return width and height of the squares as `save` prints them, metres."""
        side = round(self.square * 1e3 * PIXELS_PER_MM) / PIXELS_PER_MM / 1e3
        return self.columns * side, self.rows * side

    def save(self, path: Path) -> None:
        """Write the board with a margin as an image (PNG) that knows its true size."""
        drawn = self.drawn()
        margin = round(_MARGIN * drawn.shape[1] / self.columns)
        sheet = np.pad(drawn, margin, constant_values=255)
        density = PIXELS_PER_MM * 25.4
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            Image.fromarray(sheet).save(path, dpi=(density, density))
        except (OSError, ValueError) as error:
            raise DataError(f'{path}: picture not written: expected a place for a PNG file: '
                            f'{error}') from error

    def detect(self, image: NDArray[np.uint8], name: str) -> 'Detection | None':
        """
        Return the corners that are seen in an image, (H, W) or (H, W, 3) uint8.

        Returns None where too few are seen for a pose. Raises DataError where another board is
        seen: one with markers that this one has not.
        """
        corners, ids, _, markers = cv2.aruco.CharucoDetector(self._charuco).detectBoard(image)
        known = self.columns * self.rows // 2
        strange = [] if markers is None else [int(one) for one in markers.ravel() if one >= known]
        if len(strange) >= _FEWEST_CORNERS:
            raise DataError(f'{name}: another board: expected one of {self.columns} x {self.rows} '
                            f'squares with markers 0 to {known - 1}, but it has marker '
                            f'{max(strange)}; say how many squares the board has')
        if ids is None or len(ids) < _FEWEST_CORNERS:
            return None
        ids = np.asarray(ids).ravel()
        if self._charuco.checkCharucoCornersCollinear(ids):
            return None
        return Detection(name, self.corners[ids],
                         np.asarray(corners, np.float64).reshape(-1, 2) + self._first_pixel,
                         (image.shape[1], image.shape[0]))


@dataclass(frozen=True, eq=False)
class Detection:
    """
    The board in one image.

    - points: the corners that are seen, in the board's frame, metres, (N, 3)
    - pixels: where they are seen, (N, 2), the centre of the first pixel being (0.5, 0.5)
    - size: the image's width and height, pixels
    """

    name: str
    points: NDArray[np.float64]
    pixels: NDArray[np.float64]
    size: tuple[int, int]


def detect_all(board: Board, images: Iterable[tuple[str, NDArray[np.uint8]]], fewest: int
               ) -> tuple[list[Detection], list[str]]:
    """
    Return the board in each of the named images, and the names of those where it is not seen.

    Raises DataError where it is seen in fewer than `fewest`, or where the images differ in size.
    """
    found, missing = [], []
    for name, image in images:
        seen = board.detect(image, name)
        if seen is None:
            missing.append(name)
        else:
            found.append(seen)
    if len(found) < fewest:
        lost = f' It is not seen in {", ".join(missing)}.' if missing else ''
        raise DataError(f'too few images: expected the board in {fewest} or more, it is seen in '
                        f'{len(found)} of {len(found) + len(missing)}.{lost} Are the squares '
                        f'({board.columns} x {board.rows}) and the dictionary '
                        f'({board.dictionary}) those of the board? Is it sharp, flat, and large '
                        f'in the image ({_FEWEST_CORNERS} corners at least)?', 'too_few_images')
    for other in found:
        if other.size != found[0].size:
            raise DataError(f'images differ in size: expected one size, got {found[0].size} of '
                            f'{found[0].name} and {other.size} of {other.name}', 'image_size')
    return found, missing
