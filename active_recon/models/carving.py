"""Carving: what no silhouette rules out, with nothing learned; what networks are held against."""

from dataclasses import dataclass

from active_recon.config import Config
from active_recon.errors import ConfigError
from active_recon.models.border import foreground
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
    """By how many pixels silhouettes are dilated: a cell is touched before its centre is."""

    dilation: int = 0  # the best on validation

    def __post_init__(self) -> None:
        """Refuse what is no number of pixels."""
        if not 0 <= self.dilation <= 16:
            raise ConfigError(f'CarvingConfig: expected a dilation from 0 to 16 pixels, got '
                              f'{self.dilation}')


SIZES = {'small': CarvingConfig(), 'published': CarvingConfig()}


def carve_nothing(network: 'Carving', voxels: Tensor, categories: NDArray[np.str_]) -> None:
    """Learn nothing from voxels (N, R, R, R) and categories (N,): there is nothing to fit."""


class Carving(ReconstructionNetwork):
    """
    The visual hull: cells whose centre lies outside a dilated silhouette in any view are empty.

    The silhouette is what is not background, and the background is what the image's border shows:
    it takes one plain colour behind the object, or a background that was taken away before. What a
    camera did not see rules nothing out. The state is the least share of the foreground at each
    cell's projection, (B, 64, 64, 64), 1 before any view.
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
        """Return the state before any view: all may be full."""
        side = (self.resolution,) * 3
        return {'least': torch.ones(batch, *side, device=self.device),
                'latent': torch.ones(batch, 1, _LATENT_SIDE, _LATENT_SIDE, device=self.device)}

    def encode(self, images: Tensor, cameras: Cameras) -> Tensor:
        """Return what is not background, (B, 1, 128, 128) in [0, 1]; 1 where nothing was seen."""
        shares = foreground(images)
        reach = self._dilation
        return functional.max_pool2d(shares, 2 * reach + 1, 1, reach)

    def update(self, encoded: Tensor, cameras: Cameras, state: State) -> State:
        """Carve by one more silhouette of each object."""
        where, depth = projected(projection(cameras, IMAGE_SIZE), self.resolution)
        # Zeros come in beyond the image, where nothing is ruled out
        found = sampled(encoded.float() - 1, where)[:, 0] + 1  # (B, N)
        found = torch.where(depth > 0, found, 1).reshape(state['least'].shape)
        least = torch.minimum(state['least'], found)
        latent = functional.adaptive_avg_pool2d(least.mean(dim=3)[:, None], _LATENT_SIDE)
        return {'least': least, 'latent': latent}

    def decode(self, state: State) -> Tensor:
        """Return the occupancy's logits, (B, 64, 64, 64)."""
        return (state['least'] - 0.5) * self.slope
