"""Whether a camera has the object in its image: the object's cube, seen through its lens."""

from active_recon.errors import ViewError
from active_recon.geometry.cameras import Camera
import cv2
import numpy as np
from numpy.typing import NDArray

TOLERATED_OUTSIDE = 0.02
"""Share of the cube's silhouette that may be outside: a pose is never exact."""
_ALONG = np.linspace(-0.5, 0.5, 9)  # of an edge: a lens bends it


def require_in_image(camera: Camera, object_size: float,
                     tolerated: float = TOLERATED_OUTSIDE) -> None:
    """
    Raise ViewError where more of the object than is tolerated is out of the camera's image.

    `object_size` is the side of the object's cube, metres; `tolerated` a share of its silhouette.
    """
    _, depth = camera.project(_EDGES * object_size)
    if depth.max() <= 0:
        raise ViewError('camera looks away from the object: expected one that looks at it; check '
                        'the pose, which is that of the optical frame (z forward, y down)',
                        'out_of_image')
    if depth.min() <= 1e-3 * object_size:
        raise ViewError(
            "camera in the object's cube or beside it: expected one outside of the cube of "
            f'{object_size:g} m and in front of it, got one at {camera.distance:.3g} m; move it '
            'back or set object_size', 'out_of_image')
    outside = share_outside(camera, object_size)
    if outside > tolerated:
        raise ViewError(
            f'object out of the image: expected its cube of {object_size:g} m in the image, got '
            f'{100 * outside:.0f} % of it outside; move the camera back, turn it to the object, '
            'or set object_size', 'out_of_image')


def share_outside(camera: Camera, object_size: float) -> float:
    """Return the share of the cube's silhouette, [0, 1], that is not in the image."""
    seen, _ = camera.project(_EDGES * object_size)
    # In units of the image, whose size so does not matter to 32 bits
    silhouette = cv2.convexHull(
        (seen / [camera.intrinsics.width, camera.intrinsics.height]).astype(np.float32))
    image = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32)
    inside, _ = cv2.intersectConvexConvex(silhouette, image)
    return float(np.clip(1 - inside / cv2.contourArea(silhouette), 0, 1))


def cube_corners() -> NDArray[np.float64]:
    """Return the corners of a cube of side 1 about the origin, (8, 3)."""
    ends = (-0.5, 0.5)
    return np.array([[x, y, z] for x in ends for y in ends for z in ends])


def _edges() -> NDArray[np.float64]:
    """Return points on the twelve edges of a cube of side 1 about the origin, (108, 3)."""
    points = [np.insert([first, second], axis, along)
              for axis in range(3) for first in (-0.5, 0.5) for second in (-0.5, 0.5)
              for along in _ALONG]
    return np.array(points, np.float64)


_EDGES = _edges()
