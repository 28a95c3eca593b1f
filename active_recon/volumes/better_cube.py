"""Whether a cube is too wide for what was found in it, or off its middle, and what would fit."""

from collections.abc import Iterable
from dataclasses import dataclass
import math

from active_recon.volumes.object_box import object_box
from active_recon.volumes.voxels import VoxelGrid
import numpy as np
from numpy.typing import NDArray

FILLED = 0.85
"""Share of the cube's side below which what was found is small; see benchmarks/cube_sizes.py."""
OFF_CENTRE = 0.1
"""How far the middle of what was found may be from the cube's, in longest sides of it."""
FEWEST_VIEWS = 3
"""Views from which the extent of what was found can be trusted."""
_CENTRED = 0.05  # the same where the cube has to change anyway
_HOVERING = 0.03  # share of the occupied cells, up to which what lies apart is not the object


@dataclass(frozen=True)
class BetterCube:
    """
    The cube that fits what was found in another.

    - share: the longest side of what was found, relative to the cube that it was found in
    - side, centre: of the cube that fits, metres, in the object frame
    """

    share: float
    side: float
    centre: tuple[float, float, float]

    @property
    def warning(self) -> str:
        """The warning in words, for who sets the parameters of nodes."""
        moved = ''
        if max(map(abs, self.centre)) > _CENTRED * self.side:
            place = ', '.join(f'{value:g}' for value in np.round(self.centre, 4) + 0.0)
            moved = f', with the origin of the object frame moved to ({place}) m'
        return f'{self.reason}: object_size {self.side:.3g} fits it{moved}'

    @property
    def warning_of_bag(self) -> str:
        """The same for who has a bag, with the option of `replay`."""
        return (f'{self.warning}; to replay the bag in that cube: --box '
                f'{box_text(self.centre, self.side)}')

    @property
    def reason(self) -> str:
        """The first part of the warning: what is wrong with the cube at hand."""
        return ('the object ' + (f'fills {self.share:.0%} of the side' if self.share < FILLED
                                 else 'is not in the middle')
                + ' of its cube, which costs accuracy')


def box_text(centre: Iterable[float], side: float) -> str:
    """Return a cube as `--box` takes it: x, y, z of its centre and its side."""
    decimals = 4 - math.floor(math.log10(side))
    return ','.join(f'{value:.15g}' for value in np.round((*centre, side), decimals) + 0.0)


def better_cube(grid: VoxelGrid, threshold: float, views: int) -> BetterCube | None:
    """
    Return the cube that fits what so many views found; None where the one at hand does.

    None too after fewer than FEWEST_VIEWS, and where nothing is found.
    """
    occupied = grid.occupied(threshold)
    if views < FEWEST_VIEWS or not occupied.any() or _fits(_box(occupied)):
        return None
    box = object_box(occupied)
    if box is None or _fits(box):
        return None
    x, y, z = (box.mean(axis=0) * grid.size).tolist()
    share = _share(box)
    return BetterCube(share, share * grid.size, (x, y, z))


def _share(box: NDArray[np.float64]) -> float:
    return float(np.ptp(box, axis=0).max())


def _fits(box: NDArray[np.float64]) -> bool:
    """Return whether a cube fits a box in it, (2, 3), in sides of the cube from its centre."""
    share = _share(box)
    return bool(share >= FILLED and np.abs(box.mean(axis=0)).max() <= OFF_CENTRE * share)


def _box(occupied: NDArray[np.bool_]) -> NDArray[np.float64]:
    """
    Return a box of occupied cells as `object_box` that of the object, but at once.

    Few cells that an empty layer of the grid separates from all others are left out.
    """
    left, few, ends = occupied, _HOVERING * np.count_nonzero(occupied), []
    for axis, others in enumerate(((1, 2), (0, 2), (0, 1))):
        in_layer = np.count_nonzero(left, axis=others)
        layers = np.flatnonzero(in_layer)
        parts = np.split(layers, np.flatnonzero(np.diff(layers) > 1) + 1)
        counts = [in_layer[part].sum() for part in parts]
        kept = [part for part, count in zip(parts, counts, strict=True)
                if count > few or count == max(counts)]
        ends.append((kept[0][0], kept[-1][-1] + 1))
        left = left.take(range(*ends[-1]), axis)
    return np.array(ends).T / len(occupied) - 0.5
