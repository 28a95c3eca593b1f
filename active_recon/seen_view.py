"""What an observer of the loop saw of one view."""

from dataclasses import dataclass

from active_recon.volumes.voxels import VoxelGrid
import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class SeenView:
    """
    One view of the loop and what came of it.

    `azimuth` in radians, `image` (H, W, 3) uint8 RGB or None where it was not heard, `occupied`
    the cells that the reconstructor holds for occupied, `entropy` in nats, `iou` against the
    truth, `latency` in seconds from the image's stamp until the occupancy was received.
    """

    number: int
    azimuth: float
    image: NDArray[np.uint8] | None
    occupied: VoxelGrid
    entropy: float
    iou: float
    latency: float
