"""Warp or crop a camera's image to what a network was trained on, and return its new camera."""

from dataclasses import dataclass
import math

from active_recon.errors import ViewError
from active_recon.geometry.cameras import (
    Camera,
    CANONICAL_DISTANCE,
    CANONICAL_INTRINSICS,
    Intrinsics,
    orbit_camera,
)
from active_recon.geometry.framing import cube_corners, require_in_image
import cv2
import numpy as np
from numpy.typing import NDArray

_FINEST = 2
"""An image at least this many times as fine as needed is downsampled first."""
_MOST_SAMPLES = 3
_SAMPLE_EVERY = 1.5  # pixels: close enough that stripes of a pixel are not skipped
_MARGIN = 1.05  # side of a framed image relative to the cube's extent
_MOST_MISSING = 0.9  # fraction of the cube's silhouette that may be outside of a framed image


@dataclass(frozen=True)
class NetworkSpec:
    """
    The input and output of a network.

    - image_size: S, side of its images in pixels
    - resolution: R, side of its occupancy in cells
    - needs_front: whether it predicts with the object's front at +x and accepts only images of
      the canonical camera; other networks accept any camera
    """

    image_size: int
    resolution: int
    needs_front: bool


def network_image(image: NDArray[np.uint8], camera: Camera, spec: NetworkSpec,
                  object_size: float = 1.0) -> tuple[NDArray[np.uint8], Camera]:
    """
    Return a network's image and its camera, from `canonical_image` or `framed_image`.

    `object_size` is the side of the object's cube, metres. Raises ViewError as they do.
    """
    converted = canonical_image if spec.needs_front else framed_image
    return converted(image, camera, object_size, spec.image_size)


def canonical_image(image: NDArray[np.uint8], camera: Camera, object_size: float = 1.0,
                    image_size: int = 64) -> tuple[NDArray[np.uint8], Camera]:
    """
    Return the view as the canonical camera would see it, (S, S, 3) uint8 RGB, and that camera.

    The virtual camera is upright, in the direction of the real one and at the canonical distance.
    The image is warped as if everything in it were on the plane through the object's centre that
    faces the camera. This is exact for rotation and lens distortion; a change of distance is
    exact on that plane only. Raises ViewError where the image is not (H, W, 3) uint8 of the
    camera's size, or the cube of `object_size` metres is not in it.
    """
    _require_size(image, camera)
    require_in_image(camera, object_size)
    target = orbit_camera(camera.azimuth, camera.elevation, CANONICAL_DISTANCE * object_size,
                          CANONICAL_INTRINSICS.resized(image_size, image_size))
    return _seen_by(target, image, camera), target


def framed_image(image: NDArray[np.uint8], camera: Camera, object_size: float = 1.0,
                 image_size: int = 64) -> tuple[NDArray[np.uint8], Camera]:
    """
    Return the part of the image around the object, (S, S, 3) uint8 RGB, and its pinhole camera.

    The virtual camera is upright at the position of the real one, looks at the object's centre,
    and its focal length makes the cube of `object_size` metres just fill the image. Only
    rotation, zoom and distortion differ, so the result is exact at every depth. If part of it
    lies outside of the original image, the result is (S, S, 4), and its fourth channel is 255 on
    the pixels that were in the image and 0 elsewhere. Raises ViewError as `canonical_image` does,
    but up to 90 % of the cube's silhouette may be outside of the image.
    """
    _require_size(image, camera)
    require_in_image(camera, object_size, _MOST_MISSING)
    target = framing_camera(camera, object_size, image_size)
    framed, seen = _seen_by(target, image, camera), _within(camera, target, image_size)
    if seen.all():
        return framed, target
    framed[~seen] = 0
    return np.dstack([framed, seen * np.uint8(255)]), target


def framed_layers(
    layers: NDArray[np.uint8], camera: Camera, object_size: float = 1.0, image_size: int = 64,
) -> tuple[NDArray[np.uint8], NDArray[np.bool_], Camera]:
    """
    Return channels (H, W, C) uint8 framed as in `framed_image`, the mask of pixels, the camera.

    The mask, (S, S) bool, is true on the pixels that were in the original image; others are 0.
    The cube may be wholly or partly outside of the image.
    """
    target = framing_camera(camera, object_size, image_size)
    lens, size = camera.intrinsics, (image_size, image_size)
    if lens.distortion is None and lens.fx < _SAMPLE_EVERY * target.intrinsics.fx:
        half = np.array([[1, 0, 0.5], [0, 1, 0.5], [0, 0, 1]])  # OpenCV: (0, 0) is a centre
        to_source = np.linalg.inv(half) @ _turn(camera, target) @ half
        whole = np.full(layers.shape[:2], 255, np.uint8)
        carried, there = (cv2.warpPerspective(each, to_source, size,
                                              flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP)
                          for each in (layers, whole))
        return np.asarray(carried, np.uint8), np.asarray(there > 127), target
    return (_seen_by(target, layers, camera, cv2.BORDER_CONSTANT),
            _within(camera, target, image_size), target)


def framing_camera(camera: Camera, object_size: float = 1.0, image_size: int = 64) -> Camera:
    """Return the pinhole camera of `framed_image`, of `image_size` pixels; lengths in metres."""
    pose = np.eye(4)
    pose[:3, 3] = camera.position
    forward = -camera.direction
    right = np.array([forward[1], -forward[0], 0.0])
    if np.linalg.norm(right) < 1e-6:  # straight above, upright is undefined: keep the camera's yaw
        right = camera.pose[:3, 0] - forward * (camera.pose[:3, 0] @ forward)
    pose[:3, 2] = forward
    pose[:3, 0] = right / np.linalg.norm(right)
    pose[:3, 1] = np.cross(forward, pose[:3, 0])
    corners = (cube_corners() * object_size - pose[:3, 3]) @ pose[:3, :3]
    extent = float(np.abs(corners[:, :2] / corners[:, 2:]).max()) * _MARGIN
    focal, middle = image_size / 2 / extent, image_size / 2
    return Camera(pose, Intrinsics(focal, focal, middle, middle, image_size, image_size))


def _require_size(image: NDArray[np.uint8], camera: Camera) -> None:
    lens = camera.intrinsics
    if image.dtype != np.uint8 or image.shape != (lens.height, lens.width, 3):
        raise ViewError(f'wrong image size or type: expected {lens.height} x {lens.width} x 3 '
                        f'uint8, as the camera says, got {image.shape} '
                        f'{image.dtype}', 'image_size')


def _seen_by(target: Camera, image: NDArray[np.uint8], camera: Camera,
             beyond: int = cv2.BORDER_REPLICATE) -> NDArray[np.uint8]:
    """Return a camera's image warped to the target, (S, S, C), via the plane that faces it."""
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


def _seen(camera: Camera, target: Camera, size: int) -> NDArray[np.float64]:
    """Return the camera's pixel coordinates of size x size target pixels, (size, size, 2)."""
    if camera.intrinsics.distortion is None and np.array_equal(camera.position, target.position):
        fine = Camera(target.pose, target.intrinsics.resized(size, size))  # fifty times as fast
        across = np.arange(size) + 0.5
        x, y, depth = (row[0] * across + (row[1] * across + row[2])[:, None]
                       for row in _turn(camera, fine))
        depth = np.where(depth > 0, depth, -1e-9)
        return np.stack([x / depth, y / depth], axis=-1)
    rays = Camera(target.pose, target.intrinsics.resized(size, size)).ray_directions()
    pixels, depth = camera.project((target.position + target.distance * rays).reshape(-1, 3))
    pixels[depth <= 0] = -1e9  # nowhere in the image
    return np.nan_to_num(pixels, nan=-1e9).reshape(size, size, 2)


def _turn(camera: Camera, target: Camera) -> NDArray[np.float64]:
    """Return the homography, (3, 3), from the target's pixels to those of a camera beside it."""
    return np.asarray(camera.intrinsics.matrix @ camera.pose[:3, :3].T @ target.pose[:3, :3]
                      @ np.linalg.inv(target.intrinsics.matrix))


def _within(camera: Camera, target: Camera, size: int) -> NDArray[np.bool_]:
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
    return min(max(1, math.ceil(apart / _SAMPLE_EVERY)), _MOST_SAMPLES)


def _shrunk(image: NDArray[np.uint8], width: int, height: int) -> NDArray[np.uint8]:
    resized = cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA)
    return np.asarray(resized, np.uint8)
