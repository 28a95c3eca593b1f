"""Warp or crop a camera's image to what a network was trained on, and return its new camera."""

from collections.abc import Sequence
from dataclasses import dataclass

from active_recon.errors import ViewError
from active_recon.geometry.cameras import (
    Camera,
    CANONICAL_DISTANCE,
    CANONICAL_INTRINSICS,
    Intrinsics,
    orbit_camera,
)
from active_recon.geometry.framing import cube_corners, require_in_image
from active_recon.geometry.resampling import (
    is_ahead,
    opencv_turn,
    reduction,
    SAMPLE_EVERY,
    seen_by,
    seen_within,
)
import cv2
import numpy as np
from numpy.typing import NDArray

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


def useful_reduction(camera: Camera, spec: NetworkSpec, object_size: float = 1.0,
                     least: int = 0) -> int:
    """
    Return by how much a camera's image may be reduced for a network: 8, 4, 2 or 1.

    `network_image` is then nearly the same: the reduced image still has more than a pixel for
    each of its pixels, and for each of `least` pixels across the object's cube. It is 1 for a
    camera that does not look at the cube.
    """
    size = max(spec.image_size, least)
    _, depth = camera.project(cube_corners() * object_size)
    if depth.min() <= 0:
        return 1
    return reduction((_canonical_camera if spec.needs_front else framing_camera)(
        camera, object_size, size), camera)


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
    require_size(image, camera)
    require_in_image(camera, object_size)
    target = _canonical_camera(camera, object_size, image_size)
    return seen_by(target, image, camera), target


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
    require_size(image, camera)
    require_in_image(camera, object_size, _MOST_MISSING)
    target = framing_camera(camera, object_size, image_size)
    framed, seen = seen_within(target, image, camera)
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
    if lens.distortion is None and is_ahead(target, camera) and (
            lens.fx < SAMPLE_EVERY * target.intrinsics.fx):
        to_source = opencv_turn(camera, target)
        whole = np.full(layers.shape[:2], 255, np.uint8)
        carried, there = (cv2.warpPerspective(each, to_source, size,
                                              flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP)
                          for each in (layers, whole))
        return np.asarray(carried, np.uint8), np.asarray(there > 127), target
    return *seen_within(target, layers, camera, cv2.BORDER_CONSTANT), target


def _canonical_camera(camera: Camera, object_size: float, image_size: int) -> Camera:
    return orbit_camera(camera.azimuth, camera.elevation, CANONICAL_DISTANCE * object_size,
                        CANONICAL_INTRINSICS.resized(image_size, image_size))


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


def require_size(image: NDArray[np.uint8], camera: Camera,
                 channels: Sequence[int] = (3,)) -> None:
    """Raise ViewError unless an image is (H, W, one of `channels`) uint8 of the camera's size."""
    lens = camera.intrinsics
    expected = f'{lens.height} x {lens.width} x {" or ".join(map(str, channels))} uint8'
    if not isinstance(image, np.ndarray):
        raise ViewError(f'wrong image size or type: expected an array, {expected}, got a '
                        f'{type(image).__name__}; np.asarray makes one', 'image_size')
    if image.dtype != np.uint8 or image.shape not in {
            (lens.height, lens.width, number) for number in channels}:
        raise ViewError(f'wrong image size or type: expected {expected}, as the camera says, got '
                        f'{image.shape} {image.dtype}', 'image_size')
