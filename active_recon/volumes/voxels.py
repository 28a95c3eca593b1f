"""The voxel grid: a cube of occupancy probabilities, its measures, and its mesh."""

from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, TYPE_CHECKING

from active_recon.errors import DataError
import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import trimesh

RESOLUTION = 32
FINE_RESOLUTION = 64
PUBLISHED_FLOOR = 0.02
"""Cells up to this occupancy are left out of the published probabilities and their entropy."""


def iou(predicted: Any, truth: Any, axes: tuple[int, ...] = (-3, -2, -1)) -> Any:
    """
    Return intersection over union of two boolean arrays or tensors of one shape, in [0, 1].

    The measure of the paper's section 3.3, over the last three axes (voxels) or those given
    (silhouettes: the last two); the other axes stay. The IoU of two empty shapes is 1.
    """
    intersection, union = _count(predicted & truth, axes), _count(predicted | truth, axes)
    empty = union == 0
    return (intersection + empty) / (union + empty)


def entropy(occupancy: Any) -> Any:
    """
    Return the entropy in nats, -sum(p log p + (1 - p) log(1 - p)), of occupancies in [0, 1].

    Arrays or tensors, (..., X, Y, Z) to (...).
    """
    return paper_entropy(occupancy) + paper_entropy(1 - occupancy)


def paper_entropy(occupancy: Any) -> Any:
    """Return -sum(p log p) in nats, the paper's section 4.6: `entropy` without its second term."""
    if isinstance(occupancy, np.ndarray):
        logs = np.log(occupancy, out=np.zeros_like(occupancy), where=occupancy != 0)
        return -(occupancy * logs).sum((-3, -2, -1))
    return -occupancy.xlogy(occupancy).sum((-3, -2, -1))


def _count(cells: Any, axes: tuple[int, ...]) -> Any:
    if isinstance(cells, np.ndarray):
        return cells.sum(axes)
    return cells.float().sum(axes)  # torch is ten times slower at booleans; exact up to 256^3


@dataclass(frozen=True, eq=False)
class VoxelGrid:
    """
    A cube of voxels in the object frame, centred at its origin.

    `occupancy` is (X, Y, Z) float32 in [0, 1], indexed [x, y, z]; `size` is the cube's side in
    metres. Raises DataError where the shape is not a cube or the size not finite and above 0.
    """

    occupancy: NDArray[np.float32] = field(repr=False)
    size: float = 1.0

    def __post_init__(self) -> None:
        """Reject other shapes and sizes."""
        shape = self.occupancy.shape
        if len(shape) != 3 or len(set(shape)) != 1:
            raise DataError('not a cube: expected as many voxels along every axis, got the shape '
                            f'{shape}')
        if not 0 < self.size < np.inf:
            raise DataError('invalid size: expected a finite side of the cube above 0 m, got '
                            f'{self.size}')

    @property
    def cell_size(self) -> float:
        """Side of one cell, metres."""
        return float(self.size / self.occupancy.shape[0])

    def occupied(self, threshold: float) -> NDArray[np.bool_]:
        """Return which cells are above the threshold, (X, Y, Z)."""
        above: NDArray[np.bool_] = self.occupancy > float(threshold)  # compared in float32
        return above

    def above(self, threshold: float) -> 'VoxelGrid':
        """Return the grid with all cells up to the threshold set to 0, as in its point cloud."""
        occupancy = np.where(self.occupied(threshold), self.occupancy, np.float32(0))
        return VoxelGrid(np.ascontiguousarray(occupancy), self.size)

    def as_fine_as(self, other: 'VoxelGrid') -> 'VoxelGrid':
        """Return this grid; if it has no cell above 0, an empty one at the other's resolution."""
        return self if self.occupancy.any() else VoxelGrid(
            np.zeros_like(other.occupancy), self.size)

    def entropy(self) -> float:
        """
        Return the entropy in nats, -sum(p log p + (1 - p) log(1 - p)), of the published cells.

        Those are the cells above PUBLISHED_FLOOR, so a grid and its point cloud have exactly the
        same entropy.
        """
        cells = self.occupancy[self.occupied(PUBLISHED_FLOOR)].astype(np.float64)
        return float(entropy(cells[None, None]))

    def points(self, threshold: float) -> NDArray[np.float32]:
        """Return x, y, z (metres) and occupancy of the cells above the threshold, (N, 4)."""
        cells = np.flatnonzero(self.occupied(threshold))
        points = _empty_points(len(self.occupancy), self.size).take(cells, axis=0)
        points[:, 3] = self.occupancy.ravel().take(cells)
        return points

    def mesh(self, threshold: float) -> 'trimesh.Trimesh':
        """
        Return the surface at the threshold, in metres; see `isosurface`.

        Raises DataError where no cell is above the threshold.
        """
        from active_recon.volumes.isosurface import isosurface

        if not self.occupied(threshold).any():
            raise DataError(f'no cell is above the threshold {threshold}: there is no surface yet')
        return isosurface(self.occupancy, float(threshold), self.size)  # as in `occupied`


def cell_centers(side: int) -> NDArray[np.float64]:
    """Return the centres of all cells of a grid, (S ** 3, 3) of a unit cube, in flat order."""
    along = (np.arange(side) + 0.5) / side - 0.5
    return np.stack(np.meshgrid(along, along, along, indexing='ij'), -1).reshape(-1, 3)


@lru_cache(maxsize=2)  # a grid and its finer one, 4 MB for 64 cells a side
def _empty_points(side: int, size: float) -> NDArray[np.float32]:
    """
    Return x, y, z (metres) and 0 of the cells of a cube, (side ** 3, 4), in their order in memory.

    Whole rows are taken from it, in a sixth of the time of three of their four columns.
    """
    along = ((np.arange(side) + 0.5) * (size / side) - size / 2).astype(np.float32)
    points = np.stack(np.meshgrid(along, along, along, np.float32(0), indexing='ij'), axis=-1)
    return points.reshape(-1, 4)


def places(cells: NDArray[np.bool_]) -> NDArray[np.intp]:
    """
    Return the indices of the true cells of (X, Y, Z), (N, 3), in their order in memory.

    It is numpy's `argwhere`, in a fifth of its time.
    """
    return np.stack(np.unravel_index(np.flatnonzero(cells), cells.shape)).T


def turned(occupancy: NDArray[np.float32], yaw: float) -> NDArray[np.float32]:
    """
    Return occupancies (X, Y, Z) rotated counter-clockwise about +z by a yaw in radians.

    Cells are interpolated linearly; cells rotated out of the cube are lost. A yaw of 0 is exact.
    """
    if yaw == 0:
        return occupancy
    from scipy.ndimage import affine_transform

    cosine, sine = np.cos(yaw), np.sin(yaw)
    to_source = np.array([[cosine, sine, 0], [-sine, cosine, 0], [0, 0, 1]])
    center = (np.array(occupancy.shape) - 1) / 2
    result: NDArray[np.float32] = affine_transform(
        occupancy, to_source, center - to_source @ center, order=1, mode='grid-constant')
    return result
