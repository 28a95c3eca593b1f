"""The plane that an object stands on, and what of a cube is above it."""

from dataclasses import dataclass, replace

from active_recon.photos.cube import Cube
from active_recon.volumes.voxels import cell_centers
import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Ground:
    """
    The plane `normal @ x = level` of the cameras' world, in its units; objects are above it.

    - normal: what is up, (3,), of length 1
    """

    normal: NDArray[np.float64]
    level: float

    def height(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return how high points, (..., 3), are above the plane, (...)."""
        return np.asarray(points @ self.normal - self.level)

    def above(self, cube: Cube, side: int) -> NDArray[np.bool_]:
        """Return the cells of a cube, (side, side, side), that reach above the plane."""
        normal = cube.rotation @ self.normal * cube.side  # in sides of the cube
        tops = cell_centers(side) @ normal + np.abs(normal).sum() / (2 * side)
        return np.asarray(self.height(cube.centre) + tops > 0).reshape(side, side, side)

    def within(self, cube: Cube) -> 'Ground':
        """Return the plane in the object frame of a cube, lengths in sides of the cube."""
        return Ground(cube.rotation @ self.normal, -float(self.height(cube.centre)) / cube.side)

    def under(self, cube: Cube) -> Cube:
        """Return the cube, moved along the normal until its lowest corner is on the plane."""
        reach = np.abs(cube.rotation @ self.normal).sum() * cube.side / 2
        raised = reach - float(self.height(cube.centre))
        return replace(cube, centre=cube.centre + raised * self.normal)


BOARD_GROUND = Ground(np.array([0.0, 0.0, 1.0]), 0.0)
"""The printed face of a board, in the board's world."""


def no_table(ground: Ground | None) -> str:
    """Return what to try where nothing is found above a table: it may be the object's lid."""
    return '' if ground in (None, BOARD_GROUND) else (
        '; or, if what was taken for a table is the object, leave it out by --no-ground')
