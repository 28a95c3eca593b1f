"""Any camera's image, brought to the canonical camera that the networks were trained with."""

import math

from active_recon.cameras import Camera, CANONICAL_DISTANCE, CANONICAL_INTRINSICS, orbit_camera
from active_recon.errors import ViewError
from active_recon.models.encoder import IMAGE_SIZE
import cv2
import numpy as np
from numpy.typing import NDArray


def canonical_image(image: NDArray[np.uint8], camera: Camera,
                    object_size: float = 1.0) -> NDArray[np.uint8]:
    """
    Return the view as the canonical camera would see it, (64, 64, 3) uint8 RGB.

    The virtual camera stands in the real one's direction, upright, at the canonical distance. The
    image is carried over by the homography of the plane through the object's centre that faces
    it, exact for the turn of the camera and, for its distance, on that plane. Raises ViewError
    where the image is not (H, W, 3) uint8 of the camera's size.
    """
    lens = camera.intrinsics
    if image.dtype != np.uint8 or image.shape != (lens.height, lens.width, 3):
        raise ViewError(f'expected an image of {lens.height} x {lens.width} x 3 uint8, as the '
                        f'camera says, got {image.shape} {image.dtype}', 'image_size')
    target = orbit_camera(camera.azimuth, camera.elevation, CANONICAL_DISTANCE * object_size)
    reach = object_size / 2
    square = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * reach
    plane = square[:, :1] * target.pose[:3, 0] + square[:, 1:] * target.pose[:3, 1]
    seen, depth = camera.project(plane)
    if depth.min() <= 0:
        raise ViewError('expected a camera that looks at the object; it looks away from it',
                        'camera_direction')
    # Pixels of the source per pixel of the result: so many samples are averaged, though never
    # more than the whole image has, however near the camera stands
    density = np.linalg.norm(seen[1] - seen[0]) / np.linalg.norm(
        np.diff(target.project(plane[:2])[0], axis=0)) * CANONICAL_INTRINSICS.width / IMAGE_SIZE
    most = math.ceil(max(lens.width, lens.height) / IMAGE_SIZE)
    samples = min(max(1, math.ceil(density)), most)
    size = IMAGE_SIZE * samples
    wanted = Camera(target.pose, CANONICAL_INTRINSICS.resized(size, size)).project(plane)[0]
    if np.allclose(wanted * [lens.width / size, lens.height / size], seen, atol=0.01):
        resized = cv2.resize(image, (IMAGE_SIZE, IMAGE_SIZE), interpolation=cv2.INTER_AREA)
        return np.asarray(resized, np.uint8)
    # OpenCV counts from the first pixel's centre, our cameras from its corner
    homography = cv2.getPerspectiveTransform(
        (seen - 0.5).astype(np.float32), (wanted - 0.5).astype(np.float32))
    warped = cv2.warpPerspective(image, homography, (size, size), borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(cv2.resize(warped, (IMAGE_SIZE, IMAGE_SIZE),
                                 interpolation=cv2.INTER_AREA), np.uint8)
