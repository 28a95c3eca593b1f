"""What depth images say of each cell: how often it was seen free, at a surface, or behind one."""

from active_recon.geometry.cameras import Camera
from active_recon.volumes.voxels import cell_centers, FINE_RESOLUTION
import numpy as np
from numpy.typing import NDArray

KINDS = ('free', 'near', 'behind')
REACH = 2 / FINE_RESOLUTION
"""Signed distance, in sides of the grid, beyond which a cell is wholly free or wholly behind."""
_NEAREST = 0.05  # sides of the grid in front of the camera

Evidence = NDArray[np.float32]
"""Sums over views for each of KINDS, (3, R, R, R); all 0 before the first."""


def no_evidence(side: int = FINE_RESOLUTION) -> Evidence:
    """Return the evidence of no depth image."""
    return np.zeros((len(KINDS), side, side, side), np.float32)


def depth_evidence(depth: NDArray[np.float32], camera: Camera,
                   side: int = FINE_RESOLUTION) -> Evidence:
    """
    Return the evidence of one depth image, to be added to that of others: order does not count.

    Takes depth (H, W) along the optical axis, in sides of the grid as the camera's position is,
    without a value where it is 0 or not finite, and the camera, of any lens. The signed distance
    of a cell is that from its centre along the ray to what was measured in the pixel that the
    centre projects to, above 0 in front of it. Its `free` share rises from 0 at the surface to 1
    at REACH in front of it, its `behind` share likewise behind it, and `near` is the rest of 1.
    A cell without a value has 0 of all three.
    """
    column, row, beyond = _projected(camera, side)
    height, width = depth.shape
    inside = (beyond > _NEAREST) & (column >= 0) & (column < width) & (row >= 0) & (row < height)
    rows, columns = (np.where(inside, each, 0).astype(np.int32) for each in (row, column))
    place = rows * width + columns
    measured = np.take(depth.astype(np.float32, copy=False).ravel(), place)
    known = inside & (measured > 0) & (measured < np.inf)
    # Along the ray, which is longer than along the optical axis
    slant = _distances(camera, side) / np.maximum(beyond, _NEAREST)
    share = np.clip((measured - beyond) * slant * np.float32(1 / REACH), -1, 1)
    share = np.where(known, share, 0)
    return np.stack([np.maximum(share, 0), known - np.abs(share), np.maximum(-share, 0)])


def _along(side: int) -> NDArray[np.float64]:
    return (np.arange(side) + 0.5) / side - 0.5


def _projected(camera: Camera, side: int) -> tuple[NDArray[np.float32], ...]:
    """Return column, row and depth of the cells' centres, (R, R, R) each; 0 behind the camera."""
    if camera.intrinsics.distortion is not None:
        pixels, depth = camera.project(cell_centers(side))
        shape = (side, side, side)
        return (*(np.nan_to_num(each, nan=-1).reshape(shape).astype(np.float32)
                  for each in pixels.T), depth.reshape(shape).astype(np.float32))
    along = _along(side)
    rows = camera.intrinsics.matrix @ camera.object_to_camera[:3]
    across, down, depth = (
        ((row[0] * along + row[3])[:, None] + row[1] * along).astype(np.float32)[:, :, None]
        + (row[2] * along).astype(np.float32) for row in rows)
    inverse = 1 / np.maximum(depth, np.float32(_NEAREST))
    return across * inverse, down * inverse, depth


def _distances(camera: Camera, side: int) -> NDArray[np.float32]:
    """Return the distance of each cell's centre from the camera, (R, R, R)."""
    x, y, z = ((_along(side) - part) ** 2 for part in camera.position)
    return np.asarray(np.sqrt(
        (x[:, None] + y).astype(np.float32)[:, :, None] + z.astype(np.float32)), np.float32)
