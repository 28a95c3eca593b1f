"""The last layer of a dense decoder: one value for each of the eight children of every cell."""

import torch
from torch import nn, Tensor
from torch.nn import functional

# By the child's place along an axis (first or second) and the neighbour of its cell (before,
# itself, after): the tap of a kernel of 4 through which a transposed convolution of stride 2 sees
# that neighbour; 4 is none
_TAPS = torch.tensor([[3, 1, 4], [4, 2, 0]])


def children_in_place(eight: Tensor) -> Tensor:
    """Return the children (B, 8, S, S, S) of cells where they belong, (B, 2 S, 2 S, 2 S)."""
    batch, _, side, *_ = eight.shape
    apart = eight.reshape(batch, 2, 2, 2, side, side, side)
    return apart.permute(0, 4, 1, 5, 2, 6, 3).reshape(batch, *(2 * side,) * 3)


class DoublingConv3d(nn.Module):
    """
    Unpooling and a 3 x 3 x 3 convolution in one, (B, in, S, S, S) to (B, 1, 2 S, 2 S, 2 S).

    A convolution of the coarse grid gives each of a cell's eight children a value: what unpooling
    and a convolution of the fine grid can say, and at an eighth of the memory.
    """

    def __init__(self, in_channels: int) -> None:
        super().__init__()
        self.to_eight = nn.Conv3d(in_channels, 8, 3, padding=1)

    def forward(self, features: Tensor) -> Tensor:
        """Return the children in their places."""
        return children_in_place(self.to_eight(features))[:, None]


class DoublingTransposedConv3d(nn.ConvTranspose3d):
    """
    A transposed convolution of kernel 4 and stride 2, (B, in, S, S, S) to (B, 1, 2 S, 2 S, 2 S).

    In bfloat16 the same sums are taken by a convolution that gives each cell its eight children:
    of transposed ones to a single channel the processor's matrix units make little, and it takes a
    quarter of the time. In float32 it would take three times as long.
    """

    def __init__(self, in_channels: int) -> None:
        super().__init__(in_channels, 1, 4, stride=2, padding=1)

    def forward(self, features: Tensor, output_size: list[int] | None = None) -> Tensor:
        """Return the children in their places."""
        if features.dtype != torch.bfloat16:
            return super().forward(features, output_size)
        assert self.bias is not None
        eight = functional.conv3d(features, self.to_eight(), self.bias.expand(8), padding=1)
        return children_in_place(eight)[:, None]

    def to_eight(self) -> Tensor:
        """Return the kernel of that convolution, (8, in, 3, 3, 3)."""
        x, y, z = (_TAPS.reshape(shape) for shape in (
            (2, 1, 1, 3, 1, 1), (1, 2, 1, 1, 3, 1), (1, 1, 2, 1, 1, 3)))
        padded = functional.pad(self.weight[:, 0], (0, 1) * 3)  # (in, 5, 5, 5)
        kernel = padded[:, x, y, z]  # (in, 2, 2, 2, 3, 3, 3)
        return kernel.flatten(1, 3).transpose(0, 1)
