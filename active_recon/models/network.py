"""What every reconstruction network is: views in one by one, occupancy out after every view."""

from abc import ABC, abstractmethod
from typing import Any, NamedTuple

from torch import nn, Tensor


def start_empty(bias: Tensor | None) -> None:
    """
    Let the bias of a last layer, which gives logits, say p = 0.1 everywhere.

    Most of a grid is empty: that start spares the first thousand steps.
    """
    assert bias is not None
    nn.init.constant_(bias, -2.2)


class Folded(NamedTuple):
    """
    What a network knows after a view, not yet decoded.

    - latent: (B, C, h, w), what a view policy sees
    - features: (B, ...), what `decode` makes occupancy of
    """

    latent: Tensor
    features: Tensor


class Reconstructed(NamedTuple):
    """What is known after a view: occupancy logits (B, R, R, R), indexed [x, y, z], and A_t."""

    logits: Tensor
    latent: Tensor


class ReconstructionNetwork(nn.Module, ABC):
    """
    The interface of all networks of the registry; the hidden state is passed in and handed back.

    - images: (B, 3, 64, 64) in [0, 1]; azimuths of their cameras: (B,) radians
    - hidden: whatever the network handed back after the view before; None before the first

    Looking at an image, remembering what it shows and decoding what is known are apart: training
    decodes after one view of a sequence only, and who tries many sequences of the same views
    looks at each of them once.
    """

    resolution: int = 32
    """R, cells a side of the occupancy."""

    @abstractmethod
    def look(self, images: Tensor) -> Tensor:
        """Return what each of the images shows by itself, (B, ...), whatever was seen before."""

    @abstractmethod
    def remember(self, seen: Tensor, azimuths: Tensor,
                 hidden: Any | None = None) -> tuple[Folded, Any]:
        """Take in what one image of each object shows, (B, ...)."""

    @abstractmethod
    def decode(self, features: Tensor) -> Tensor:
        """Return the occupancy's logits, (B, R, R, R), of what was folded in."""

    def fold(self, images: Tensor, azimuths: Tensor,
             hidden: Any | None = None) -> tuple[Folded, Any]:
        """Fold in one view of each object: look at it, and remember."""
        return self.remember(self.look(images), azimuths, hidden)

    def objective(self, features: Tensor, voxels: Tensor) -> Tensor | None:
        """
        Return a loss of the network's own kind against voxels (B, R, R, R), or None.

        None is for networks that learn from the losses of section 3.2, as most do.
        """
        return None

    def forward(self, images: Tensor, azimuths: Tensor,
                hidden: Any | None = None) -> tuple[Reconstructed, Any]:
        """Fold in one view of each object and decode."""
        folded, hidden = self.fold(images, azimuths, hidden)
        return Reconstructed(self.decode(folded.features), folded.latent), hidden
