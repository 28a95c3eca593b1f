"""View statistics to occupancy: a small U-Net, and the visual hull at full resolution."""

from typing import NamedTuple

from active_recon.models.encoder import group_norm
from active_recon.models.volume_unet import finer, is_traced, VolumeUnet
import torch
from torch import nn, Tensor
from torch.nn import functional

FINE_SIDE = 32
_INITIAL_BIAS = (0.5, 0.5, -2.0)  # of the layer at 64 cells


class Decoded(NamedTuple):
    """
    What the decoder gives for B objects; see `depth_to_space` for the order of the 8 cells in one.

    - logits: of occupancy at 64 cells a side, (B, 8, 32, 32, 32); coarse: at 32, (B, 32, 32, 32)
    - evidence: log of the lowest foreground probability over the views, (B, 8, 32, 32, 32)
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

    def forward(self, coarse: tuple[Tensor, Tensor], fine: tuple[Tensor, Tensor],
                hull: Tensor) -> Decoded:
        """
        Decode view statistics.

        Takes view statistics and what goes with them, (B, ..., 16, 16, 16) twice and (B, ..., 32,
        32, 32) twice, and the lowest and the second lowest foreground logits over all views of
        the 8 cells in each cell at 32, (B, 16, 32, 32, 32).
        """
        carved = -functional.softplus(-hull)  # logsigmoid
        least, second = carved[:, :8], carved[:, 8:]
        # Convolutions of parts are added instead of one of the parts side by side: joining them,
        # and numbers of channels that are no multiple of 32, take longer
        of_fine, of_rest = _split(self.fine_in[0], fine[0])
        rest = torch.cat([fine[1], least.to(fine[1].dtype)], dim=1)
        entered = self.fine_in[1:](of_fine + functional.conv3d(rest, of_rest))
        of_coarse, weights = _split(self.enter[0], coarse[0])
        of_rest, blocks = torch.split(
            weights, [coarse[1].shape[1], 8 * entered.shape[1]], dim=1)
        blocks = blocks.reshape(len(blocks), -1, 2, 2, 2)
        at_16: Tensor = self.enter[1:](of_coarse + functional.conv3d(coarse[1], of_rest)
                                       + functional.conv3d(entered, blocks, stride=2))
        # Inference takes two thirds of the time, training more; no graph can be exported with it
        if not (self.training or is_traced()):
            at_16 = at_16.contiguous(memory_format=torch.channels_last_3d)
        worked = self.unet(at_16)
        at_32 = functional.relu(finer(self.to_32, worked) + self.skip_32(entered))
        learned, *scales = self.to_64(at_32).split(8, dim=1)  # (B, 8, 32, 32, 32) each
        logits = learned + least + (functional.softplus(scales[0]) * least
                                    + functional.softplus(scales[1]) * second)
        return Decoded(logits, self.logit_32(at_32)[:, 0], least)


def _split(layer: nn.Module, first: Tensor) -> tuple[Tensor, Tensor]:
    """Return a convolution of its first channels, and its weights for the others."""
    assert isinstance(layer, nn.Conv3d)
    count = first.shape[1]
    own, others = torch.split(layer.weight, [count, layer.in_channels - count], dim=1)
    return functional.conv3d(first, own, layer.bias), others
