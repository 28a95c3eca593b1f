"""A voxel grid that keeps its occupied cells alone, for many of them at a time."""

from active_recon.volumes.voxels import VoxelGrid
import numpy as np
from numpy.typing import NDArray


class SparseVoxelGrid(VoxelGrid):
    """
    A grid of which only the cells above 0 are kept, some tenth of its memory in a recording.

    Its `occupancy` is made anew, and to the same bits, each time that it is asked for.
    """

    def __init__(self, grid: VoxelGrid) -> None:
        cells = np.flatnonzero(grid.occupied(0))
        for name, value in (('_side', len(grid.occupancy)), ('_cells', cells.astype(np.uint32)),
                            ('_values', grid.occupancy.ravel()[cells]), ('size', grid.size)):
            object.__setattr__(self, name, value)  # it is frozen, as every grid

    _side: int
    _cells: NDArray[np.uint32]
    _values: NDArray[np.float32]

    @property
    def occupancy(self) -> NDArray[np.float32]:
        """(X, Y, Z) float32 in [0, 1], as of the grid that it was made of."""
        filled = np.zeros(self._side ** 3, np.float32)
        filled[self._cells] = self._values
        return filled.reshape((self._side,) * 3)
