"""What depth images saw, worked into the occupancy of a lifting network that did not see them."""

from dataclasses import dataclass

from active_recon.config import Config
from active_recon.errors import ConfigError
from active_recon.models.encoder import group_norm
from active_recon.models.volume_unet import depth_to_space, space_to_depth, VolumeUnet
import torch
from torch import nn, Tensor
from torch.nn import functional

KINDS = 3  # of evidence: see `depth_evidence`
_SEEN = 6  # channels at 64 cells
_LEARNED = 4  # logit, and weights of the given logit, of free space and of surfaces
_SURE = 1e-6  # occupancies nearer to 0 and 1 count as this
_MOST = 8.0  # of a given logit: beyond it a network is sure


@dataclass(frozen=True)
class DepthRefinerConfig(Config):
    """
    Sizes of the refiner.

    - features: channels of the lifting network's mean over views at 16 cells a side
    - head_channels: at 32 cells; volume_channels: at 16, 8 and 4 cells
    """

    features: int = 32
    head_channels: int = 24
    volume_channels: tuple[int, int, int] = (40, 64, 96)

    def __post_init__(self) -> None:
        """Reject sizes that make no network."""
        if min(self.features, self.head_channels, *self.volume_channels) < 1:
            raise ConfigError('DepthRefinerConfig: invalid channels: expected 1 or more, got '
                              f'{self.to_dict()}')


class DepthRefiner(VolumeUnet):
    """
    Corrects occupancy by depth evidence, with a U-Net at 32, 16, 8 and 4 cells a side.

    The corrected logit is the given one, plus a learned logit, plus the given one, the free
    evidence and the surface evidence, each times a factor learned per cell. The last layer begins
    at zero, so that an untrained refiner returns what it is given. Without depth it is not asked.
    """

    def __init__(self, features: int, head: int, channels: tuple[int, int, int]) -> None:
        super().__init__()
        at_16 = channels[0]
        self.features = features
        self.enter_32 = nn.Sequential(nn.Conv3d(8 * _SEEN, head, 1), nn.ReLU())
        self.enter_16 = nn.Conv3d(features + 1, at_16, 1)
        self.to_16, self.norm_16 = nn.Conv3d(head, at_16, 2, stride=2), group_norm(at_16)
        self.add_unet(channels, (1, 1, 2, 1, 1))
        self.to_32, self.skip_32 = nn.Conv3d(at_16, 8 * head, 1), nn.Conv3d(head, head, 1)
        self.mix_32 = nn.Sequential(nn.Conv3d(head, head, 1), nn.ReLU())
        self.to_64 = nn.Conv3d(head, 8 * _LEARNED, 1)
        self.calibration: Tensor  # scale and bias of the corrected logit
        self.register_buffer('calibration', torch.tensor([1.0, 0]))
        nn.init.zeros_(self.to_64.weight)
        assert self.to_64.bias is not None
        nn.init.zeros_(self.to_64.bias)

    @classmethod
    def from_config(cls, config: DepthRefinerConfig) -> 'DepthRefiner':
        """Build the refiner of a configuration, with fresh weights."""
        return cls(config.features, config.head_channels, config.volume_channels)

    @classmethod
    def begun_with(cls, refiner: 'DepthRefiner', config: DepthRefinerConfig) -> 'DepthRefiner':
        """
        Return a refiner that begins with the weights of another, which may be another network's.

        If the networks have different numbers of features, what reads them begins at zero. Raises
        ConfigError if other sizes differ.
        """
        begun, given = cls.from_config(config), refiner.state_dict()
        if begun.features != refiner.features:
            given['enter_16.weight'] = torch.zeros_like(begun.enter_16.weight)
        try:
            begun.load_state_dict(given)
        except RuntimeError as error:
            raise ConfigError('depth refiner of other sizes: expected those of '
                              f'{config.to_dict()}: {error}') from error
        return begun

    def forward(self, logits: Tensor, evidence: Tensor, count: Tensor, total: Tensor) -> Tensor:
        """
        Return corrected logits of occupancy, (B, 64, 64, 64).

        Takes the lifting network's logits, of that shape, evidence (B, 3, 64, 64, 64), and of its
        state `coarse_count` (B, 1, 16, 16, 16) and `coarse_sum` (B, features, 16, 16, 16).
        """
        given = logits[:, None].clamp(-_MOST, _MOST)
        seen = torch.cat([given / 4, described(evidence)], dim=1)
        blocks = space_to_depth(seen)  # (B, 8 * channels, 32, 32, 32)
        at_32 = self.enter_32(blocks)
        mean = torch.cat([total / count.clamp(min=1), count.clamp(max=1)], dim=1)
        at_16 = functional.relu(self.norm_16(self.to_16(at_32) + self.enter_16(mean)))
        worked = self.unet(at_16)
        at_32 = functional.relu(depth_to_space(self.to_32(worked)) + self.skip_32(at_32))
        learned, more, free, near = depth_to_space(self.to_64(self.mix_32(at_32))).unbind(dim=1)
        corrected = (logits + learned + more * given[:, 0] - free * seen[:, 1]
                     + near * seen[:, 3])
        calibrated: Tensor = self.calibration[0] * corrected + self.calibration[1]
        return calibrated

    def refine(self, occupancy: Tensor, evidence: Tensor, count: Tensor, total: Tensor) -> Tensor:
        """Return corrected occupancy of occupancy in [0, 1]; for the rest see `forward`."""
        sure = occupancy.clamp(_SURE, 1 - _SURE)
        corrected: Tensor = self((sure / (1 - sure)).log(), evidence, count, total).sigmoid()
        return corrected


def described(evidence: Tensor) -> Tensor:
    """
    Return evidence (B, 3, R, R, R) as shares in [0, 1], (B, 5, R, R, R).

    They are: whether the cell was seen free, and how often among the views that saw it free or
    at a surface; whether it was seen at a surface; how often it was behind one; whether it has a
    value.
    """
    free, near, behind = torch.split(evidence, 1, dim=1)
    known = free + near + behind
    return torch.cat([
        free.clamp(max=1), free / (free + near).clamp(min=0.25), near.clamp(max=1),
        behind / known.clamp(min=1), known.clamp(max=1)], dim=1)
