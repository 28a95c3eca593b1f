"""
Warp a camera's image to another camera that looks at the object's centre.

The image is warped as if everything in it were on the plane through the centre that faces the
other camera. This is exact at every depth if both cameras have the same position.
"""

import math

from active_recon.geometry.cameras import Camera
import cv2
import numpy as np
from numpy.typing import NDArray

_FINEST = 2
"""An image at least this many times as fine as needed is downsampled first."""
_MOST_SAMPLES = 3
SAMPLE_EVERY = 1.5
"""Largest distance of two samples in pixels: stripes of a pixel are not skipped."""


def seen_by(target: Camera, image: NDArray[np.uint8], camera: Camera,
            beyond: int = cv2.BORDER_REPLICATE) -> NDArray[np.uint8]:
    """
    Return a camera's image, (H, W, C) uint8, warped to the target, (S, S, C).

    `beyond` is OpenCV's border mode for pixels outside of the image.
    """
    size = target.intrinsics.width
    seen = _seen(camera, target, size)
    if _is_whole_image(seen, camera, size):
        return _shrunk(image, size, size)
    left, top, right, bottom = _window(seen, camera, size)
    width, height = (_few_pixels(count, size) for count in (right - left, bottom - top))
    window = _shrunk(image[top:bottom, left:right], width, height)
    scale = np.array([width / (right - left), height / (bottom - top)])
    fine = size * _samples(seen * scale)
    # OpenCV's (0, 0) is the centre of the first pixel, ours its corner
    where = (_seen(camera, target, fine) - [left, top]) * scale - 0.5
    where = np.clip(where, -1, [width, height]).astype(np.float32)
    sampled = cv2.remap(window, where[..., 0], where[..., 1], cv2.INTER_LINEAR,
                        borderMode=beyond)
    return _shrunk(np.asarray(sampled, np.uint8), size, size)


def depth_seen_by(target: Camera, depth: NDArray[np.float32],
                  camera: Camera) -> NDArray[np.float32]:
    """
    Return a camera's depth image, (H, W), as the target beside it measures it, (S, S).

    Both are along the optical axis of their camera; 0 is no value. Each pixel takes the nearest
    one: the mean of two would lie on neither side of an edge.
    """
    size, lens = target.intrinsics.width, camera.intrinsics
    turned = depth * (camera.ray_directions() @ target.pose[:3, 2]).astype(np.float32)
    column, row = np.moveaxis(np.floor(_seen(camera, target, size)).astype(np.int64), -1, 0)
    inside = (column >= 0) & (column < lens.width) & (row >= 0) & (row < lens.height)
    taken = turned[np.where(inside, row, 0), np.where(inside, column, 0)]
    return np.where(inside & (taken > 0), taken, 0).astype(np.float32)


def _seen(camera: Camera, target: Camera, size: int) -> NDArray[np.float64]:
    """Return the camera's pixel coordinates of size x size target pixels, (size, size, 2)."""
    if camera.intrinsics.distortion is None and np.array_equal(camera.position, target.position):
        fine = Camera(target.pose, target.intrinsics.resized(size, size))  # fifty times as fast
        across = np.arange(size) + 0.5
        x, y, depth = (row[0] * across + (row[1] * across + row[2])[:, None]
                       for row in turn_between(camera, fine))
        depth = np.where(depth > 0, depth, -1e-9)
        return np.stack([x / depth, y / depth], axis=-1)
    rays = Camera(target.pose, target.intrinsics.resized(size, size)).ray_directions()
    pixels, depth = camera.project((target.position + target.distance * rays).reshape(-1, 3))
    pixels[depth <= 0] = -1e9  # nowhere in the image
    return np.nan_to_num(pixels, nan=-1e9).reshape(size, size, 2)


def turn_between(camera: Camera, target: Camera) -> NDArray[np.float64]:
    """Return the homography, (3, 3), from the target's pixels to those of a camera beside it."""
    return np.asarray(camera.intrinsics.matrix @ camera.pose[:3, :3].T @ target.pose[:3, :3]
                      @ np.linalg.inv(target.intrinsics.matrix))


def pixels_within(camera: Camera, target: Camera, size: int) -> NDArray[np.bool_]:
    """Return which of the target's pixels lie in the camera's image, (size, size)."""
    where, lens = _seen(camera, target, size), camera.intrinsics
    return np.asarray(np.all((where >= 0) & (where <= [lens.width, lens.height]), axis=-1))


def _is_whole_image(seen: NDArray[np.float64], camera: Camera, size: int) -> bool:
    """Return whether the target's image is the camera's, resized."""
    column, row = np.meshgrid(*[np.arange(size) + 0.5] * 2)
    lens = camera.intrinsics
    whole = np.stack([column * lens.width, row * lens.height], axis=-1) / size
    return lens.distortion is None and np.allclose(seen, whole, rtol=0, atol=0.01)


def _window(seen: NDArray[np.float64], camera: Camera, size: int) -> tuple[int, int, int, int]:
    """Return left, top, right, bottom of the required part of the camera's image, in pixels."""
    whole = np.array([camera.intrinsics.width, camera.intrinsics.height])
    first, last = seen.min(axis=(0, 1)), seen.max(axis=(0, 1))
    first, last = np.clip(first, 0, whole), np.clip(last, 0, whole)
    margin = (last - first) / size + 1
    left, top = np.maximum(np.floor(first - margin), 0).astype(int)
    right, bottom = np.minimum(np.ceil(last + margin), whole).astype(int)
    return int(left), int(top), int(right), int(bottom)


def _few_pixels(count: int, size: int) -> int:
    return math.ceil(count / max(count // (_FINEST * size), 1))


def _samples(seen: NDArray[np.float64]) -> int:
    """Return the number of samples along each side of a target pixel that avoids aliasing."""
    steps = np.concatenate([np.diff(seen, axis=0).reshape(-1, 2),
                            np.diff(seen, axis=1).reshape(-1, 2)])
    apart = float(np.median(np.linalg.norm(steps, axis=1)))
    return min(max(1, math.ceil(apart / SAMPLE_EVERY)), _MOST_SAMPLES)


def _shrunk(image: NDArray[np.uint8], width: int, height: int) -> NDArray[np.uint8]:
    resized = cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA)
    return np.asarray(resized, np.uint8)
