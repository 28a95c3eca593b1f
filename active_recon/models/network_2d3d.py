"""The paper's reconstruction network: encoder and decoder, one view at a time."""

from dataclasses import dataclass
import math

from active_recon.config import Config
from active_recon.errors import ConfigError
from active_recon.models.decoder import Decoder
from active_recon.models.encoder import Encoder, IMAGE_SIZE
from active_recon.models.network import Cameras, ReconstructionNetwork, State
from active_recon.models.recurrent import LstmState
from torch import Tensor


@dataclass(frozen=True)
class Network2d3dConfig(Config):
    """
    Sizes of the 2D-3D-attention network; the paper states none of them.

    `view_separation`, radians, is the smallest angle between a goal and the views taken; the
    paper's is 0.
    """

    stem_channels: int = 32
    block_channels: tuple[int, int, int] = (48, 96, 128)
    recurrent_channels: int = 128
    bottleneck_channels: int = 352
    latent_channels: int = 24
    volume_channels: int = 64
    decoder_channels: tuple[int, int] = (64, 24)
    glimpse_channels: int = 128
    view_separation: float = 0.0

    def __post_init__(self) -> None:
        """Reject sizes that make no network."""
        sizes = [size for name, value in self.to_dict().items() if name.endswith('channels')
                 for size in (value if isinstance(value, tuple) else (value,))]
        if min(sizes) < 1:
            raise ConfigError('Network2d3dConfig: invalid channels: expected 1 or more, got '
                              f'{min(sizes)}')
        if not 0 <= self.view_separation <= math.pi:
            raise ConfigError('Network2d3dConfig: invalid view_separation: expected 0 to pi, got '
                              f'{self.view_separation}')


SIZES = {'small': Network2d3dConfig(), 'published': Network2d3dConfig(
    stem_channels=64, block_channels=(128, 256, 256), recurrent_channels=256,
    bottleneck_channels=1024, latent_channels=64, volume_channels=128, decoder_channels=(128, 64),
    glimpse_channels=256)}


class Network2d3d(ReconstructionNetwork):
    """
    The 2D-3D network of figure 2; with the attentive model beside it, 2D-3D-attention.

    "Object Reconstruction Based on Attentive Recurrent Network from Single and Multiple Images",
    sections 3.1 and 3.2. It predicts in the object's own frame and does not look at the camera.
    Its state is the memories of encoder and decoder, and A_t as `latent`.
    """

    image_size, resolution, needs_front = IMAGE_SIZE, 32, True

    def __init__(self, encoder: Encoder, decoder: Decoder) -> None:
        super().__init__()
        self.encoder = encoder
        self.decoder = decoder

    @classmethod
    def from_config(cls, config: Network2d3dConfig, image_channels: int = 3) -> 'Network2d3d':
        """Build the network of a configuration, with fresh weights."""
        return cls(
            Encoder(config.stem_channels, config.block_channels, config.recurrent_channels,
                    config.bottleneck_channels, config.latent_channels, image_channels),
            Decoder(config.latent_channels, config.volume_channels, config.decoder_channels))

    def initial_state(self, batch: int) -> State:
        """Return the state before any view: zeros."""
        encoder = self.encoder.memory.initial_state(batch)
        decoder = self.decoder.memory.initial_state(batch)
        return {'encoder_hidden': encoder.hidden, 'encoder_memory': encoder.memory,
                'decoder_hidden': decoder.hidden, 'decoder_memory': decoder.memory,
                'latent': encoder.hidden.new_zeros(batch, *self.encoder.latent_shape)}

    def encode(self, images: Tensor, cameras: Cameras) -> Tensor:
        """Return the images' features, (B, F, 4, 4)."""
        return self.encoder.encode(images)

    def update(self, encoded: Tensor, cameras: Cameras, state: State) -> State:
        """Return the state updated by the images' features."""
        latent, encoder = self.encoder.update(
            encoded, LstmState(state['encoder_hidden'], state['encoder_memory']))
        decoder = self.decoder.update(
            latent, LstmState(state['decoder_hidden'], state['decoder_memory']))
        return {'encoder_hidden': encoder.hidden, 'encoder_memory': encoder.memory,
                'decoder_hidden': decoder.hidden, 'decoder_memory': decoder.memory,
                'latent': latent}

    def decode(self, state: State) -> Tensor:
        """Return the occupancy's logits, (B, 32, 32, 32)."""
        logits: Tensor = self.decoder(state['decoder_hidden'])
        return logits
