"""What runs a network: state in, state out. Torch is one runtime among several."""

from typing import Any, Protocol

from active_recon.models.network import ReconstructionNetwork
import numpy as np
from numpy.typing import NDArray
import torch

_Array = NDArray[np.float32]


class Runtime(Protocol):
    """Runs a reconstruction network for one object, view by view."""

    def initial_state(self) -> Any:
        """Return the state before any view."""
        ...

    def step(self, image: NDArray[np.uint8], azimuth: float,
             state: Any) -> tuple[_Array, _Array, Any]:
        """
        Fold in an image of the canonical camera, (64, 64, 3) uint8 RGB, at an azimuth, radians.

        Returns the occupancy (X, Y, Z) in [0, 1], A_t (C, h, w), and the next state.
        """
        ...


class TorchRuntime:
    """The network in torch, on the device where its weights lie."""

    def __init__(self, network: ReconstructionNetwork) -> None:
        self._network = network
        self._device = next(network.parameters()).device

    def initial_state(self) -> None:
        """Return the state before any view: none."""

    @torch.inference_mode()
    def step(self, image: NDArray[np.uint8], azimuth: float,
             state: Any) -> tuple[_Array, _Array, Any]:
        """Fold in an image; see Runtime."""
        batch = torch.from_numpy(image).to(self._device).permute(2, 0, 1)[None].float() / 255
        at = torch.tensor([azimuth], dtype=torch.float32, device=self._device)
        seen, state = self._network(batch, at, state)
        return (seen.logits[0].sigmoid().cpu().numpy(), seen.latent[0].cpu().numpy(), state)
