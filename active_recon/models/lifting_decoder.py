"""View statistics to occupancy: a small U-Net, and the visual hull at full resolution."""

from typing import NamedTuple

from active_recon.models.encoder import group_norm
from active_recon.models.volume_unet import depth_to_space, is_traced, space_to_depth, VolumeUnet
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


class HullUnet(VolumeUnet):
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
        at_16 = channels[0]
        self.fine_in = nn.Sequential(nn.Conv3d(fine + 8, head, 1), nn.ReLU())
        self.enter = nn.Sequential(
            nn.Conv3d(coarse + 8 * head, at_16, 1), group_norm(at_16), nn.ReLU())
        self.add_unet(channels, (1, 2, 2, 2, 2))
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
        if not (self.training or is_traced()):
            at_16 = at_16.contiguous(memory_format=torch.channels_last_3d)
        worked = self.unet(at_16)
        at_32 = functional.relu(depth_to_space(self.to_32(worked)) + self.skip_32(entered))
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
