"""Last layers of dense decoders: 3-D sub-pixel convolutions, which double the grid (ESPCN)."""

import torch
from torch import nn, Tensor
from torch.nn import functional

# For each child along an axis (first, second) and each neighbour of its cell (before, itself,
# after): the tap by which a transposed convolution of kernel 4 and stride 2 reads that neighbour;
# 4 is none
_TAPS = torch.tensor([[3, 1, 4], [4, 2, 0]])


def pixel_shuffle_3d(children: Tensor) -> Tensor:
    """Rearrange the 8 children of each cell, (B, 8, S, S, S), to a grid (B, 2 S, 2 S, 2 S)."""
    batch, _, side, *_ = children.shape
    split = children.reshape(batch, 2, 2, 2, side, side, side)
    return split.permute(0, 4, 1, 5, 2, 6, 3).reshape(batch, *(2 * side,) * 3)


class SubpixelConv3d(nn.Module):
    """
    Upsampling and a 3 x 3 x 3 convolution in one, (B, in, S, S, S) to (B, 1, 2 S, 2 S, 2 S).

    A convolution of the coarse grid gives one value to each of a cell's eight children. It can
    represent every upsampling followed by a convolution of the fine grid, in an eighth of the
    memory.
    """

    def __init__(self, in_channels: int) -> None:
        super().__init__()
        self.to_eight = nn.Conv3d(in_channels, 8, 3, padding=1)

    def forward(self, features: Tensor) -> Tensor:
        """Return values of the fine grid."""
        return pixel_shuffle_3d(self.to_eight(features))[:, None]


class SubpixelTransposedConv3d(nn.ConvTranspose3d):
    """
    A transposed convolution of kernel 4 and stride 2, (B, in, S, S, S) to (B, 1, 2 S, 2 S, 2 S).

    In bfloat16 it is computed as a sub-pixel convolution with the same sums: that takes a quarter
    of the time, because the processor's matrix units are hardly used by a transposed convolution
    to one channel. In float32 it would take three times as long.
    """

    def __init__(self, in_channels: int) -> None:
        super().__init__(in_channels, 1, 4, stride=2, padding=1)

    def forward(self, features: Tensor, output_size: list[int] | None = None) -> Tensor:
        """Return values of the fine grid."""
        if features.dtype != torch.bfloat16:
            return super().forward(features, output_size)
        assert self.bias is not None
        children = functional.conv3d(features, self.to_eight(), self.bias.expand(8), padding=1)
        return pixel_shuffle_3d(children)[:, None]

    def to_eight(self) -> Tensor:
        """Return the kernel of that convolution, (8, in, 3, 3, 3)."""
        x, y, z = (_TAPS.reshape(shape) for shape in (
            (2, 1, 1, 3, 1, 1), (1, 2, 1, 1, 3, 1), (1, 1, 2, 1, 1, 3)))
        padded = functional.pad(self.weight[:, 0], (0, 1) * 3)  # (in, 5, 5, 5)
        kernel = padded[:, x, y, z]  # (in, 2, 2, 2, 3, 3, 3)
        return kernel.flatten(1, 3).transpose(0, 1)
