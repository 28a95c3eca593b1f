"""
Warp a camera's image to another camera that looks at the object's centre.

The image is warped as if everything in it were on the plane through the centre that faces the
other camera. This is exact at every depth if both cameras have the same position.
"""

from collections.abc import Callable, Iterator
import math

from active_recon.geometry.cameras import Camera, shown_at_depth_1
import cv2
import numpy as np
from numpy.typing import NDArray

_FEW = 16  # pixels a side that tell the scale of an image
_FINEST = 2
"""An image at least this many times as fine as needed is downsampled first."""
_MOST_SAMPLES = 3
SAMPLE_EVERY = 1.5
"""Largest distance of two samples in pixels: stripes of a pixel are not skipped."""
REDUCTIONS = (8, 4, 2, 1)
"""By how much a JPEG image can be reduced while it is decoded."""
_CARRIED_SIDE = 512  # pixels of a lens with distortion, whose rays are slow to compute
_BAND = 64
"""Rows of an image whose coordinates are computed at a time, to stay in the processor's cache."""
_NOWHERE = -1e9
"""A pixel coordinate outside of any image."""
_Places = tuple[NDArray[np.float64], NDArray[np.float64]]
"""Coordinates across and down an image, (S, S) each, or (rows, S) of some of its rows."""


def seen_by(target: Camera, image: NDArray[np.uint8], camera: Camera,
            beyond: int = cv2.BORDER_REPLICATE) -> NDArray[np.uint8]:
    """
    Return a camera's image, (H, W, C) uint8, warped to the target, (S, S, C).

    `beyond` is OpenCV's border mode for pixels outside of the image.
    """
    return seen_within(target, image, camera, beyond)[0]


def seen_within(target: Camera, image: NDArray[np.uint8], camera: Camera,
                beyond: int = cv2.BORDER_REPLICATE
                ) -> tuple[NDArray[np.uint8], NDArray[np.bool_]]:
    """Return what `seen_by` does, and which of its pixels lie in the camera's image, (S, S)."""
    size, lens = target.intrinsics.width, camera.intrinsics
    x, y = seen = _seen(camera, target, size)
    within = (x >= 0) & (x <= lens.width) & (y >= 0) & (y <= lens.height)
    if _is_whole_image(seen, camera, size):
        return _shrunk(image, size, size), within
    left, top, right, bottom = _window(seen, camera, size)
    width, height = (_few_pixels(count, size) for count in (right - left, bottom - top))
    window = _shrunk(image[top:bottom, left:right], width, height)
    across, down = width / (right - left), height / (bottom - top)
    fine = size * _samples((x * across, y * down))
    columns, rows = np.empty((2, fine, fine), np.float32)
    for band, (x, y) in _bands(camera, target, fine):
        _place(columns[band], x, left, across, width)
        _place(rows[band], y, top, down, height)
    # OpenCV samples four channels in a third of the time of three, and to the same bits
    padded = cv2.cvtColor(window, cv2.COLOR_RGB2RGBA) if image.shape[2:] == (3,) else window
    # In steps of 1/32 pixel all versions of OpenCV sample alike, so that bags replay on any
    places = cv2.convertMaps(columns, rows, cv2.CV_16SC2)
    sampled = _shrunk(np.asarray(cv2.remap(
        padded, *places, cv2.INTER_LINEAR, borderMode=beyond), np.uint8), size, size)
    if padded is not window:
        sampled = np.asarray(cv2.cvtColor(sampled, cv2.COLOR_RGBA2RGB), np.uint8)
    return sampled, within


def reduction(target: Camera, camera: Camera) -> int:
    """
    Return by how much a camera's image may be reduced before it is seen by the target.

    It is one of REDUCTIONS: the image is then still as fine as `seen_by` makes use of.
    """
    apart = _apart(_seen(camera, target, _FEW)) * _FEW / target.intrinsics.width
    return next((by for by in REDUCTIONS if apart >= _FINEST * by), 1)


def depth_seen_by(target: Camera, depth: NDArray[np.float32],
                  camera: Camera) -> NDArray[np.float32]:
    """
    Return a camera's depth image, (H, W), as the target beside it measures it, (S, S).

    Both are along the optical axis of their camera; 0 is no value. Each pixel takes the nearest
    one: the mean of two would lie on neither side of an edge.
    """
    size, lens = target.intrinsics.width, camera.intrinsics
    turned = depth * (camera.ray_directions() @ target.pose[:3, 2]).astype(np.float32)
    column, row = (np.floor(places).astype(np.int64) for places in _seen(camera, target, size))
    inside = (column >= 0) & (column < lens.width) & (row >= 0) & (row < lens.height)
    taken = turned[np.where(inside, row, 0), np.where(inside, column, 0)]
    return np.where(inside & (taken > 0), taken, 0).astype(np.float32)


def carried_back(framed: NDArray[np.float32], target: Camera,
                 camera: Camera) -> NDArray[np.float32]:
    """
    Return what was found in the target's image, (S, S), in that of the camera beside it, (H, W).

    It is 0 outside of the target's image.
    """
    lens = camera.intrinsics
    if lens.distortion is None and is_ahead(camera, target):
        return np.asarray(cv2.warpPerspective(framed, opencv_turn(camera, target),
                                              (lens.width, lens.height)))
    by = max(1.0, max(lens.width, lens.height) / _CARRIED_SIDE)
    few = lens.resized(round(lens.width / by), round(lens.height / by))
    turned = cv2.transform(shown_at_depth_1(few), _turn(target, camera))  # (h, w, 3)
    depth = turned[..., 2]
    ahead = depth > 0
    columns, rows = (
        np.divide(turned[..., axis], depth, out=np.full(ahead.shape, _NOWHERE), where=ahead)
        .astype(np.float32) - 0.5 for axis in (0, 1))
    found = cv2.remap(framed, columns, rows, cv2.INTER_LINEAR)
    return np.asarray(cv2.resize(found, (lens.width, lens.height)))


def _place(places: NDArray[np.float32], seen: NDArray[np.float64], first: int, scale: float,
           count: int) -> None:
    """Set coordinates to those seen in a window, scaled and kept beside its pixels."""
    seen -= first
    seen *= scale
    seen -= 0.5  # OpenCV's (0, 0) is the centre of the first pixel, ours its corner
    seen.clip(-1, count, out=seen)
    places[...] = seen


def _bands(camera: Camera, target: Camera, size: int) -> Iterator[tuple[slice, _Places]]:
    """Yield the camera's pixel coordinates of size x size target pixels, some rows at a time."""
    some_rows = _seen_rows(camera, target, size)
    for first in range(0, size, _BAND):
        band = slice(first, first + _BAND)
        yield band, some_rows(band)


def _seen(camera: Camera, target: Camera, size: int) -> _Places:
    """Return the camera's pixel coordinates of size x size target pixels."""
    return _seen_rows(camera, target, size)(slice(None))


def _seen_rows(camera: Camera, target: Camera, size: int) -> Callable[[slice], _Places]:
    """Return what `_seen` does of the rows that it is asked for."""
    fine = Camera(target.pose, target.intrinsics.resized(size, size))
    lens, centers = camera.intrinsics, np.arange(size) + 0.5
    is_turned = lens.distortion is None and np.array_equal(camera.position, target.position)
    matrix = turn_between(camera, fine) if is_turned else _plane_to_camera(fine, camera)

    def some_rows(band: slice) -> _Places:
        x, y, depth = (row[0] * centers + (row[1] * centers[band] + row[2])[:, None]
                       for row in matrix)
        behind = depth <= 0
        np.copyto(depth, -1e-9 if is_turned else 1, where=behind)
        x /= depth
        y /= depth
        if is_turned:
            return x, y
        x, y = (np.nan_to_num(each, copy=False, nan=_NOWHERE) for each in lens.pixels_of(x, y))
        x[behind] = y[behind] = _NOWHERE
        return x, y

    return some_rows


def _plane_to_camera(target: Camera, camera: Camera) -> NDArray[np.float64]:
    """
    Return the matrix (3, 3) from a target's pixels to coordinates in a camera's optical frame.

    They are those of the points on the plane through the centre that faces the target.
    """
    to_camera = camera.pose[:3, :3].T
    matrix = target.distance * (
        to_camera @ target.pose[:3, :3] @ np.linalg.inv(target.intrinsics.matrix))
    matrix[:, 2] += to_camera @ (target.position - camera.position)
    return np.asarray(matrix)


def turn_between(camera: Camera, target: Camera) -> NDArray[np.float64]:
    """Return the homography, (3, 3), from the target's pixels to those of a camera beside it."""
    return np.asarray(_turn(camera, target) @ np.linalg.inv(target.intrinsics.matrix))


def _turn(camera: Camera, target: Camera) -> NDArray[np.float64]:
    """Return the matrix (3, 3) from the target's rays to the pixels of a camera beside it."""
    return np.asarray(camera.intrinsics.matrix @ camera.pose[:3, :3].T @ target.pose[:3, :3])


def is_ahead(shown: Camera, camera: Camera) -> bool:
    """
    Return whether all rays of one camera's image go ahead of another at the same position.

    Behind it `opencv_turn` would show what is ahead, mirrored.
    """
    width, height = shown.intrinsics.width, shown.intrinsics.height
    ends = np.array([[0, width, 0, width], [0, 0, height, height], [1, 1, 1, 1]])
    return bool((opencv_turn(camera, shown)[2] @ ends).min() > 0)


def opencv_turn(camera: Camera, target: Camera) -> NDArray[np.float64]:
    """Return `turn_between` for OpenCV, whose (0, 0) is the centre of the first pixel."""
    half = np.array([[1, 0, 0.5], [0, 1, 0.5], [0, 0, 1]])
    return np.asarray(np.linalg.inv(half) @ turn_between(camera, target) @ half)


def _is_whole_image(seen: _Places, camera: Camera, size: int) -> bool:
    """Return whether the target's image is the camera's, resized."""
    lens, (x, y) = camera.intrinsics, seen
    middles = (np.arange(size) + 0.5) / size
    return lens.distortion is None and bool(
        np.abs(x[0] - middles * lens.width).max() <= 0.01
        and np.abs(x - middles * lens.width).max() <= 0.01
        and np.abs(y - (middles * lens.height)[:, None]).max() <= 0.01)


def _window(seen: _Places, camera: Camera, size: int) -> tuple[int, int, int, int]:
    """Return left, top, right, bottom of the required part of the camera's image, in pixels."""
    whole = np.array([camera.intrinsics.width, camera.intrinsics.height])
    first, last = (np.clip([extreme(each) for each in seen], 0, whole)
                   for extreme in (np.min, np.max))
    margin = (last - first) / size + 1
    left, top = np.maximum(np.floor(first - margin), 0).astype(int)
    right, bottom = np.minimum(np.ceil(last + margin), whole).astype(int)
    return int(left), int(top), int(right), int(bottom)


def _few_pixels(count: int, size: int) -> int:
    return math.ceil(count / max(count // (_FINEST * size), 1))


def _samples(seen: _Places) -> int:
    """Return the number of samples along each side of a target pixel that avoids aliasing."""
    squares = _squared_steps(seen)
    fewest, most = (_samples_for(math.sqrt(end)) for end in (squares.min(), squares.max()))
    return most if fewest == most else _samples_for(_apart(seen))


def _samples_for(apart: float) -> int:
    return min(max(1, math.ceil(apart / SAMPLE_EVERY)), _MOST_SAMPLES)


def _apart(seen: _Places) -> float:
    """Return the usual distance of neighbours in the camera's image, in its pixels."""
    return float(np.median(np.sqrt(_squared_steps(seen)), overwrite_input=True))


def _squared_steps(seen: _Places) -> NDArray[np.float64]:
    """Return the squared distances of all neighbours in the camera's image, in its pixels."""
    x, y = seen
    return np.concatenate([(np.diff(x, axis=axis) ** 2 + np.diff(y, axis=axis) ** 2).ravel()
                           for axis in (0, 1)])


def _shrunk(image: NDArray[np.uint8], width: int, height: int) -> NDArray[np.uint8]:
    resized = cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA)
    return np.asarray(resized, np.uint8)
