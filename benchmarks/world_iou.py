"""IoU in the world, whatever the cube of a reconstruction."""

from typing import Any

from active_recon.volumes.voxelisation import voxelise
from active_recon.volumes.voxels import cell_centers, iou
import numpy as np
from numpy.typing import NDArray

_CELLS = 128


def iou_around(occupied: NDArray[np.bool_], world_from_cube: NDArray[np.float64],
               mesh: Any) -> float:
    """
    Return the IoU with a mesh about the origin, in a cube twice as wide as its longest side.

    Takes cells (R, R, R) of the unit cube about the origin, and the similarity, (4, 4), that
    carries it into the mesh's world.
    """
    side = 2 * float(mesh.extents.max())
    placed = mesh.copy()
    placed.apply_scale(1 / side)
    points = np.c_[cell_centers(_CELLS) * side, np.ones(_CELLS ** 3)]
    at = np.floor(((points @ np.linalg.inv(world_from_cube).T)[:, :3] + 0.5)
                  * len(occupied)).astype(int)
    inside = ((at >= 0) & (at < len(occupied))).all(axis=1)
    found = np.zeros(_CELLS ** 3, np.bool_)
    found[inside] = occupied[tuple(at[inside].T)]
    return float(iou(found.reshape((_CELLS,) * 3), voxelise(placed, _CELLS).occupied(0.5)))
