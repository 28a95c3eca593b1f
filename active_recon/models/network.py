"""The interface of reconstruction networks: views in one by one, occupancy after every view."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from itertools import chain
from typing import NamedTuple, Self

from active_recon.geometry.cameras import Camera, TURN
from active_recon.geometry.canonical import NetworkSpec
import numpy as np
import torch
from torch import nn, Tensor

State = dict[str, Tensor]
"""A network's state for B objects: named tensors, (B, ...) each; one of them is `latent`."""


def init_occupancy_bias(bias: Tensor | None) -> None:
    """
    Initialise the bias of a last layer, which gives logits, to p = 0.1.

    Most of a grid is empty: this start saves the first thousand steps.
    """
    assert bias is not None
    nn.init.constant_(bias, -2.2)


class Cameras(NamedTuple):
    """
    The cameras of images, one each.

    - poses: (..., 4, 4) float64, object from optical frame; lengths count in sides of the grid
    - intrinsics: (..., 3, 3) float64, K in pixels of the image that the network gets
    """

    poses: Tensor
    intrinsics: Tensor

    @classmethod
    def of(cls, cameras: Sequence[Camera]) -> Self:
        """Return a batch of cameras, whose distances count in sides of the grid, (N, ...)."""
        return cls(torch.from_numpy(np.stack([camera.pose for camera in cameras])),
                   torch.from_numpy(np.stack([camera.intrinsics.matrix for camera in cameras])))

    @property
    def azimuths(self) -> Tensor:
        """Azimuths, (...) float32, radians in [0, 2 pi): all that the paper's family uses."""
        angle = torch.atan2(self.poses[..., 1, 3], self.poses[..., 0, 3])
        return torch.remainder(angle, TURN).float()

    def rows(self, *index: Tensor | int | slice) -> Self:
        """Return some of the cameras, by an index of the axes before the last two."""
        return type(self)(self.poses[index], self.intrinsics[index])

    def turned(self, yaws: Tensor) -> Self:
        """Return the cameras turned counter-clockwise about +z, radians (...)."""
        yaws = yaws.double()
        turn = torch.zeros(*yaws.shape, 4, 4, dtype=torch.float64)
        turn[..., 0, 0] = turn[..., 1, 1] = yaws.cos()
        turn[..., 1, 0] = yaws.sin()
        turn[..., 0, 1] = -yaws.sin()
        turn[..., 2, 2] = turn[..., 3, 3] = 1
        return type(self)(turn.to(self.poses) @ self.poses, self.intrinsics)

    def to(self, device: torch.device | str) -> Self:
        """Return the cameras on a device."""
        return type(self)(self.poses.to(device), self.intrinsics.to(device))


class ReconstructionNetwork(nn.Module, ABC):
    """
    The interface of all networks of the registry; the state is passed in and returned.

    - images: (B, 3, S, S) in [0, 1], S the `image_size`; their cameras: (B, ...). One that needs
      no front also takes a fourth channel: 1 where the camera's image has that pixel, else 0
    - state: (B, ...) named tensors; `initial_state` gives the first, `update` the next one

    Encoding an image, updating the state and decoding it are separate: training decodes only
    after one view of a sequence, and a search over many sequences of the same views encodes each
    view once.
    """

    image_size: int
    """S, pixels a side of the images."""
    resolution: int
    """R, cells a side of the occupancy."""
    needs_front: bool
    """Whether it predicts with the front at +x, from canonical cameras; else from any camera."""
    runs_in_torch_alone: str = ''
    """Why it cannot be exported as graphs, in words; '' where it can."""

    @property
    def spec(self) -> NetworkSpec:
        """The images that it takes, and the resolution that it predicts at."""
        return NetworkSpec(self.image_size, self.resolution, self.needs_front)

    @property
    def device(self) -> torch.device:
        """The device of its parameters, or of its buffers where it has no parameters."""
        held = next(chain(self.parameters(), self.buffers()), None)
        return torch.device('cpu') if held is None else held.device

    @abstractmethod
    def initial_state(self, batch: int) -> State:
        """Return the state before any view of so many objects, on the network's device."""

    @abstractmethod
    def encode(self, images: Tensor, cameras: Cameras) -> Tensor:
        """Return the encoding of each image, (B, ...); it does not depend on the state."""

    @abstractmethod
    def update(self, encoded: Tensor, cameras: Cameras, state: State) -> State:
        """
        Return the state updated by one encoded image of each object, (B, ...).

        Its `latent`, (B, C, h, w), is the input of a view policy.
        """

    @abstractmethod
    def decode(self, state: State) -> Tensor:
        """Return the occupancy's logits, (B, R, R, R), indexed [x, y, z]."""

    def step(self, images: Tensor, cameras: Cameras, state: State) -> State:
        """Encode one view of each object, and return the updated state."""
        return self.update(self.encode(images, cameras), cameras, state)

    def objective(self, state: State, voxels: Tensor) -> Tensor | None:
        """
        Return a loss of the network's own kind against voxels (B, R, R, R), or None.

        None is for networks that learn from the losses of section 3.2, as most do.
        """
        return None

    def forward(self, images: Tensor, cameras: Cameras, state: State) -> tuple[Tensor, State]:
        """Encode, update and decode one view of each object: logits (B, R, R, R) and the state."""
        state = self.step(images, cameras, state)
        return self.decode(state), state
