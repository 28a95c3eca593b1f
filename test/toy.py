"""
A network that uses pose and intrinsics, and a policy that scores candidates on a sphere.

`python toy.py NODE --ros-args ...` runs a node of the package that knows both.
"""

from dataclasses import dataclass
from importlib import import_module
import sys

from active_recon.config import Config, LossConfig
from active_recon.geometry.view_distance import pose_directions
from active_recon.models.network import ReconstructionNetwork
from active_recon.models.registry import NetworkEntry, NETWORKS
from active_recon.policies import Choice, POLICIES, PolicyEntry
from active_recon.policies.geometric import HeuristicPolicy
import numpy as np
import torch
from torch import nn
from torch.nn import functional


@dataclass(frozen=True)
class ToyConfig(Config):
    """The toy's only size."""

    gain: float = 8.0


class Toy(ReconstructionNetwork):
    """A cell is as full as the lightest of the pixels where the views show it is dark."""

    image_size, resolution, needs_front = 48, 32, False

    def __init__(self, gain):
        super().__init__()
        self.gain = nn.Parameter(torch.tensor([gain, -gain / 2]))

    def initial_state(self, batch):
        return {'dark': torch.ones(batch, 32, 32, 32), 'latent': torch.zeros(batch, 1, 4, 4)}

    def encode(self, images, cameras):
        return 1 - images[:, :3].mean(dim=1, keepdim=True)

    def update(self, encoded, cameras, state):
        place = (torch.arange(32, dtype=torch.float64) + 0.5) / 32 - 0.5
        cells = torch.cartesian_prod(place, place, place)
        rotation, position = cameras.poses[:, :3, :3], cameras.poses[:, :3, 3:]
        optical = rotation.mT @ (cells.T - position)  # (B, 3, cells)
        pixels = (cameras.intrinsics @ optical).float()
        at = pixels[:, :2] / pixels[:, 2:] * (2 / self.image_size) - 1
        dark = functional.grid_sample(encoded, at.mT[:, None], align_corners=False)
        dark = torch.minimum(state['dark'], dark.reshape(-1, 32, 32, 32))
        return {'dark': dark, 'latent': functional.adaptive_avg_pool2d(dark.mean(1), 4)[:, None]}

    def decode(self, state):
        return self.gain[0] * state['dark'] + self.gain[1]


class Opposite(HeuristicPolicy):
    """The candidate that is farthest from the mean direction of the views taken."""

    def choose(self, seen, state):
        mean = pose_directions(seen.taken).mean(axis=1, keepdims=True)
        return Choice(-(pose_directions(seen.candidates) * mean).sum(2).astype(np.float32)), state


ENTRY = NetworkEntry(ToyConfig, lambda config: Toy(config.gain), {'small': ToyConfig()},
                     LossConfig(volume_weight=1, silhouette_weight=0, volume_loss='bce'))
POLICY = PolicyEntry(lambda options: Opposite())

if __name__ == '__main__':
    NETWORKS['toy'] = ENTRY
    POLICIES['opposite'] = POLICY
    node = sys.argv.pop(1)
    import_module(f'active_recon.nodes.{node}').main()
