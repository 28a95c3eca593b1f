"""How high an object is: as its masks need it, not as its hull reaches."""

from collections.abc import Sequence

from active_recon.geometry.cameras import Camera
from active_recon.volumes.object_box import object_box
from active_recon.volumes.voxels import places
import cv2
import numpy as np
from numpy.typing import NDArray

_NEXT = np.ones((3, 3), np.uint8)
_COVERED = 127


def explaining_box(cells: NDArray[np.bool_], masks: Sequence[NDArray[np.bool_]],
                   cameras: Sequence[Camera], standing: bool) -> NDArray[np.float64] | None:
    """
    Return the box of the largest part of a hull, as low as explains the masks; whole without any.

    Cameras above an object leave a cone of the hull below it, and another above it, whose rays
    all meet the object, too. Cut off is what no ray of a mask needs: the rest is the object's
    height where it has edges above and below, as most things have that stand somewhere. `standing`
    on a ground that cut the cells, it reaches down to that. Takes cells (R, R, R), masks and
    their cameras in sides of the cube. Returns the least and greatest corner, (2, 3), in sides
    from the cube's centre; None without cells.
    """
    box = object_box(cells)
    if box is None:
        return None
    points = (places(cells) + 0.5) / len(cells) - 0.5
    bottoms, tops = [], []
    for mask, camera in zip(masks, cameras, strict=True):
        least, most = _heights(points, mask, camera, 1 / len(cells))
        if len(most):
            bottoms.append(most.min())
            tops.append(least.max())
    if bottoms and min(bottoms) <= max(tops):
        half = 0.5 / len(cells)
        if not standing:
            box[0, 2] = max(box[0, 2], min(bottoms) - half)
        box[1, 2] = min(box[1, 2], max(tops) + half)
    return box


def _heights(points: NDArray[np.float64], mask: NDArray[np.bool_], camera: Camera,
             cell: float) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return the least and greatest height of points on each ray of a mask that meets any."""
    pixels, depth = camera.project(points)
    shrink = min(1.0, float(np.median(depth)) / (cell * camera.intrinsics.fx))
    height, width = (max(1, round(side * shrink)) for side in mask.shape)  # a pixel for a cell
    inside = cv2.resize(mask.astype(np.uint8) * 255, (width, height),
                        interpolation=cv2.INTER_AREA) > _COVERED
    with np.errstate(invalid='ignore'):
        place = np.floor(pixels * [width / mask.shape[1], height / mask.shape[0]])
        seen = ((place >= 0) & (place < [width, height])).all(axis=1) & (depth > 0)
    across, down = place[seen].astype(np.intp).T
    heights = points[seen, 2].astype(np.float32)
    least = np.full((height, width), np.inf, np.float32)
    most = np.full((height, width), -np.inf, np.float32)
    np.minimum.at(least, (down, across), heights)
    np.maximum.at(most, (down, across), heights)
    # Cells are points here: one between others may have missed a pixel
    least = np.where(np.isfinite(least), least, cv2.erode(least, _NEXT))
    most = np.where(np.isfinite(most), most, cv2.dilate(most, _NEXT))
    met = inside & np.isfinite(most)
    return least[met], most[met]
