"""The paper's reconstruction network with the camera's pose as a further input: any camera."""

from dataclasses import dataclass

from active_recon.models.border import seen_pixels
from active_recon.models.encoder import group_norm
from active_recon.models.encoder import IMAGE_SIZE as ENCODED_SIZE
from active_recon.models.network import Cameras, ReconstructionNetwork, State
from active_recon.models.network_2d3d import Network2d3d, Network2d3dConfig
from active_recon.models.network_2d3d import SIZES as SIZES_2D3D
import torch
from torch import nn, Tensor
from torch.nn import functional

CAMERA_NUMBERS = 11
"""Numbers that describe a camera; see `camera_numbers`."""


@dataclass(frozen=True)
class Network2d3dPosedConfig(Network2d3dConfig):
    """Sizes of the 2D-3D network, and the channels of the camera's features."""

    camera_channels: int = 64


SIZES = {name: Network2d3dPosedConfig(**config.to_dict())
         for name, config in SIZES_2D3D.items()}


def camera_numbers(cameras: Cameras, image_size: int) -> Tensor:
    """
    Return a description of cameras (B, ...), (B, 11) float32.

    In the frame of the object: the direction from its centre to the camera (3) and the log of
    their distance in sides of the grid, the optical axis (3) and the image's upward axis (3); and
    the log of the focal length in sides of the image.
    """
    poses = cameras.poses
    position = poses[:, :3, 3]
    distance = position.norm(dim=1, keepdim=True)
    focal = cameras.intrinsics[:, :1, 0] / image_size
    return torch.cat([position / distance, distance.log(), poses[:, :3, 2], -poses[:, :3, 1],
                      focal.log()], dim=1).float()


class Network2d3dPosed(ReconstructionNetwork):
    """
    The 2D-3D network told of each view's camera: what it can do without lifting.

    It takes the framed images of any camera and predicts in the frame of their poses, as the
    lifting network does. The camera's features are joined to those of the image before the
    encoder's memory: which cells a pixel shows has to be learned for every camera. The state is
    that of the 2D-3D network.
    """

    image_size, resolution, needs_front = 2 * ENCODED_SIZE, Network2d3d.resolution, False

    def __init__(self, network: Network2d3d, image_features: int, camera_channels: int) -> None:
        super().__init__()
        self.network = network
        self.camera = nn.Sequential(
            nn.Linear(CAMERA_NUMBERS, camera_channels), nn.ReLU(),
            nn.Linear(camera_channels, camera_channels), nn.ReLU())
        self.join = nn.Sequential(
            nn.Conv2d(image_features + camera_channels, image_features, 3, padding=1),
            group_norm(image_features), nn.LeakyReLU(0.1))

    @classmethod
    def from_config(cls, config: Network2d3dPosedConfig) -> 'Network2d3dPosed':
        """Build the network of a configuration, with fresh weights."""
        network = Network2d3d.from_config(config, image_channels=4)
        return cls(network, config.block_channels[-1], config.camera_channels)

    def initial_state(self, batch: int) -> State:
        """Return the state before any view: zeros."""
        return self.network.initial_state(batch)

    def encode(self, images: Tensor, cameras: Cameras) -> Tensor:
        """Return the features of images (B, 3 or 4, 128, 128), (B, F, 4, 4)."""
        shown = torch.cat([images[:, :3], seen_pixels(images)], dim=1)
        return self.network.encode(functional.avg_pool2d(shown, 2), cameras)

    def update(self, encoded: Tensor, cameras: Cameras, state: State) -> State:
        """Return the state updated by the images' features and their cameras."""
        camera = self.camera(camera_numbers(cameras, self.image_size))[:, :, None, None]
        joined = torch.cat([encoded, camera.expand(-1, -1, *encoded.shape[2:])], dim=1)
        return self.network.update(self.join(joined), cameras, state)

    def decode(self, state: State) -> Tensor:
        """Return the occupancy's logits, (B, 32, 32, 32)."""
        return self.network.decode(state)
