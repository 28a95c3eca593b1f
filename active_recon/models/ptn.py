"""The Perspective Transformer Nets, which learn from silhouettes."""

from dataclasses import dataclass

from active_recon.config import Config
from active_recon.errors import ConfigError
from active_recon.models.encoder import group_norm
from active_recon.models.mean_code import ImageEncoder, MeanCodeNetwork
from active_recon.models.network import init_occupancy_bias, State
from torch import nn, Tensor

_COARSEST = 3  # cells a side of the decoder's first volume


@dataclass(frozen=True)
class PtnConfig(Config):
    """
    Sizes of the Perspective Transformer Nets.

    `volume_channels` are those of the decoder at 3, 6 and 15 cells a side.
    """

    image_channels: tuple[int, int, int]
    code_channels: tuple[int, int, int]
    volume_channels: tuple[int, int, int]

    def __post_init__(self) -> None:
        """Reject sizes that make no network."""
        sizes = (self.image_channels, self.code_channels, self.volume_channels)
        if any(len(part) != 3 or min(part) < 1 for part in sizes):
            raise ConfigError('PtnConfig: invalid channels: expected three of 1 or more in every '
                              f'part, got {self.to_dict()}')


SIZES = {
    'small': PtnConfig(image_channels=(32, 64, 128), code_channels=(256, 256, 256),
                       volume_channels=(64, 64, 32)),
    'published': PtnConfig(image_channels=(64, 128, 256), code_channels=(512, 512, 512),
                           volume_channels=(512, 256, 96)),
}


class PerspectiveTransformerNet(MeanCodeNetwork):
    """
    The encoder and the volume decoder of the Perspective Transformer Nets.

    Yan et al. 2016, "Perspective Transformer Nets: Learning Single-View 3D Object Reconstruction
    without 3D Supervision". The projection that gives them their name is `silhouettes.project`;
    whether they learn from silhouettes alone (PTN-Proj) or from voxels too (PTN-Comb) is the
    loss's to say. Theirs takes images of 64 pixels too, and one view: over several, the mean of
    their codes is decoded here. Layers are normalised, as in the paper's network here.
    """

    resolution = 32

    def __init__(self, encoder: ImageEncoder, code_channels: int,
                 volume_channels: tuple[int, int, int]) -> None:
        super().__init__(encoder)
        wide, middle, narrow = volume_channels
        to_logits = nn.ConvTranspose3d(narrow, 1, 6, stride=2, padding=1)
        self.decoder = nn.Sequential(
            nn.Linear(code_channels, wide * _COARSEST ** 3),
            nn.Unflatten(1, (wide, *(_COARSEST,) * 3)), group_norm(wide), nn.ReLU(),
            nn.ConvTranspose3d(wide, middle, 4), group_norm(middle), nn.ReLU(),  # 6 cells a side
            nn.ConvTranspose3d(middle, narrow, 5, stride=2), group_norm(narrow), nn.ReLU(),  # 15
            to_logits)
        init_occupancy_bias(to_logits.bias)

    @classmethod
    def from_config(cls, config: PtnConfig) -> 'PerspectiveTransformerNet':
        """Build the network of a configuration, with fresh weights."""
        return cls(ImageEncoder(config.image_channels, config.code_channels),
                   config.code_channels[-1], config.volume_channels)

    def decode(self, state: State) -> Tensor:
        """Return the occupancy's logits, (B, 32, 32, 32), of the mean codes."""
        logits: Tensor = self.decoder(state['latent'].flatten(1))[:, 0]
        return logits
