"""A U-Net at 16, 8 and 4 cells a side, and the layers on cells that it is made of."""

from active_recon.models.encoder import group_norm
import torch
from torch import nn, Tensor
from torch.nn import functional


def is_traced() -> bool:
    """Return whether this is an export, whose graph keeps to what ONNX has."""
    return bool(torch.jit.is_tracing())  # type: ignore[attr-defined, no-untyped-call]


class Conv3d(nn.Conv3d):
    """
    3 x 3 x 3 convolution that uses oneDNN for a single small volume too.

    There torch would use its plain loop in float32, which takes ten times as long at 16 cells.
    """

    def __init__(self, channels: int) -> None:
        super().__init__(channels, channels, 3, padding=1)

    def forward(self, cells: Tensor) -> Tensor:
        """Return cells of the same shape."""
        if (torch.is_grad_enabled() or torch.compiler.is_compiling()
                or is_traced() or cells.device.type != 'cpu'
                or cells.dtype != torch.float32 or torch.is_autocast_enabled('cpu')):
            return super().forward(cells)
        found: Tensor = torch.mkldnn_convolution(
            cells, self.weight, self.bias, (1, 1, 1), (1, 1, 1), (1, 1, 1), 1)
        return found


class Residual3d(nn.Module):
    """3 x 3 x 3 convolutions beside the identity."""

    def __init__(self, channels: int, depth: int) -> None:
        super().__init__()
        layers: list[nn.Module] = []
        for number in range(depth):
            layers += [Conv3d(channels), group_norm(channels)]
            layers += [nn.ReLU()] if number + 1 < depth else []
        self.layers = nn.Sequential(*layers)

    def forward(self, cells: Tensor) -> Tensor:
        """Return cells of the same shape."""
        return functional.relu(cells + self.layers(cells))


def space_to_depth(cells: Tensor) -> Tensor:
    """Move blocks of 2 x 2 x 2 cells to channels: (B, C, 2n, 2n, 2n) to (B, 8 C, n, n, n)."""
    batch, channels, side = cells.shape[:3]
    n = side // 2
    split = cells.reshape(batch, channels, n, 2, n, 2, n, 2)
    return split.permute(0, 1, 3, 5, 7, 2, 4, 6).reshape(batch, 8 * channels, n, n, n)


def depth_to_space(cells: Tensor) -> Tensor:
    """Move channels to blocks of 2 x 2 x 2 cells: (B, 8 C, n, n, n) to (B, C, 2n, 2n, 2n)."""
    batch, channels, n = cells.shape[:3]
    split = cells.reshape(batch, channels // 8, 2, 2, 2, n, n, n)
    return split.permute(0, 1, 5, 2, 6, 3, 7, 4).reshape(
        batch, channels // 8, 2 * n, 2 * n, 2 * n)


def finer(layer: nn.Conv3d, cells: Tensor) -> Tensor:
    """
    Return `depth_to_space` of a 1 x 1 x 1 convolution of cells.

    In a graph it is the transposed convolution with the same products, which moves nothing.
    """
    if not is_traced():
        return depth_to_space(layer(cells))
    channels, side = layer.out_channels // 8, cells.shape[2]
    kernel = layer.weight.reshape(channels, 2, 2, 2, -1).permute(4, 0, 1, 2, 3)
    assert layer.bias is not None
    bias = layer.bias.reshape(1, channels, 2, 2, 2).repeat(1, 1, side, side, side)
    return functional.conv_transpose3d(cells, kernel, stride=2) + bias


class VolumeUnet(nn.Module):
    """
    What networks have in common that work with a U-Net at 16, 8 and 4 cells a side.

    Its layers are the network's own, named as here, so that weights need no level more.
    """

    def add_unet(self, channels: tuple[int, int, int],
                 depths: tuple[int, int, int, int, int]) -> None:
        """
        Add the layers, where `__init__` wants them in the order of the parameters.

        `channels` are those at 16, 8 and 4 cells; `depths` are the numbers of convolutions down
        at 16 and 8 cells, at 4, and up at 8 and 16.
        """
        at_16, at_8, at_4 = channels
        self.down_16 = Residual3d(at_16, depths[0])
        self.to_8 = _coarser(at_16, at_8)
        self.down_8 = Residual3d(at_8, depths[1])
        self.to_4 = _coarser(at_8, at_4)
        self.at_4 = Residual3d(at_4, depths[2])
        self.from_4, self.up_8 = nn.Conv3d(at_4, 8 * at_8, 1), Residual3d(at_8, depths[3])
        self.from_8, self.up_16 = nn.Conv3d(at_8, 8 * at_16, 1), Residual3d(at_16, depths[4])

    def unet(self, at_16: Tensor) -> Tensor:
        """Return cells of the same shape, (B, channels, 16, 16, 16)."""
        at_16 = self.down_16(at_16)
        at_8 = self.down_8(self.to_8(at_16))
        at_4 = self.at_4(self.to_4(at_8))
        at_8 = self.up_8(at_8 + finer(self.from_4, at_4))
        found: Tensor = self.up_16(at_16 + finer(self.from_8, at_8))
        return found


def _coarser(fine: int, coarse: int) -> nn.Sequential:
    """Return what makes one cell, `coarse` channels, of 2 x 2 x 2 cells of `fine` channels."""
    return nn.Sequential(nn.Conv3d(fine, coarse, 2, stride=2), group_norm(coarse), nn.ReLU())
