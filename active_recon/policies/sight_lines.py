"""Which cells of a grid the lines of sight of cameras cross, one after the other."""

from dataclasses import dataclass
from functools import lru_cache
import math

from active_recon.volumes.voxels import cell_centers
import numpy as np
from numpy.typing import NDArray

_RADIUS = math.sqrt(3) / 2  # of the sphere around the unit cube
_WIDEST = 2.0  # tangent of half the field of view of a camera that stands near the cube
_SHORTEST = 1e-6  # sides of the grid: a line that only touches a cell does not cross it


@dataclass(frozen=True, eq=False)
class SightLines:
    """
    L lines of sight through the unit cube about the origin, cut into S x S x S cells.

    - cells: (C, L) int32, the cells that each line crosses, nearest first, by their places in the
      flat grid; S ** 3 where a line crosses no more
    - entries: (C, L) float32, how far from the camera the line enters the cell, sides of the grid
    """

    cells: NDArray[np.int32]
    entries: NDArray[np.float32]


def image_lines(poses: NDArray[np.float64], side: int, rays: int) -> SightLines:
    """
    Return the lines through images of cameras, (K, 4, 4), with rays x rays pixels each.

    Lengths count in sides of the grid. An image is centred on the grid's centre, upright as the
    camera is, and just as wide as the sphere around the cube; beside the cube (nearer than 0.97
    sides to its centre) it is narrower than that. The lines are ordered [camera, row, column].
    What is asked for again is not computed again.
    """
    return _image_lines(np.ascontiguousarray(poses, np.float64).tobytes(), side, rays)


def cell_lines(pose: NDArray[np.float64], side: int) -> NDArray[np.unsignedinteger]:
    """
    Return the cells of the lines from a camera, (4, 4), to all cells' centres, in flat order.

    They are as in SightLines, (C, side ** 3). A line ends before the cell that it leads to: it
    crosses what may hide it.
    """
    return _cell_lines(np.ascontiguousarray(pose[:3, 3], np.float64).tobytes(), side)


@lru_cache(maxsize=8)
def _image_lines(poses: bytes, side: int, rays: int) -> SightLines:
    cameras = np.frombuffer(poses).reshape(-1, 4, 4)
    origins = cameras[:, :3, 3]
    distance = np.linalg.norm(origins, axis=1, keepdims=True)
    forward = -origins / distance
    right = cameras[:, :3, 0] - (cameras[:, :3, 0] * forward).sum(1, keepdims=True) * forward
    right /= np.linalg.norm(right, axis=1, keepdims=True)
    down = np.cross(forward, right)
    widest = np.sqrt(np.maximum(distance ** 2 - _RADIUS ** 2, (_RADIUS / _WIDEST) ** 2))
    across = (np.arange(rays) + 0.5) / rays * 2 - 1
    spread = (across * _RADIUS / widest)[..., None]  # (K, rays, 1)
    towards = (forward[:, None, None] + spread[:, None] * right[:, None, None]
               + spread[:, :, None] * down[:, None, None])
    return _crossed(np.broadcast_to(origins[:, None, None], towards.shape).reshape(-1, 3),
                    towards.reshape(-1, 3), side)


@lru_cache(maxsize=64)  # of 0.3 MB each, where places among the cells fit in 16 bits
def _cell_lines(position: bytes, side: int) -> NDArray[np.unsignedinteger]:
    centers = cell_centers(side)
    origin = np.frombuffer(position)
    cells = _crossed(np.broadcast_to(origin, centers.shape), centers - origin, side).cells
    own = np.logical_or.accumulate(cells == np.arange(side ** 3), axis=0)
    return np.where(own, side ** 3, cells).astype(np.min_scalar_type(side ** 3))


def _crossed(origins: NDArray[np.float64], towards: NDArray[np.float64],
             side: int) -> SightLines:
    """Return the cells that lines from origins (L, 3) in directions (L, 3) cross."""
    towards = towards / np.linalg.norm(towards, axis=1, keepdims=True)
    towards = np.where(np.abs(towards) < 1e-12, 1e-12, towards)
    planes = np.arange(side + 1) / side - 0.5
    at = (planes - origins[:, :, None]) / towards[:, :, None]  # (L, 3, side + 1)
    first, last = at[:, :, 0], at[:, :, -1]
    enter = np.minimum(first, last).max(axis=1).clip(min=0)
    leave = np.maximum(np.maximum(first, last).min(axis=1), enter)
    cuts = np.sort(at.reshape(len(at), -1).clip(enter[:, None], leave[:, None]), axis=1)
    crossed = np.diff(cuts, axis=1) > _SHORTEST
    middle = (cuts[:, 1:] + cuts[:, :-1]) / 2
    cells = np.zeros(middle.shape, np.int32)
    for axis in range(3):
        where = middle * towards[:, axis, None]
        where += origins[:, axis, None]
        where += 0.5
        where *= side
        cells *= side
        cells += where.clip(0, side - 1, out=where).astype(np.int32)
    cells[~crossed] = side ** 3
    order = np.argsort(~crossed, axis=1, kind='stable')[:, :max(int(crossed.sum(1).max()), 1)]
    lines = SightLines(
        np.ascontiguousarray(np.take_along_axis(cells, order, axis=1).T, np.int32),
        np.ascontiguousarray(np.take_along_axis(cuts[:, :-1], order, axis=1).T, np.float32))
    lines.cells.setflags(write=False)
    lines.entries.setflags(write=False)
    return lines
