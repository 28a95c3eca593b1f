"""The paper's reconstruction network: encoder and decoder, one view at a time."""

from typing import NamedTuple

from active_recon.config import NetworkConfig
from active_recon.models.decoder import Decoder
from active_recon.models.encoder import Encoder
from active_recon.models.network import Folded, ReconstructionNetwork
from active_recon.models.recurrent import LstmState
from torch import Tensor


class Hidden(NamedTuple):
    """The memories of encoder and decoder after some views."""

    encoder: LstmState
    decoder: LstmState


class Network2d3d(ReconstructionNetwork):
    """
    The 2D-3D network of figure 2; with the attentive model beside it, 2D-3D-attention.

    "Object Reconstruction Based on Attentive Recurrent Network from Single and Multiple Images",
    sections 3.1 and 3.2. It predicts in the object's own frame and does not look at the azimuth.
    """

    def __init__(self, encoder: Encoder, decoder: Decoder) -> None:
        super().__init__()
        self.encoder = encoder
        self.decoder = decoder

    @classmethod
    def from_config(cls, config: NetworkConfig) -> 'Network2d3d':
        """Build the network of a configuration, with fresh weights."""
        return cls(
            Encoder(config.stem_channels, config.block_channels, config.recurrent_channels,
                    config.bottleneck_channels, config.latent_channels),
            Decoder(config.latent_channels, config.volume_channels, config.decoder_channels))

    def look(self, images: Tensor) -> Tensor:
        """Return the images' features, (B, F, 4, 4)."""
        return self.encoder.look(images)

    def remember(self, seen: Tensor, azimuths: Tensor,
                 hidden: Hidden | None = None) -> tuple[Folded, Hidden]:
        """Take in images' features; those of what is known are the decoder's memory."""
        latent, encoder = self.encoder.remember(seen, hidden and hidden.encoder)
        decoder = self.decoder.remember(latent, hidden and hidden.decoder)
        return Folded(latent, decoder.hidden), Hidden(encoder, decoder)

    def decode(self, features: Tensor) -> Tensor:
        """Return the occupancy's logits, (B, 32, 32, 32)."""
        logits: Tensor = self.decoder(features)
        return logits
