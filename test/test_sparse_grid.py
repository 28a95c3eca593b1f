"""A sparse voxel grid is the grid that it was made of, in less memory."""

from active_recon.volumes.sparse_grid import SparseVoxelGrid
from active_recon.volumes.voxels import FINE_RESOLUTION, VoxelGrid
import numpy as np
import pytest


def published(seed, share):
    rng = np.random.default_rng(seed)
    occupancy = rng.random((FINE_RESOLUTION,) * 3).astype(np.float32)
    return VoxelGrid(np.where(rng.random(occupancy.shape) < share, occupancy, np.float32(0)), 0.3)


@pytest.mark.parametrize('share', [0, 0.05, 1])
def test_its_occupancy_is_that_of_the_grid_to_the_bit(share):
    grid = published(0, share)
    sparse = SparseVoxelGrid(grid)
    assert sparse.occupancy.dtype == np.float32
    np.testing.assert_array_equal(sparse.occupancy, grid.occupancy)
    assert (sparse.size, sparse.cell_size) == (grid.size, grid.cell_size)
    np.testing.assert_array_equal(sparse.points(0.5), grid.points(0.5))
    assert sparse.entropy() == grid.entropy()


def test_an_empty_one_becomes_as_fine_as_another():
    empty = SparseVoxelGrid(VoxelGrid(np.zeros((32,) * 3, np.float32)))
    assert empty.as_fine_as(published(0, 0.1)).occupancy.shape == (FINE_RESOLUTION,) * 3


def test_it_keeps_its_occupied_cells_alone():
    kept = sum(value.nbytes for value in vars(SparseVoxelGrid(published(0, 0.05))).values()
               if isinstance(value, np.ndarray))
    assert kept < published(0, 0.05).occupancy.nbytes / 8


def test_who_changes_its_occupancy_changes_a_copy():
    sparse = SparseVoxelGrid(published(0, 0.05))
    sparse.occupancy[:] = 1
    np.testing.assert_array_equal(sparse.occupancy, published(0, 0.05).occupancy)
