"""View statistics to occupancy: a small U-Net, and the visual hull at full resolution."""

from typing import NamedTuple

from active_recon.models.encoder import group_norm
import torch
from torch import nn, Tensor
from torch.nn import functional

FINE_SIDE = 32
_INITIAL_BIAS = (0.5, 0.5, -2.0)  # of the layer at 64 cells


class Decoded(NamedTuple):
    """
    What the decoder gives for B objects.

    - logits: of occupancy, (B, 64, 64, 64); coarse: (B, 32, 32, 32)
    - evidence: log of the lowest foreground probability over the views, (B, 64, 64, 64)
    """

    logits: Tensor
    coarse: Tensor
    evidence: Tensor


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
                or _is_traced() or cells.device.type != 'cpu'
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


def _is_traced() -> bool:
    """Return whether this is an export, whose graph keeps to what ONNX has."""
    return bool(torch.jit.is_tracing())  # type: ignore[attr-defined, no-untyped-call]


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


class HullUnet(nn.Module):
    """
    A U-Net at 16, 8 and 4 cells a side, upsampled to 32 and 64, where the hull is added.

    `coarse` and `fine` are the input channels at 16 and 32 cells, `channels` those of the U-Net
    at 16, 8 and 4 cells, `head` those at 32. The logits are the U-Net's plus the log of the
    lowest and of the second lowest foreground probability over all views, each times a scale
    learned per cell; the scale of the lowest is at least 1. So cells outside the visual hull are
    empty without having to be learned.
    """

    def __init__(self, coarse: int, fine: int, channels: tuple[int, int, int],
                 head: int) -> None:
        super().__init__()
        at_16, at_8, at_4 = channels
        self.fine_in = nn.Sequential(nn.Conv3d(fine + 8, head, 1), nn.ReLU())
        self.enter = nn.Sequential(
            nn.Conv3d(coarse + 8 * head, at_16, 1), group_norm(at_16), nn.ReLU())
        self.down_16 = Residual3d(at_16, 1)
        self.to_8 = nn.Sequential(nn.Conv3d(at_16, at_8, 2, stride=2), group_norm(at_8), nn.ReLU())
        self.down_8 = Residual3d(at_8, 2)
        self.to_4 = nn.Sequential(nn.Conv3d(at_8, at_4, 2, stride=2), group_norm(at_4), nn.ReLU())
        self.at_4 = Residual3d(at_4, 2)
        self.from_4, self.up_8 = nn.Conv3d(at_4, 8 * at_8, 1), Residual3d(at_8, 2)
        self.from_8, self.up_16 = nn.Conv3d(at_8, 8 * at_16, 1), Residual3d(at_16, 2)
        self.to_32 = nn.Conv3d(at_16, 8 * head, 1)
        self.skip_32 = nn.Conv3d(head, head, 1)
        self.to_64 = nn.Conv3d(head, 8 * 3, 1)
        # The initial prediction is the visual hull
        with torch.no_grad():
            self.to_64.weight.mul_(0.1)
        self.to_64.bias = nn.Parameter(torch.tensor(_INITIAL_BIAS).repeat_interleave(8))
        self.logit_32 = nn.Conv3d(head, 1, 1)

    def forward(self, coarse: Tensor, fine: Tensor, hull: Tensor) -> Decoded:
        """
        Decode view statistics.

        Takes view statistics (B, coarse, 16, 16, 16) and (B, fine, 32, 32, 32), and the two
        lowest foreground logits over all views, (B, 2, 64, 64, 64).
        """
        # By the 2 x 2 x 2 cells in each cell at 32, which costs less than that order at 64
        carved = -functional.softplus(-space_to_depth(hull))  # logsigmoid, of least and second
        least, second = carved[:, :8], carved[:, 8:]
        entered = self.fine_in(torch.cat([fine, least], dim=1))
        at_16: Tensor = self.enter[1:](self._entered(coarse, entered))
        # Inference takes two thirds of the time, training more; no graph can be exported with it
        if not (self.training or _is_traced()):
            at_16 = at_16.contiguous(memory_format=torch.channels_last_3d)
        at_16 = self.down_16(at_16)
        at_8 = self.down_8(self.to_8(at_16))
        at_4 = self.at_4(self.to_4(at_8))
        at_8 = self.up_8(at_8 + depth_to_space(self.from_4(at_4)))
        at_16 = self.up_16(at_16 + depth_to_space(self.from_8(at_8)))
        at_32 = functional.relu(depth_to_space(self.to_32(at_16)) + self.skip_32(entered))
        learned, *scales = self.to_64(at_32).split(8, dim=1)  # (B, 8, 32, 32, 32) each
        logits = learned + least + (functional.softplus(scales[0]) * least
                                    + functional.softplus(scales[1]) * second)
        logits, evidence = (depth_to_space(each)[:, 0] for each in (logits, least))
        return Decoded(logits, self.logit_32(at_32)[:, 0], evidence)

    def _entered(self, coarse: Tensor, fine: Tensor) -> Tensor:
        """Return `enter`'s convolution of coarse cells beside blocks of 2 x 2 x 2 finer ones."""
        layer = self.enter[0]
        assert isinstance(layer, nn.Conv3d)
        own, blocks = torch.split(layer.weight, [coarse.shape[1], 8 * fine.shape[1]], dim=1)
        blocks = blocks.reshape(len(blocks), -1, 2, 2, 2)
        return (functional.conv3d(coarse, own, layer.bias)
                + functional.conv3d(fine, blocks, stride=2))
