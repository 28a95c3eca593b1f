"""An image as one code, and several views as the mean of theirs."""

from itertools import pairwise
from typing import NamedTuple

from active_recon.models.encoder import group_norm, IMAGE_SIZE
from active_recon.models.network import Folded, ReconstructionNetwork
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

    def forward(self, images: Tensor) -> Tensor:
        """Return the codes of images (B, 3, 64, 64) in [0, 1]."""
        codes: Tensor = self.layers(2 * images - 1)
        return codes


class SeenCodes(NamedTuple):
    """The sum of the codes of all views so far, (B, D), and how many those are."""

    total: Tensor
    views: int


class MeanCodeNetwork(ReconstructionNetwork):
    """
    A single-view network over several views: the mean of their codes is decoded.

    The order of the views is of no matter. The latent is the mean code as (B, D, 1, 1).
    """

    def __init__(self, encoder: ImageEncoder) -> None:
        super().__init__()
        self.encoder = encoder

    def look(self, images: Tensor) -> Tensor:
        """Return the images' codes, (B, D)."""
        codes: Tensor = self.encoder(images)
        return codes

    def remember(self, seen: Tensor, azimuths: Tensor,
                 hidden: SeenCodes | None = None) -> tuple[Folded, SeenCodes]:
        """Take in images' codes; the features of what is known are the mean code, (B, D)."""
        known = SeenCodes(hidden.total + seen, hidden.views + 1) if hidden else SeenCodes(seen, 1)
        mean = known.total / known.views
        return Folded(mean[:, :, None, None], mean), known
