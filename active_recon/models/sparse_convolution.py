"""A 3 x 3 x 3 convolution over the cells that are there, and over no others."""

from collections.abc import Iterator
from typing import Any

import torch
from torch import nn, Tensor
from torch.autograd.function import once_differentiable

_KERNEL = 27
_ROWS = 1 << 13  # gathered at a time: 27 times the features, which then stay in the cache


def neighbours_of(cells: Tensor, batch: int, side: int) -> Tensor:
    """
    Return the row of every cell's neighbours, (N, 27) int32; N where there is none.

    Cells are (N, 4) integers, object and place, on grids of `side` cells; the cell itself is
    number 13, and neighbour 26 - k lies opposite to neighbour k.
    """
    count, padded = len(cells), side + 2  # a margin of no cells spares the border a case
    rows = torch.arange(count, dtype=torch.int32, device=cells.device)
    table = rows.new_full((batch * padded ** 3,), count)
    places = cells[:, 0]
    for axis in (1, 2, 3):
        places = places * padded + cells[:, axis] + 1
    table[places] = rows
    step = torch.arange(-1, 2, device=cells.device)
    steps = ((step[:, None, None] * padded + step[:, None]) * padded + step).flatten()
    return table[places[:, None] + steps]


class SparseConv3d(nn.Module):
    """
    What `nn.Conv3d` of kernel 3 does with zeros wherever there is no cell.

    Features (N, in) and the neighbours of their cells (N, 27) to (N, out).
    """

    def __init__(self, in_channels: int, out_channels: int) -> None:
        super().__init__()
        bound = (_KERNEL * in_channels) ** -0.5
        self.weight = nn.Parameter(
            torch.empty(_KERNEL, in_channels, out_channels).uniform_(-bound, bound))
        self.bias = nn.Parameter(torch.zeros(out_channels))

    def forward(self, features: Tensor, neighbours: Tensor) -> Tensor:
        """Return the sums over each cell's neighbours."""
        kind = features.dtype
        # Autocast is off while gradients are taken: on, it would leave two precisions to multiply
        with torch.autocast(features.device.type, enabled=False):
            summed: Tensor = _GatherAndMultiply.apply(
                features, self.weight.to(kind), neighbours)  # type: ignore[no-untyped-call]
            return summed + self.bias.to(kind)


class _GatherAndMultiply(torch.autograd.Function):
    """
    Gathers each neighbour's features and multiplies them by its weight.

    A cell is its neighbour's opposite neighbour, so the gradient of the features is again a
    gathering, by opposite weights: no row is ever scattered, and nothing gathered is kept.
    """

    @staticmethod
    def forward(ctx: Any, features: Tensor, weight: Tensor, neighbours: Tensor) -> Tensor:
        ctx.save_for_backward(features, weight, neighbours)
        return _multiplied(features, neighbours, weight)

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, gradient: Tensor) -> tuple[Tensor, Tensor, None]:
        features, weight, neighbours = ctx.saved_tensors
        to_features = _multiplied(gradient, neighbours, weight.flip(0).transpose(1, 2))
        to_weight = torch.zeros_like(weight).flatten(0, 1)
        for gathered, part in zip(_gathered(features, neighbours), torch.split(gradient, _ROWS),
                                  strict=True):
            to_weight += gathered.T @ part
        return to_features, to_weight.reshape(weight.shape), None


def _multiplied(features: Tensor, neighbours: Tensor, weight: Tensor) -> Tensor:
    matrix = weight.flatten(0, 1)
    return torch.cat([gathered @ matrix for gathered in _gathered(features, neighbours)])


def _gathered(features: Tensor, neighbours: Tensor) -> Iterator[Tensor]:
    """Yield all neighbours' features side by side, (rows, 27 C); zeros where there is none."""
    padded = torch.cat([features, features.new_zeros(1, features.shape[1])])
    for rows in torch.split(neighbours, _ROWS):
        yield padded.index_select(0, rows.flatten()).reshape(len(rows), -1)
