"""A model and the hidden state of one episode: the core of the reconstructor's node."""

from dataclasses import dataclass
import math
from pathlib import Path

from active_recon.cameras import Camera
from active_recon.canonical import canonical_image
from active_recon.errors import ConfigError
from active_recon.models.runtime import Runtime, TorchRuntime
from active_recon.models.weights import config_hash, load_weights, weights_hash
from active_recon.voxels import turned, VoxelGrid
import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Reconstruction:
    """What is known after a view: the grid in the object frame, and A_t, (C, h, w) float32."""

    grid: VoxelGrid
    latent: NDArray[np.float32]


class Reconstructor:
    """
    Folds views of one object into its reconstruction.

    `object_size` is the side of the voxel grid in metres, `object_yaw` the azimuth of the
    object's front in the object frame, radians: the network predicts with the front at +x.
    """

    def __init__(self, runtime: Runtime, threshold: float, object_size: float = 1.0,
                 object_yaw: float = 0.0, weights_hash: str = '', config_hash: str = '') -> None:
        if not object_size > 0:
            raise ConfigError(f'object_size: expected metres above 0, got {object_size}')
        if not math.isfinite(object_yaw):
            raise ConfigError(f'object_yaw: expected finite radians, got {object_yaw}')
        self._own_threshold = threshold
        self.set_threshold(threshold)
        self.object_size = object_size
        self.object_yaw = object_yaw
        self.weights_hash = weights_hash
        self.config_hash = config_hash
        self._runtime = runtime
        self.reset()

    @classmethod
    def load(cls, weights: Path | None = None, device: str = 'cpu', object_size: float = 1.0,
             object_yaw: float = 0.0, threshold: float | None = None) -> 'Reconstructor':
        """Read weights (None: those that ship); raises WeightsError and ConfigError."""
        bundle = load_weights(weights, device)
        reconstructor = cls(TorchRuntime(bundle.reconstruction), bundle.threshold, object_size,
                            object_yaw, weights_hash(weights), config_hash(bundle.config))
        reconstructor.set_threshold(threshold)
        return reconstructor

    @property
    def view_count(self) -> int:
        """Views folded in since the episode began."""
        return self._view_count

    def set_threshold(self, threshold: float | None) -> None:
        """Set the occupancy above which a cell is occupied, None for the weights' own."""
        threshold = self._own_threshold if threshold is None else threshold
        if not 0 < threshold < 1:
            raise ConfigError(f'threshold: expected a probability in (0, 1), got {threshold}')
        self.threshold = threshold

    def reset(self) -> None:
        """Forget the episode."""
        self._state = self._runtime.initial_state()
        self._view_count = 0

    def add_view(self, image: NDArray[np.uint8], camera: Camera) -> Reconstruction:
        """
        Fold in one view: an image (H, W, 3) uint8 RGB and its camera in the object frame.

        Raises ViewError, and then nothing has changed.
        """
        network_image = canonical_image(image, camera, self.object_size)
        occupancy, latent, self._state = self._runtime.step(
            network_image, camera.azimuth - self.object_yaw, self._state)
        self._view_count += 1
        return Reconstruction(VoxelGrid(turned(occupancy, self.object_yaw), self.object_size),
                              latent)
