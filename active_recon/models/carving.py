"""Carving: what no silhouette rules out, with nothing learned; what networks are held against."""

from dataclasses import dataclass

from active_recon.config import Config
from active_recon.errors import ConfigError
from active_recon.models.border import foreground, largest_around
from active_recon.models.lifted import projected, projection, sampled
from active_recon.models.lifting_encoder import IMAGE_SIZE
from active_recon.models.network import Cameras, ReconstructionNetwork, State
import numpy as np
from numpy.typing import NDArray
import torch
from torch import Tensor
from torch.nn import functional

_LATENT_SIDE = 4


@dataclass(frozen=True)
class CarvingConfig(Config):
    """The dilation of silhouettes, in pixels: a cell is seen before its centre is."""

    dilation: int = 0  # the best on validation

    def __post_init__(self) -> None:
        """Reject an invalid number of pixels."""
        if not 0 <= self.dilation <= 16:
            raise ConfigError('CarvingConfig: invalid dilation: expected 0 to 16 pixels, got '
                              f'{self.dilation}')


SIZES = {'small': CarvingConfig(), 'published': CarvingConfig()}


def carve_nothing(network: 'Carving', voxels: Tensor, categories: NDArray[np.str_]) -> None:
    """Fit nothing to voxels (N, R, R, R) and categories (N,): the network has no parameters."""


class Carving(ReconstructionNetwork):
    """
    The visual hull: cells whose centre lies outside a dilated silhouette in any view are empty.

    The silhouette is what differs from the image's border, so the background must have one plain
    colour, or be removed before. Cells that a camera does not see stay as they are. The state is
    the lowest foreground probability at each cell's projection, (B, 64, 64, 64), 1 before any
    view.
    """

    image_size, resolution, needs_front = IMAGE_SIZE, 64, False

    def __init__(self, dilation: int) -> None:
        super().__init__()
        self._dilation = dilation
        self.slope: Tensor  # of the logits over the share of the foreground
        self.register_buffer('slope', torch.tensor(8.0))

    @classmethod
    def from_config(cls, config: CarvingConfig) -> 'Carving':
        """Build the network of a configuration."""
        return cls(config.dilation)

    def initial_state(self, batch: int) -> State:
        """Return the state before any view: every cell may be occupied."""
        side = (self.resolution,) * 3
        return {'least': torch.ones(batch, *side, device=self.device),
                'latent': torch.ones(batch, 1, _LATENT_SIDE, _LATENT_SIDE, device=self.device)}

    def encode(self, images: Tensor, cameras: Cameras) -> Tensor:
        """Return the dilated foreground, (B, 1, 128, 128) in [0, 1]; 1 where nothing was seen."""
        return largest_around(foreground(images), 2 * self._dilation + 1)

    def update(self, encoded: Tensor, cameras: Cameras, state: State) -> State:
        """Return the state carved by one more silhouette of each object."""
        where, depth = projected(projection(cameras, IMAGE_SIZE), self.resolution)
        # Outside the image samples are 0, so that nothing is carved there
        found = sampled(encoded.float() - 1, where)[:, 0] + 1  # (B, N)
        found = torch.where(depth > 0, found, 1).reshape(state['least'].shape)
        least = torch.minimum(state['least'], found)
        latent = functional.adaptive_avg_pool2d(least.mean(dim=3)[:, None], _LATENT_SIDE)
        return {'least': least, 'latent': latent}

    def decode(self, state: State) -> Tensor:
        """Return the occupancy's logits, (B, 64, 64, 64)."""
        return (state['least'] - 0.5) * self.slope
