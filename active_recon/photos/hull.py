"""The visual hull: what masks leave of a cube, and whether they agree with each other."""

from collections.abc import Sequence

from active_recon.geometry.cameras import Camera
from active_recon.photos.views import PhotoView
from active_recon.quality.silhouettes import cube_outline, eroded, silhouette
from active_recon.volumes.voxels import cell_centers, places
import cv2
import numpy as np
from numpy.typing import NDArray

TOUCHED = 0.5
"""How far the centre of a cell may lie outside of an object that touches the cell, cells."""
_PIXELS = 64
_NEXT = np.ones((3, 3), np.uint8)


def depth_in_masks(views: Sequence[PhotoView], cameras: Sequence[Camera],
                   side: int) -> NDArray[np.float32]:
    """
    Return how deep cells lie in the masks, (side, side, side), in cells; the least of all views.

    The cells are those of the unit cube about the origin; `cameras` are those of the views, in
    sides of the cube. The depth of a cell in a view is the distance of its projected centre from
    the mask's edge, negative outside of the mask. What no photo with a mask shows is at infinity.
    """
    centres = cell_centers(side)
    least = np.full(len(centres), np.inf, np.float32)
    for view, camera in zip(views, cameras, strict=True):
        if view.mask is None:
            continue
        inside = _distances(view.mask) - _distances(~view.mask)
        pixels, depth = camera.project(centres)
        place = np.nan_to_num(np.floor(pixels), nan=-1)
        seen = ((place >= 0) & (place < view.mask.shape[::-1])).all(axis=1) & (depth > 0)
        across, down = place[seen].astype(np.intp).T
        cells_per_pixel = depth[seen] * side / camera.intrinsics.fx
        least[seen] = np.minimum(least[seen], inside[down, across] * cells_per_pixel)
    return least.reshape(side, side, side)


def hull(depths: NDArray[np.float32]) -> NDArray[np.bool_]:
    """
    Return the cells of the visual hull by their depths in the masks.

    The centre of a cell that the object touches is outside of it by half a cell at most.
    """
    return np.asarray(depths > -TOUCHED)


def ceiling(depths: NDArray[np.float32], threshold: float) -> NDArray[np.float32]:
    """
    Return the highest occupancy, [0, 1], that depths in the masks leave to cells.

    It falls from 1 to 0 within a cell on either side of the hull's surface, where it is the
    threshold: the surface then stands where the masks say, not at the next cell.
    """
    return np.asarray(np.interp(depths + TOUCHED, [-1, 0, 1], [0, threshold, 1]), np.float32)


def _distances(mask: NDArray[np.bool_]) -> NDArray[np.float32]:
    """Return the distance of each pixel of a mask from those that are not in it, pixels."""
    if mask.all():  # nothing is not in it
        return np.full(mask.shape, max(mask.shape), np.float32)
    return np.asarray(cv2.distanceTransform(mask.astype(np.uint8), cv2.DIST_L2, 3), np.float32)


def seen_cells(cameras: Sequence[Camera], side: int) -> NDArray[np.bool_]:
    """
    Return the cells that at least half of the cameras have in their photos, (side, side, side).

    The cells are those of the unit cube about the origin; lengths in sides of the cube.
    """
    centres = cell_centers(side)
    count = np.zeros(len(centres), np.int64)
    for camera in cameras:
        pixels, depth = camera.project(centres)
        lens = camera.intrinsics
        with np.errstate(invalid='ignore'):
            count += ((pixels >= 0) & (pixels < [lens.width, lens.height])).all(axis=1) & (
                depth > 0)
    return (count >= max(min(2, len(cameras)), len(cameras) / 2)).reshape(side, side, side)


def coverage(cells: NDArray[np.bool_], views: Sequence[PhotoView],
             cameras: Sequence[Camera]) -> float:
    """
    Return how much of its mask a hull covers in the worst view, in [0, 1].

    Masks that are right are covered, since the object is in the hull; where poses are wrong or a
    mask lacks a part of the object, the hull lacks what other masks show. 0 where a mask shows
    nothing in the cube. Takes cells (R, R, R) and cameras in sides of their cube. 1 without masks.
    """
    surface = cells & ~eroded(cells)
    points = (places(surface) + 0.5) / len(cells) - 0.5
    worst = 1.0
    for view, camera in zip(views, cameras, strict=True):
        if view.mask is None:
            continue
        lens = camera.intrinsics
        shrink = _PIXELS / max(lens.width, lens.height)
        size = max(1, round(lens.width * shrink)), max(1, round(lens.height * shrink))
        small = Camera(camera.pose, lens.resized(*size))
        shown = cv2.resize(view.mask.astype(np.uint8) * 255, size, interpolation=cv2.INTER_AREA)
        inside = (shown > 127) & cube_outline(small)
        if not inside.any():
            return 0.0
        covered = cv2.dilate(silhouette(points, small).astype(np.uint8), _NEXT) > 0
        worst = min(worst, float((covered & inside).sum() / inside.sum()))
    return worst
