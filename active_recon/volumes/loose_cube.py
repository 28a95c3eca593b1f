"""Whether a cube is too wide for what was found in it, and what cube would fit."""

from dataclasses import dataclass

from active_recon.volumes.voxels import VoxelGrid
import numpy as np
from numpy.typing import NDArray

FILLED = 0.85
"""Share of the cube's side below which what was found is small; see benchmarks/cube_sizes.py."""
FEWEST_VIEWS = 3
"""Views from which the extent of what was found can be trusted."""
_CENTRED = 0.05  # of the side of a cube that fits: less is in its middle


@dataclass(frozen=True)
class LooseCube:
    """
    A cube that is wider than the object.

    - share: the longest side of what was found, relative to the cube's
    - side, centre: of the cube that fits it, metres, in the object frame
    """

    share: float
    side: float
    centre: tuple[float, float, float]

    @property
    def warning(self) -> str:
        """The warning in words, for who sets the parameters of nodes."""
        moved = ''
        if max(map(abs, self.centre)) > _CENTRED * self.side:
            place = ', '.join(f'{np.round(value, 4):g}' for value in self.centre)
            moved = f', with the origin of the object frame moved to ({place}) m'
        return f'{self.cost}: object_size {self.side:.3g} fits it{moved}'

    @property
    def cost(self) -> str:
        """The first part of the warning: what is wrong."""
        return f'the object fills {self.share:.0%} of the side of its cube, which costs accuracy'


def loose_cube(grid: VoxelGrid, threshold: float, views: int) -> LooseCube | None:
    """Return what fits better, if what so many views found is small in the cube; else None."""
    occupied = grid.occupied(threshold)
    if views < FEWEST_VIEWS or not occupied.any():
        return None
    box = _box(occupied)
    share = float(np.ptp(box, axis=0).max())
    if share >= FILLED:
        return None
    x, y, z = (box.mean(axis=0) * grid.size).tolist()
    return LooseCube(share, share * grid.size, (x, y, z))


def _box(occupied: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return the box of all occupied cells, (2, 3), in sides of the cube from its centre."""
    ends = []
    for axis in range(3):
        slices = np.flatnonzero(occupied.any(axis=tuple({0, 1, 2} - {axis})))
        ends.append((slices[0], slices[-1] + 1))
    return np.array(ends, np.float64).T / len(occupied) - 0.5
