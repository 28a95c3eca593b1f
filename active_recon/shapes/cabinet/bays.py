"""The face of a piece of furniture cut into bays, and the boards and blocks behind them."""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

from active_recon.shapes.common.parts import box, Color, Mesh
import numpy as np

HOLLOW = ('open', 'ajar')  # kinds of bay that one can look into


class Bay(NamedTuple):
    """A rectangle of the face, metres, between the centre lines of the boards round it."""

    left: float  # the lower y
    right: float
    low: float  # z
    high: float
    kind: str = 'open'  # or drawer, pulled, door, ajar, glass, mirror, sliding
    side: int = 0  # where a door's handle is: at its left (-1) or right (1)

    @property
    def width(self) -> float:
        return self.right - self.left

    @property
    def height(self) -> float:
        return self.high - self.low


def columns(bay: Bay, shares: Sequence[float] | int) -> list[Bay]:
    """Cut a bay upright into columns by their shares of its width, or into equal ones."""
    cuts = _cuts(bay.left, bay.right, shares)
    return [bay._replace(left=a, right=b) for a, b in zip(cuts[:-1], cuts[1:], strict=True)]


def rows(bay: Bay, shares: Sequence[float] | int) -> list[Bay]:
    """Cut a bay across into rows, the lowest first, by their shares of its height."""
    cuts = _cuts(bay.low, bay.high, shares)
    return [bay._replace(low=a, high=b) for a, b in zip(cuts[:-1], cuts[1:], strict=True)]


def _cuts(low: float, high: float, shares: Sequence[float] | int) -> list[float]:
    parts = np.ones(shares) if isinstance(shares, int) else np.asarray(shares, np.float64)
    ends = np.cumsum(parts) / parts.sum()
    return [low, *(low + (high - low) * float(end) for end in ends)]


def doors(bay: Bay, count: int, kind: str = 'door') -> list[Bay]:
    """Cut a bay into doors that open in pairs; the handle of a single one is at its right."""
    leaves = columns(bay, count)
    return [leaf._replace(kind=kind, side=-1 if i % 2 else 1) for i, leaf in enumerate(leaves)]


def carcass(bays: Iterable[Bay], rear: float, front: float, board: float, color: Color,
            back: Color | None) -> list[Mesh]:
    """Return what stands between x = rear and x = front: closed bays solid, open ones boarded."""
    half, parts = board / 2, []
    for bay in bays:
        if bay.kind in HOLLOW:
            parts += niche(bay, rear, front, board, color, back)
        else:
            parts.append(box([rear, bay.left - half, bay.low - half],
                             [front, bay.right + half, bay.high + half], color))
    return parts


def niche(bay: Bay, rear: float, front: float, board: float, color: Color,
          back: Color | None) -> list[Mesh]:
    """Return the four boards round an open bay and, in a colour of its own, its back."""
    half = board / 2
    left, right, low, high = bay.left - half, bay.right + half, bay.low - half, bay.high + half
    parts = [box([rear, left, low], [front, right, low + board], color),
             box([rear, left, high - board], [front, right, high], color),
             box([rear, left, low], [front, left + board, high], color),
             box([rear, right - board, low], [front, right, high], color)]
    if back is not None:
        parts.append(box([rear, bay.left, bay.low], [rear + board, bay.right, bay.high], back))
    return parts
