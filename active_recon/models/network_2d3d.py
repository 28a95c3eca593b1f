"""The paper's reconstruction network: encoder and decoder, one view at a time."""

from typing import NamedTuple

from active_recon.config import NetworkConfig
from active_recon.models.decoder import Decoder
from active_recon.models.encoder import Encoder
from active_recon.models.recurrent import LstmState
from torch import nn, Tensor


class Hidden(NamedTuple):
    """The memories of encoder and decoder after some views."""

    encoder: LstmState
    decoder: LstmState


class Reconstructed(NamedTuple):
    """What is known after a view: occupancy logits (B, 32, 32, 32) and A_t (B, 4 C, 4, 4)."""

    logits: Tensor
    latent: Tensor


class ReconstructionNetwork(nn.Module):
    """The 2D-3D network of figure 2. The hidden state is passed in and handed back."""

    def __init__(self, encoder: Encoder, decoder: Decoder) -> None:
        super().__init__()
        self.encoder = encoder
        self.decoder = decoder

    @classmethod
    def from_config(cls, config: NetworkConfig) -> 'ReconstructionNetwork':
        """Build the network of a configuration, with fresh weights."""
        return cls(
            Encoder(config.stem_channels, config.block_channels, config.recurrent_channels,
                    config.bottleneck_channels, config.latent_channels),
            Decoder(config.latent_channels, config.volume_channels, config.decoder_channels))

    def forward(self, images: Tensor,
                hidden: Hidden | None = None) -> tuple[Reconstructed, Hidden]:
        """Fold in one view of each object: images (B, 3, 64, 64) in [0, 1]."""
        latent, encoder = self.encoder(images, hidden and hidden.encoder)
        logits, decoder = self.decoder(latent, hidden and hidden.decoder)
        return Reconstructed(logits, latent), Hidden(encoder, decoder)
