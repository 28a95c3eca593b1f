"""Contact sheets: many objects or training images in one image, for inspection."""

from collections.abc import Sequence
import math

from active_recon.geometry.cameras import CANONICAL_INTRINSICS, orbit_camera
from active_recon.volumes.rendering import composite, Renderer
import numpy as np
from numpy.typing import NDArray
from torch import Tensor
import trimesh


def contact_sheet(meshes: Sequence[trimesh.Trimesh], columns: int = 8, azimuth: float = 0.6,
                  tile: int = 160, background: int = 255) -> NDArray[np.uint8]:
    """
    Return renderings of meshes from one azimuth (radians) in rows of `columns`.

    Tiles have `tile` pixels a side: (rows x tile, columns x tile, 3) uint8 RGB.
    """
    camera = orbit_camera(azimuth, intrinsics=CANONICAL_INTRINSICS.resized(tile, tile))
    rows = math.ceil(len(meshes) / columns)
    sheet = np.full((rows * tile, columns * tile, 3), background, np.uint8)
    for index, mesh in enumerate(meshes):
        top, left = index // columns * tile, index % columns * tile
        image = Renderer(mesh).render(camera)
        sheet[top:top + tile, left:left + tile] = composite(image, background)
    return sheet


def sequence_sheet(images: Tensor) -> NDArray[np.uint8]:
    """Return sequences of views (T, B, 3, S, S) in [0, 1] as rows, (B x S, T x S, 3) uint8 RGB."""
    length, count, _, side, _ = images.shape
    rows = images.permute(1, 3, 0, 4, 2).reshape(count * side, length * side, 3)
    return np.asarray((rows * 255).round().byte())
