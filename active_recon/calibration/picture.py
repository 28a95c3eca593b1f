"""A drawing of a calibration: detected and fitted corners, the axis, the object's cube."""

from collections.abc import Callable, Sequence
import math

from active_recon.calibration.fit import ImageFit
from active_recon.calibration.lens import project
from active_recon.calibration.placement import cube_corners
from active_recon.geometry.cameras import Intrinsics
from active_recon.view_colors import view_color
import cv2
import numpy as np
from numpy.typing import NDArray

_TILES = 6
_COLUMNS = 3
_WIDTH = 640  # width of a tile, pixels
_SHIFT = 4  # OpenCV draws in sixteenths of a pixel
_SEEN, _FITTED, _AXIS, _CUBE = (view_color(number)[::-1] for number in (3, 2, 4, 1))


def picture_of(images: Sequence[ImageFit], lens: Intrinsics,
               board_from_object: NDArray[np.float64], object_size: float,
               read: Callable[[str], NDArray[np.uint8]]) -> NDArray[np.uint8]:
    """
    Return up to six of the images with the fit drawn into them, (H, W, 3) uint8 BGR.

    Circles mark detected corners, crosses fitted ones. The thick lines are the axis, from the
    plate to the top of the object's cube, and the direction of the cube's front. `read` returns
    the image of a name.
    """
    chosen = np.unique(np.linspace(0, len(images) - 1, _TILES).round().astype(int))
    tiles = [_tile(images[index], lens, board_from_object, object_size, read)
             for index in chosen]
    blank = np.full_like(tiles[0], 255)
    tiles += [blank] * (math.ceil(len(tiles) / _COLUMNS) * _COLUMNS - len(tiles))
    rows = [np.concatenate(tiles[first:first + _COLUMNS], axis=1)
            for first in range(0, len(tiles), _COLUMNS)]
    return np.concatenate(rows)


def _tile(one: ImageFit, lens: Intrinsics, board_from_object: NDArray[np.float64],
          object_size: float, read: Callable[[str], NDArray[np.uint8]]) -> NDArray[np.uint8]:
    image = read(one.seen.name)
    scale = _WIDTH / image.shape[1]
    tile = np.asarray(cv2.resize(image, None, fx=scale, fy=scale,
                                 interpolation=cv2.INTER_AREA), np.uint8)
    pose = one.camera_from_board @ board_from_object
    half = object_size / 2
    for start, end in _edges(cube_corners(object_size)):
        _line(tile, scale, lens, pose, start, end, _CUBE)
    foot = np.array([0, 0, -half])
    for way in (np.array([0, 0, object_size]), np.array([half, 0, 0])):
        _line(tile, scale, lens, pose, foot, foot + way, _AXIS, 2)
    for seen, fitted in zip(one.seen.pixels, one.fitted, strict=True):
        cv2.circle(tile, _place(seen, scale), 5 << _SHIFT, _SEEN, 1, cv2.LINE_AA, _SHIFT)
        x, y = _place(fitted, scale)
        reach = 4 << _SHIFT
        for arm in ((reach, reach), (reach, -reach)):
            cv2.line(tile, (x - arm[0], y - arm[1]), (x + arm[0], y + arm[1]), _FITTED, 1,
                     cv2.LINE_AA, _SHIFT)
    tile[:28] = 255
    cv2.putText(tile, f'{one.seen.name}  {one.error:.2f} px', (10, 20),
                cv2.FONT_HERSHEY_SIMPLEX, 0.6, (0, 0, 0), 1, cv2.LINE_AA)
    return tile


def _edges(corners: NDArray[np.float64]) -> list[tuple[NDArray[np.float64], NDArray[np.float64]]]:
    return [(a, b) for index, a in enumerate(corners) for b in corners[index + 1:]
            if np.count_nonzero(a != b) == 1]


def _line(tile: NDArray[np.uint8], scale: float, lens: Intrinsics, pose: NDArray[np.float64],
          start: NDArray[np.float64], end: NDArray[np.float64], color: tuple[int, ...],
          thickness: int = 1) -> None:
    """Draw a line of the object frame with the lens's distortion, if it is in front of it."""
    points = np.linspace(start, end, 20)
    if (points @ pose[2, :3] + pose[2, 3]).min() <= 0:
        return
    places = np.array([_place(pixel, scale) for pixel in project(lens, points, pose)])
    cv2.polylines(tile, [places], False, color, thickness, cv2.LINE_AA, _SHIFT)


def _place(pixel: NDArray[np.float64], scale: float) -> tuple[int, int]:
    """Return the position on a tile of an image's pixel, in OpenCV's fixed-point numbers."""
    x, y = (pixel * scale - 0.5) * (1 << _SHIFT)
    return round(x), round(y)
