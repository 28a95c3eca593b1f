"""The 2D convolutional LSTM encoder of section 3.1: an image to the attentive latent unit A_t."""

import math

from active_recon.models.recurrent import ConvLSTMCell, LstmState
from torch import nn, Tensor

IMAGE_SIZE = 64
LATENT_GRID = 4  # cells a side of A_t in the image's plane, and of the decoder's first volume


def group_norm(channels: int) -> nn.GroupNorm:
    """
    Return the normalisation that follows every convolution but the last (Wu and He 2018).

    Without it hardly any signal of the image gets through the two memories, whose outputs are
    small at first, to the decoder. It does not depend on the other objects of a batch.
    """
    return nn.GroupNorm(math.gcd(8, channels), channels)


class ResidualBlock(nn.Module):
    """Two 3 x 3 convolutions and a shortcut (He et al. 2016), halving the image."""

    def __init__(self, in_channels: int, out_channels: int) -> None:
        super().__init__()
        self.change = nn.Sequential(
            nn.Conv2d(in_channels, out_channels, 3, stride=2, padding=1),
            group_norm(out_channels), nn.LeakyReLU(0.1),
            nn.Conv2d(out_channels, out_channels, 3, padding=1), group_norm(out_channels))
        self.shortcut = nn.Conv2d(in_channels, out_channels, 1, stride=2)
        self.activation = nn.LeakyReLU(0.1)

    def forward(self, image: Tensor) -> Tensor:
        """(B, in, S, S) to (B, out, S / 2, S / 2)."""
        result: Tensor = self.activation(self.change(image) + self.shortcut(image))
        return result


class Encoder(nn.Module):
    """
    Three residual blocks, a ConvLSTM, and three convolutions to A_t.

    - images: (B, `image_channels`, 64, 64) in [0, 1]
    - latent A_t: (B, 4 C, 4, 4), the same numbers as a volume of C channels and 4 x 4 x 4 cells

    An image has no azimuth, and the object is reconstructed in its own frame, so a feature of one
    side of the image may belong anywhere: the first of the three convolutions after the memory
    spans its whole grid.
    """

    def __init__(self, stem_channels: int, block_channels: tuple[int, int, int],
                 recurrent_channels: int, bottleneck_channels: int, latent_channels: int,
                 image_channels: int = 3) -> None:
        super().__init__()
        widths = (stem_channels, *block_channels)
        self.stem = nn.Sequential(
            nn.Conv2d(image_channels, stem_channels, 5, stride=2, padding=2),
            group_norm(stem_channels), nn.LeakyReLU(0.1))
        self.blocks = nn.Sequential(
            *(ResidualBlock(a, b) for a, b in zip(widths[:-1], widths[1:], strict=True)))
        self.memory = ConvLSTMCell(block_channels[-1], recurrent_channels, (LATENT_GRID,) * 2)
        self.to_latent = nn.Sequential(
            nn.Conv2d(recurrent_channels, bottleneck_channels, LATENT_GRID),
            nn.GroupNorm(1, bottleneck_channels), nn.LeakyReLU(0.1),
            nn.Conv2d(bottleneck_channels, bottleneck_channels, 1),
            nn.GroupNorm(1, bottleneck_channels), nn.LeakyReLU(0.1),
            nn.Conv2d(bottleneck_channels, latent_channels * LATENT_GRID ** 3, 1),
            nn.GroupNorm(1, latent_channels * LATENT_GRID ** 3), nn.LeakyReLU(0.1))

    @property
    def latent_shape(self) -> tuple[int, int, int]:
        """The shape of an object's A_t, (4 C, 4, 4)."""
        last = self.to_latent[-2]
        assert isinstance(last, nn.GroupNorm)
        return last.num_channels // LATENT_GRID ** 2, LATENT_GRID, LATENT_GRID

    def encode(self, images: Tensor) -> Tensor:
        """Return the features of images after the residual blocks, (B, F, 4, 4)."""
        features: Tensor = self.blocks(self.stem(2 * images - 1))
        return features

    def update(self, features: Tensor, state: LstmState) -> tuple[Tensor, LstmState]:
        """Return A_t and the next state."""
        state = self.memory(features, state)
        latent = self.to_latent(state.hidden)  # (B, 64 C, 1, 1)
        return latent.reshape(len(features), -1, LATENT_GRID, LATENT_GRID), state
