"""3D-R2N2, the recurrent network that the paper is compared with first."""

from dataclasses import dataclass
from itertools import pairwise

from active_recon.config import Config
from active_recon.errors import ConfigError
from active_recon.models.encoder import group_norm, IMAGE_SIZE, LATENT_GRID
from active_recon.models.network import Cameras, init_occupancy_bias, ReconstructionNetwork, State
from active_recon.models.subpixel import SubpixelConv3d
from torch import nn, Tensor

_DOUBLINGS = 3  # from the memory's 4 cells a side to 32


@dataclass(frozen=True)
class R2n2Config(Config):
    """
    Sizes of 3D-R2N2.

    `encoder_channels` are those of six pairs of 2D convolutions, the image halved between them;
    `decoder_channels` of pairs of 3D convolutions. The grid is doubled before each of the first
    three; where there are but two, the last convolution doubles it.
    """

    encoder_channels: tuple[int, ...]
    code_channels: int
    hidden_channels: int
    decoder_channels: tuple[int, ...]

    def __post_init__(self) -> None:
        """Reject sizes that make no network."""
        sizes = (*self.encoder_channels, self.code_channels, self.hidden_channels,
                 *self.decoder_channels)
        if (min(sizes) < 1 or len(self.encoder_channels) != 6
                or len(self.decoder_channels) < _DOUBLINGS - 1):
            raise ConfigError('R2n2Config: invalid channels: expected 1 or more, six in the '
                              f'encoder and two or more in the decoder, got {self.to_dict()}')


SIZES = {
    'small': R2n2Config(encoder_channels=(16, 32, 48, 96, 128, 128), code_channels=256,
                        hidden_channels=32, decoder_channels=(24, 16)),
    'published': R2n2Config(encoder_channels=(96, 128, 256, 256, 256, 256), code_channels=1024,
                            hidden_channels=128, decoder_channels=(128, 128, 64, 32)),
}


class ResidualPair(nn.Module):
    """
    Two convolutions and a shortcut around them, in 2 or 3 dimensions; the grid stays as it is.

    (B, in, *grid) to (B, out, *grid).
    """

    def __init__(self, dimensions: int, in_channels: int, out_channels: int,
                 kernel_size: int = 3) -> None:
        super().__init__()
        convolution = nn.Conv2d if dimensions == 2 else nn.Conv3d
        self.change = nn.Sequential(
            convolution(in_channels, out_channels, kernel_size, padding=kernel_size // 2),
            group_norm(out_channels), nn.LeakyReLU(0.1),
            convolution(out_channels, out_channels, 3, padding=1), group_norm(out_channels),
            nn.LeakyReLU(0.1))
        self.shortcut = (nn.Identity() if in_channels == out_channels
                         else convolution(in_channels, out_channels, 1))

    def forward(self, features: Tensor) -> Tensor:
        """Return the features with what the convolutions change about them."""
        result: Tensor = self.shortcut(features) + self.change(features)
        return result


class ConvGRUCell(nn.Module):
    """
    One step of their 3D convolutional GRU.

    - code: (B, D), of an image; every cell has its own weights for it
    - hidden: (B, H, 4, 4, 4), updated by convolutions
    """

    def __init__(self, code_channels: int, hidden_channels: int) -> None:
        super().__init__()
        self.hidden_channels = hidden_channels
        self.from_code = nn.Linear(code_channels, 3 * hidden_channels * LATENT_GRID ** 3)
        self.gates = nn.Conv3d(hidden_channels, 2 * hidden_channels, 3, padding=1, bias=False)
        self.proposal = nn.Conv3d(hidden_channels, hidden_channels, 3, padding=1, bias=False)

    def initial_state(self, batch: int) -> Tensor:
        """Return the memory of so many objects before any view: zeros."""
        return self.from_code.weight.new_zeros(
            batch, self.hidden_channels, *(LATENT_GRID,) * 3)

    def forward(self, code: Tensor, hidden: Tensor) -> Tensor:
        """Return the next memory."""
        update, reset, proposal = self.from_code(code).reshape(
            len(code), 3, *hidden.shape[1:]).unbind(dim=1)
        update_too, reset_too = self.gates(hidden).chunk(2, dim=1)
        keep = (update + update_too).sigmoid()
        new = (proposal + self.proposal((reset + reset_too).sigmoid() * hidden)).tanh()
        result: Tensor = keep * hidden + (1 - keep) * new
        return result


class R2n2(ReconstructionNetwork):
    """
    3D-R2N2 in its residual GRU variant, learned by voxel-wise cross entropy.

    Choy et al. 2016, "3D-R2N2: A Unified Approach for Single and Multi-view 3D Object
    Reconstruction". Theirs takes images of 127 pixels: on 64 the last pooling would leave one
    cell of the image, so it is left out. All pairs have shortcuts (theirs: all but two of the
    encoder's), and every convolution but the last is normalised, as in the paper's network here:
    what is compared is then the architecture.
    """

    image_size, resolution, needs_front = IMAGE_SIZE, 32, True

    def __init__(self, encoder_channels: tuple[int, ...], code_channels: int,
                 hidden_channels: int, decoder_channels: tuple[int, ...]) -> None:
        super().__init__()
        layers: list[nn.Module] = [ResidualPair(2, 3, encoder_channels[0], kernel_size=7)]
        for before, after in pairwise(encoder_channels):
            layers += [nn.MaxPool2d(2), ResidualPair(2, before, after)]
        self.encoder = nn.Sequential(
            *layers, nn.Flatten(), nn.Linear(4 * encoder_channels[-1], code_channels),
            nn.GroupNorm(1, code_channels), nn.LeakyReLU(0.1))
        self.memory = ConvGRUCell(code_channels, hidden_channels)
        stages: list[nn.Module] = []
        for index, (before, after) in enumerate(pairwise((hidden_channels, *decoder_channels))):
            if index < _DOUBLINGS:
                stages.append(nn.Upsample(scale_factor=2))
            stages.append(ResidualPair(3, before, after))
        last = decoder_channels[-1]
        self.decoder = nn.Sequential(*stages, (
            SubpixelConv3d(last) if len(decoder_channels) < _DOUBLINGS
            else nn.Conv3d(last, 1, 3, padding=1)))
        init_occupancy_bias(list(self.decoder.parameters())[-1])

    @classmethod
    def from_config(cls, config: R2n2Config) -> 'R2n2':
        """Build the network of a configuration, with fresh weights."""
        return cls(config.encoder_channels, config.code_channels, config.hidden_channels,
                   config.decoder_channels)

    def initial_state(self, batch: int) -> State:
        """Return an empty memory, (B, H, 4, 4, 4); the latent is the same as (B, 4 H, 4, 4)."""
        return _state(self.memory.initial_state(batch))

    def encode(self, images: Tensor, cameras: Cameras) -> Tensor:
        """Return the images' codes, (B, D)."""
        codes: Tensor = self.encoder(2 * images - 1)
        return codes

    def update(self, encoded: Tensor, cameras: Cameras, state: State) -> State:
        """Return the state updated by the codes of one image of each object, (B, D)."""
        return _state(self.memory(encoded, state['memory'].to(encoded.dtype)))

    def decode(self, state: State) -> Tensor:
        """Return the occupancy's logits, (B, 32, 32, 32), of the memory."""
        logits: Tensor = self.decoder(state['memory'])[:, 0]
        return logits


def _state(memory: Tensor) -> State:
    return {'memory': memory,
            'latent': memory.reshape(len(memory), -1, LATENT_GRID, LATENT_GRID)}
