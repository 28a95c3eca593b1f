"""
Octrees of occupancy: cells that are empty, filled, or mixed and so have eight children.

A level holds its cells sparsely: (N, 4) integers, object of the batch, x, y, z, on a grid of
`side` cells. The coarsest level holds all of its cells, every other one the children of the mixed
cells above it. On dense grids a level's states are (B, side, side, side) integers.
"""

from collections.abc import Iterable, Sequence

import torch
from torch import Tensor
from torch.nn import functional

EMPTY, FILLED, MIXED = 0, 1, 2
COARSEST = 8  # cells a side of the coarsest level


def states_of(voxels: Tensor) -> list[Tensor]:
    """
    Return the states of voxels (B, R, R, R) at every level, from 8 cells a side to R, dense.

    R is 8 times a power of two; the voxels are bool or in {0, 1}. At the last level no cell is
    mixed.
    """
    share = voxels[:, None].float()  # of a cell that is filled
    levels = []
    while True:
        state = torch.full_like(share, MIXED, dtype=torch.long)
        state[share == 0] = EMPTY
        state[share == 1] = FILLED
        levels.append(state[:, 0])
        if share.shape[-1] <= COARSEST:
            return levels[::-1]
        share = functional.avg_pool3d(share, 2)


def all_cells(batch: int, side: int, device: torch.device | None = None) -> Tensor:
    """Return every cell of a level, (B side^3, 4), in the order of a dense grid (B, x, y, z)."""
    sides = [torch.arange(count, device=device) for count in (batch, side, side, side)]
    return torch.cartesian_prod(*sides)


def children_of(cells: Tensor) -> Tensor:
    """Return the cells' children one level down, (N, 4) to (8 N, 4), eight of a cell together."""
    corners = torch.cartesian_prod(*(torch.arange(2, device=cells.device),) * 3)
    object_of, places = cells[:, :1], cells[:, 1:]
    finer = 2 * places[:, None] + corners  # (N, 8, 3)
    return torch.cat([object_of[:, None].expand(-1, 8, -1), finer], dim=2).flatten(0, 1)


def at(dense: Tensor, cells: Tensor) -> Tensor:
    """Return what a dense grid (B, side, side, side) holds at cells (N, 4): (N,)."""
    return dense[cells.unbind(dim=1)]


def expand(levels: Iterable[tuple[Tensor, Tensor]], batch: int, resolution: int) -> Tensor:
    """
    Return the dense grid of an octree, (B, R, R, R), given each level's cells and values (N,).

    A voxel has the value of the finest cell that holds it. Levels come from the coarsest on; a
    tree may end before the last.
    """
    grid: Tensor | None = None
    for cells, values in levels:
        grid = (values.new_zeros(batch, *(COARSEST,) * 3) if grid is None
                else _doubled(grid))
        grid[cells.unbind(dim=1)] = values
    if grid is None:
        raise ValueError('octree without levels: expected one or more, got none')
    while grid.shape[-1] < resolution:
        grid = _doubled(grid)
    return grid


def tree_of(states: Sequence[Tensor]) -> list[Tensor]:
    """Return the cells of every level of a tree, (N, 4) each, given its dense states."""
    cells = all_cells(len(states[0]), states[0].shape[-1], states[0].device)
    tree = [cells]
    for state in states[:-1]:
        cells = children_of(cells[at(state, cells) == MIXED])
        tree.append(cells)
    return tree


def _doubled(grid: Tensor) -> Tensor:
    for axis in (1, 2, 3):
        grid = grid.repeat_interleave(2, dim=axis)
    return grid
