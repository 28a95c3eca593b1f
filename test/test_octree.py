"""Octrees and the convolution over their cells: the laws of both."""

from active_recon.models.octree import (
    all_cells,
    at,
    children_of,
    EMPTY,
    expand,
    FILLED,
    MIXED,
    states_of,
    tree_of,
)
from active_recon.models.sparse_convolution import neighbours_of, SparseConv3d
import pytest
import torch
from torch import nn
from torch.testing import assert_close


def cells_per_level(states):
    return [len(cells) for cells in tree_of(states)]


def some_voxels(resolution, batch=2):
    torch.manual_seed(0)
    blobs = torch.rand(batch, 1, *(resolution // 4,) * 3)
    return nn.functional.interpolate(blobs, (resolution,) * 3, mode='trilinear')[:, 0] > 0.55


@pytest.mark.parametrize('resolution', [8, 16, 32, 64])
def test_a_grid_pooled_into_an_octree_and_expanded_is_the_same_grid(resolution):
    voxels = some_voxels(resolution)
    states = states_of(voxels)
    levels = [(cells, at(state, cells) == FILLED)
              for cells, state in zip(tree_of(states), states, strict=True)]
    assert expand(levels, 2, resolution).equal(voxels)


def test_a_solid_cube_has_mixed_cells_on_its_border_alone():
    voxels = torch.zeros(1, 32, 32, 32, dtype=torch.bool)
    voxels[:, 6:26, 6:26, 6:26] = True  # cuts through the second cell of 8 a side
    states = states_of(voxels)
    assert cells_per_level(states) == [512, 8 * (6 ** 3 - 4 ** 3), 0]
    voxels[:, 5:27, 5:27, 5:27] = True  # and now through cells of 16 a side
    finer = 14 - 2  # cells a side of the cube that are 16 a side and not mixed
    assert cells_per_level(states_of(voxels))[1:] == [
        8 * (6 ** 3 - 4 ** 3), 8 * (12 ** 3 - (finer - 2) ** 3)]


def test_a_cube_that_fills_whole_cells_needs_none_but_the_coarsest():
    voxels = torch.zeros(1, 64, 64, 64)
    voxels[:, 8:56, 8:56, 8:56] = 1
    assert cells_per_level(states_of(voxels)) == [512, 0, 0, 0]


def test_only_mixed_cells_have_children():
    states = states_of(some_voxels(32))
    for state, cells, finer in zip(states, tree_of(states), tree_of(states)[1:], strict=False):
        parents = torch.cat([finer[:, :1], finer[:, 1:] // 2], dim=1).unique(dim=0)
        assert (at(state, parents) == MIXED).all()
        assert len(parents) == (at(state, cells) == MIXED).sum()


def test_the_finest_cells_are_empty_or_filled():
    assert set(states_of(some_voxels(16))[-1].unique().tolist()) == {EMPTY, FILLED}


def test_children_fill_their_parent_and_nothing_else():
    children = children_of(torch.tensor([[1, 2, 3, 4]]))
    assert children[:, 0].eq(1).all()
    assert sorted(map(tuple, children[:, 1:].tolist())) == [
        (x, y, z) for x in (4, 5) for y in (6, 7) for z in (8, 9)]


def test_all_cells_come_in_the_order_of_a_dense_grid():
    dense = torch.arange(2 * 8 ** 3).reshape(2, 8, 8, 8)
    assert at(dense, all_cells(2, 8)).equal(dense.flatten())


def test_an_octree_without_levels_is_refused():
    with pytest.raises(ValueError, match='levels'):
        expand([], 1, 32)


def some_cells():
    """Return a third of the cells of two grids of 8, in any order."""
    torch.manual_seed(0)
    cells = all_cells(2, 8)
    return cells[torch.randperm(len(cells))[:len(cells) // 3]]


def test_a_neighbour_sees_the_cell_on_the_opposite_side():
    neighbours = neighbours_of(some_cells(), 2, 8)
    count = len(neighbours)
    assert neighbours[:, 13].equal(torch.arange(count, dtype=torch.int32))
    for cell, number in (neighbours < count).nonzero().tolist():
        assert neighbours[neighbours[cell, number], 26 - number] == cell


def test_the_sparse_convolution_is_the_dense_one_with_zeros_between_the_cells():
    cells, features = some_cells(), torch.randn(some_cells().shape[0], 3)
    sparse, dense = SparseConv3d(3, 5), nn.Conv3d(3, 5, 3, padding=1)
    with torch.no_grad():
        dense.weight.copy_(sparse.weight.permute(2, 1, 0).reshape(5, 3, 3, 3, 3))
        dense.bias.copy_(sparse.bias)
    grid = torch.zeros(2, 8, 8, 8, 3)
    grid[cells.unbind(dim=1)] = features
    expected = dense(grid.permute(0, 4, 1, 2, 3)).permute(0, 2, 3, 4, 1)[cells.unbind(dim=1)]
    assert_close(sparse(features, neighbours_of(cells, 2, 8)), expected)


def test_the_sparse_convolution_has_the_gradients_it_ought_to_have():
    cells = some_cells()[:40]
    layer = SparseConv3d(2, 3).double()
    features = torch.randn(40, 2, dtype=torch.double, requires_grad=True)
    neighbours = neighbours_of(cells, 2, 8)
    nn.init.normal_(layer.bias)
    assert torch.autograd.gradcheck(lambda x, weight, bias: torch.func.functional_call(
        layer, {'weight': weight, 'bias': bias}, (x, neighbours)),
        (features, layer.weight, layer.bias))


@pytest.mark.parametrize('kind', [torch.float32, torch.bfloat16])
def test_the_sparse_convolution_keeps_its_precision_under_autocast(kind):
    cells, layer = some_cells(), SparseConv3d(2, 2)
    features = torch.randn(len(cells), 2, dtype=kind, requires_grad=True)
    with torch.autocast('cpu', torch.bfloat16):
        summed = layer(features, neighbours_of(cells, 2, 8))
    summed.float().square().sum().backward()
    assert (summed.dtype, features.grad.dtype) == (kind, kind)
    assert layer.weight.grad.dtype == torch.float32


def test_many_cells_are_gathered_in_parts_and_none_is_lost(monkeypatch):
    cells, layer = some_cells(), SparseConv3d(2, 2)
    neighbours, features = neighbours_of(cells, 2, 8), torch.randn(len(cells), 2)
    whole = torch.autograd.grad(layer(features, neighbours).square().sum(), layer.weight)
    monkeypatch.setattr('active_recon.models.sparse_convolution._ROWS', 50)
    parts = torch.autograd.grad(layer(features, neighbours).square().sum(), layer.weight)
    assert_close(parts, whole)
