"""A view of the loop, and its result, as the page, the demo's table and its picture show it."""

from dataclasses import dataclass

from active_recon.geometry.cameras import Camera
from active_recon.quality.quality import Quality
from active_recon.volumes.voxels import VoxelGrid
import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class ViewResult:
    """
    A view that the reconstructor took, and its result; None where it is not known.

    - stamp: nanoseconds
    - image: (H, W, 3) uint8 RGB, at most 160 pixels wide and high; where the camera's was missed,
      that which the network received
    - entropy: of the reconstruction after the view, nats
    - latency: from the image's stamp until the occupancy was received, seconds
    - occupied: the occupied cells after the view; iou: theirs with the true object
    - quality: as the reconstructor judges it
    """

    stamp: int
    camera: Camera
    image: NDArray[np.uint8] | None = None
    entropy: float | None = None
    latency: float | None = None
    occupied: VoxelGrid | None = None
    iou: float | None = None
    quality: Quality | None = None


@dataclass(frozen=True, eq=False)
class Surface:
    """
    The object's surface in colours.

    - triangles: (F, 3, 3), metres; colors: of their corners, (F, 3, 3) uint8 RGB
    """

    triangles: NDArray[np.floating]
    colors: NDArray[np.uint8]
