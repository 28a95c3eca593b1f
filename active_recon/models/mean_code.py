"""An image as one code, and several views as the mean of theirs."""

from itertools import pairwise

from active_recon.models.encoder import group_norm, IMAGE_SIZE
from active_recon.models.network import Cameras, ReconstructionNetwork, State
import torch
from torch import nn, Tensor


class ImageEncoder(nn.Module):
    """
    5 x 5 convolutions that halve the image, and full connections: images to codes (B, D).

    The encoder of Yan et al. 2016. Every layer is normalised, as in the paper's network here.
    """

    def __init__(self, image_channels: tuple[int, ...], code_channels: tuple[int, ...]) -> None:
        super().__init__()
        layers: list[nn.Module] = []
        for before, after in pairwise((3, *image_channels)):
            layers += [nn.Conv2d(before, after, 5, stride=2, padding=2), group_norm(after),
                       nn.ReLU()]
        cells = (IMAGE_SIZE // 2 ** len(image_channels)) ** 2
        layers.append(nn.Flatten())
        for before, after in pairwise((image_channels[-1] * cells, *code_channels)):
            layers += [nn.Linear(before, after), nn.GroupNorm(1, after), nn.ReLU()]
        self.layers = nn.Sequential(*layers)
        self.code_size = code_channels[-1]

    def forward(self, images: Tensor) -> Tensor:
        """Return the codes of images (B, 3, 64, 64) in [0, 1]."""
        codes: Tensor = self.layers(2 * images - 1)
        return codes


class MeanCodeNetwork(ReconstructionNetwork):
    """
    A single-view network over several views: the mean of their codes is decoded.

    The order of the views does not matter. The latent is the mean code as (B, D, 1, 1); the rest
    of the state is the sum of the codes, (B, D), and their number, (B, 1).
    """

    image_size, needs_front = IMAGE_SIZE, True

    def __init__(self, encoder: ImageEncoder) -> None:
        super().__init__()
        self.encoder = encoder

    def initial_state(self, batch: int) -> State:
        """Return the state before any view: zeros."""
        empty = torch.zeros(batch, self.encoder.code_size, device=self.device)
        return {'total': empty, 'views': empty[:, :1], 'latent': empty[:, :, None, None]}

    def encode(self, images: Tensor, cameras: Cameras) -> Tensor:
        """Return the images' codes, (B, D)."""
        codes: Tensor = self.encoder(images)
        return codes

    def update(self, encoded: Tensor, cameras: Cameras, state: State) -> State:
        """Add the codes of one image of each object, (B, D), to the mean."""
        total = (state['total'] + encoded).to(encoded.dtype)
        views = state['views'] + 1
        mean = (total / views).to(encoded.dtype)
        return {'total': total, 'views': views, 'latent': mean[:, :, None, None]}
