"""Checks that the object's cube is in a camera's image, with the lens's distortion."""

from active_recon.errors import ViewError
from active_recon.geometry.cameras import Camera
import cv2
import numpy as np
from numpy.typing import NDArray

TOLERATED_OUTSIDE = 0.02
"""Fraction of the cube's silhouette that may be outside of the image, since poses are inexact."""
_FEWEST_PIXELS = 4
"""Width of the cube's silhouette below which an image shows nothing of the object."""
_NEAREST = 0.05
"""Sides of the cube that a camera has to be in front of its nearest corner, to see it framed."""
_SIDE = "the cube's side (object_size; of photos --box)"
_ALONG = np.linspace(-0.5, 0.5, 9)  # points along an edge, which a lens distorts


def require_in_image(camera: Camera, object_size: float,
                     tolerated: float = TOLERATED_OUTSIDE) -> None:
    """
    Raise ViewError where the object is not in front of the camera or not to be seen in its image.

    `object_size` is the side of the object's cube, metres; `tolerated` is the fraction of the
    cube's silhouette, [0, 1], that may be outside.
    """
    seen, depth = camera.project(_EDGES * object_size)
    at_plane = 1e-3 * object_size
    if depth.max() <= 0 or depth.min() <= at_plane and camera.distance > object_size:
        raise ViewError('camera looks away from the object: expected one that looks at it; check '
                        'that the pose is that of the optical frame (z forward, y down)',
                        'out_of_image')
    # Networks get the image of a camera that is aimed at the cube's centre, where the object is
    # too small if a corner is nearly at the camera
    aimed = 0.0 if camera.distance == 0 else (
        camera.distance - float((_EDGES @ camera.direction).max()) * object_size)
    if depth.min() <= at_plane or aimed < _NEAREST * object_size:
        raise ViewError(
            "camera in the object's cube or beside it: expected a distance at which the whole "
            f'cube of {object_size:g} m is in front of the camera, got {camera.distance:.3g} m; '
            f'move it back, or set {_SIDE}', 'out_of_image')
    width = float(np.ptp(seen, axis=0).max())
    if width < _FEWEST_PIXELS:
        raise ViewError(
            f'object too small in the image: expected its cube of {object_size:g} m to be '
            f'{_FEWEST_PIXELS} pixels wide or more, got {width:.2g} at a distance of '
            f'{camera.distance:.3g} m; move the camera nearer, or give poses in metres',
            'out_of_image')
    outside = share_outside(camera, object_size)
    if outside > tolerated:
        raise ViewError(
            f'object out of the image: expected its cube of {object_size:g} m in the image, got '
            f'{100 * outside:.0f} % of it outside; move the camera back, turn it to the object, '
            f'or set {_SIDE}', 'out_of_image')


def share_outside(camera: Camera, object_size: float) -> float:
    """
    Return the fraction of the cube's silhouette, [0, 1], that is outside of the image.

    `object_size` is the side of the cube, metres, which has to be in front of the camera. A cube
    that is too far away to cover anything of an image counts as outside.
    """
    seen, _ = camera.project(_EDGES * object_size)
    # In units of the image's sides, because float32 is too coarse for large images in pixels
    silhouette = cv2.convexHull(
        (seen / [camera.intrinsics.width, camera.intrinsics.height]).astype(np.float32))
    whole = cv2.contourArea(silhouette)
    if whole == 0:  # so far away that it is a single point
        return 1.0
    inside = cv2.contourArea(
        _in_unit_square(silhouette[:, 0].astype(np.float64)).astype(np.float32))
    return float(np.clip(1 - inside / whole, 0, 1))


def _in_unit_square(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """
    Return the part of a convex polygon, corners (N, 2), that is in the unit square, (M, 2).

    It is clipped at one side after the other (Sutherland and Hodgman, Reentrant polygon clipping,
    1974); of some polygons outside OpenCV's intersectConvexConvex says that they are inside.
    """
    for axis, end, inwards in ((0, 0, 1), (0, 1, -1), (1, 0, 1), (1, 1, -1)):
        within = inwards * (corners[:, axis] - end)
        before, within_before = np.roll(corners, 1, axis=0), np.roll(within, 1)
        crosses = (within >= 0) != (within_before >= 0)
        share = within_before / np.where(crosses, within_before - within, 1)
        cuts = before + share[:, None] * (corners - before)
        corners = np.stack([cuts, corners], 1)[np.stack([crosses, within >= 0], 1)]
    return corners


def cube_corners() -> NDArray[np.float64]:
    """Return the corners of the unit cube around the origin, (8, 3)."""
    ends = (-0.5, 0.5)
    return np.array([[x, y, z] for x in ends for y in ends for z in ends])


def _edges() -> NDArray[np.float64]:
    """Return points on the twelve edges of the unit cube around the origin, (108, 3)."""
    points = [np.insert([first, second], axis, along)
              for axis in range(3) for first in (-0.5, 0.5) for second in (-0.5, 0.5)
              for along in _ALONG]
    return np.array(points, np.float64)


_EDGES = _edges()
