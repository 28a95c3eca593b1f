"""Any camera's image, brought to the canonical camera that the networks were trained with."""

import math

from active_recon.cameras import Camera, CANONICAL_DISTANCE, CANONICAL_INTRINSICS, orbit_camera
from active_recon.errors import ViewError
from active_recon.framing import require_in_image
from active_recon.models.encoder import IMAGE_SIZE
import cv2
import numpy as np
from numpy.typing import NDArray

_FINEST = 2 * IMAGE_SIZE
"""A larger image is shrunk first, until what is shown of it has so many pixels or a few more."""
_MOST_SAMPLES = 3
_SAMPLE_EVERY = 1.5  # pixels: no finer stripe is lost between two of them


def canonical_image(image: NDArray[np.uint8], camera: Camera,
                    object_size: float = 1.0) -> NDArray[np.uint8]:
    """
    Return the view as the canonical camera would see it, (64, 64, 3) uint8 RGB.

    The virtual camera stands in the real one's direction, upright, at the canonical distance. The
    image is carried over as if all that it shows were on the plane through the object's centre
    that faces it: exact for the turn of the camera and the bend of its lens and, for its
    distance, on that plane. Raises ViewError where the image is not (H, W, 3) uint8 of the
    camera's size, or the cube of `object_size` metres is not in it.
    """
    lens = camera.intrinsics
    if image.dtype != np.uint8 or image.shape != (lens.height, lens.width, 3):
        raise ViewError(f'expected an image of {lens.height} x {lens.width} x 3 uint8, as the '
                        f'camera says, got {image.shape} {image.dtype}', 'image_size')
    require_in_image(camera, object_size)
    target = orbit_camera(camera.azimuth, camera.elevation, CANONICAL_DISTANCE * object_size)
    seen = _seen(camera, target, IMAGE_SIZE)
    if _is_whole_image(seen, camera):
        return _shrunk(image, IMAGE_SIZE, IMAGE_SIZE)
    left, top, right, bottom = _window(seen, camera)
    width, height = _few_pixels(right - left), _few_pixels(bottom - top)
    window = _shrunk(image[top:bottom, left:right], width, height)
    scale = np.array([width / (right - left), height / (bottom - top)])
    samples = _samples(seen * scale)
    size = IMAGE_SIZE * samples
    # OpenCV counts from the first pixel's centre, our cameras from its corner
    where = (_seen(camera, target, size) - [left, top]) * scale - 0.5
    where = np.clip(where, -1, [width, height]).astype(np.float32)
    sampled = cv2.remap(window, where[..., 0], where[..., 1], cv2.INTER_LINEAR,
                        borderMode=cv2.BORDER_REPLICATE)
    return _shrunk(np.asarray(sampled, np.uint8), IMAGE_SIZE, IMAGE_SIZE)


def _seen(camera: Camera, target: Camera, size: int) -> NDArray[np.float64]:
    """Return where the camera sees the target's pixels, size x size of them, (size, size, 2)."""
    rays = Camera(target.pose, CANONICAL_INTRINSICS.resized(size, size)).ray_directions()
    pixels, depth = camera.project((target.position + target.distance * rays).reshape(-1, 3))
    pixels[depth <= 0] = -1e9  # nowhere in the image
    return np.nan_to_num(pixels, nan=-1e9).reshape(size, size, 2)


def _is_whole_image(seen: NDArray[np.float64], camera: Camera) -> bool:
    """Return whether the target sees just what the camera does."""
    column, row = np.meshgrid(*[np.arange(IMAGE_SIZE) + 0.5] * 2)
    lens = camera.intrinsics
    whole = np.stack([column * lens.width, row * lens.height], axis=-1) / IMAGE_SIZE
    return lens.distortion is None and np.allclose(seen, whole, rtol=0, atol=0.01)


def _window(seen: NDArray[np.float64], camera: Camera) -> tuple[int, int, int, int]:
    """Return left, top, right, bottom of the pixels that are needed of the camera's image."""
    size = np.array([camera.intrinsics.width, camera.intrinsics.height])
    first, last = seen.min(axis=(0, 1)), seen.max(axis=(0, 1))
    first, last = np.clip(first, 0, size), np.clip(last, 0, size)
    margin = (last - first) / IMAGE_SIZE + 1
    left, top = np.maximum(np.floor(first - margin), 0).astype(int)
    right, bottom = np.minimum(np.ceil(last + margin), size).astype(int)
    return int(left), int(top), int(right), int(bottom)


def _few_pixels(count: int) -> int:
    return math.ceil(count / max(count // _FINEST, 1))


def _samples(seen: NDArray[np.float64]) -> int:
    """Return of how many samples a side, each as wide as two pixels, the target's pixels are."""
    steps = np.concatenate([np.diff(seen, axis=0).reshape(-1, 2),
                            np.diff(seen, axis=1).reshape(-1, 2)])
    apart = float(np.median(np.linalg.norm(steps, axis=1)))
    return min(max(1, math.ceil(apart / _SAMPLE_EVERY)), _MOST_SAMPLES)


def _shrunk(image: NDArray[np.uint8], width: int, height: int) -> NDArray[np.uint8]:
    resized = cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA)
    return np.asarray(resized, np.uint8)
