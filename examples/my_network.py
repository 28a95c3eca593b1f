"""
A network of your own, as small as it can be.

    active-recon train data/train --validation data/val --model examples/my_network.py:Net
"""

from dataclasses import dataclass

from active_recon.config import Config
from active_recon.models.network import Cameras, ReconstructionNetwork, State
import torch
from torch import nn, Tensor


@dataclass(frozen=True)
class Sizes(Config):
    """What is written beside the weights, and read with them."""

    channels: int = 16


class Net(ReconstructionNetwork):
    """The strongest features of all views, and one layer that makes a shape of them."""

    image_size, resolution, needs_front = 64, 32, True
    Config = Sizes

    def __init__(self, config: Sizes) -> None:
        super().__init__()
        self.look = nn.Sequential(nn.Conv2d(3, config.channels, 8, 8), nn.ReLU(),
                                  nn.Conv2d(config.channels, config.channels, 2, 2))  # 4 x 4
        self.shape = nn.Linear(16 * config.channels, self.resolution ** 3)

    def initial_state(self, batch: int) -> State:
        latent = torch.zeros(batch, self.look[-1].out_channels, 4, 4, device=self.device)
        return {'latent': latent}

    def encode(self, images: Tensor, cameras: Cameras) -> Tensor:
        return self.look(images)

    def update(self, encoded: Tensor, cameras: Cameras, state: State) -> State:
        return {'latent': torch.maximum(state['latent'], encoded)}

    def decode(self, state: State) -> Tensor:
        return self.shape(state['latent'].flatten(1)).reshape(-1, *(self.resolution,) * 3)
