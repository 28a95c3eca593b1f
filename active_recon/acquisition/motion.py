"""Limits of the camera's motion."""

from collections.abc import Sequence
from dataclasses import dataclass
import math

from active_recon.errors import ConfigError
from active_recon.geometry.cameras import azimuth_difference, AZIMUTHS, TURN, wrap_azimuth
import numpy as np
from numpy.typing import ArrayLike, NDArray

END_TOLERANCE = 1e-4
"""Azimuths this close to a limit are within it, radians, since limits are written rounded."""
_ROUNDING = 1e-9


@dataclass(frozen=True)
class MotionLimits:
    """
    The azimuths that a turntable or an arm can reach, radians in the object frame.

    - azimuth_range: low and high, counter-clockwise from low to high, both included; it may cross
      0, as (5.5, 1.0) and (-0.8, 1.0) do; a whole turn is no limit
    - forbidden_sectors: low, high, low, high, ..., each as a range; the ends are forbidden too
    - reachable_azimuths: the only azimuths allowed; empty allows any

    Raises ConfigError on invalid values, and where all of them together allow no azimuth.
    """

    azimuth_range: Sequence[float] = (0.0, TURN)
    forbidden_sectors: Sequence[float] = ()
    reachable_azimuths: Sequence[float] = ()

    def __post_init__(self) -> None:
        """Reject invalid values, and limits that allow no azimuth."""
        if len(self.azimuth_range) != 2 or not _are_sectors(self.azimuth_range):
            raise ConfigError('azimuth_range: not a range: expected low and high, two azimuths '
                              f'that differ, rad, got {list(self.azimuth_range)}')
        if not _are_sectors(self.forbidden_sectors):
            raise ConfigError('forbidden_sectors: not sectors: expected pairs of low and high, '
                              f'rad, that differ, got {list(self.forbidden_sectors)}')
        if not np.isfinite(self.reachable_azimuths).all():
            raise ConfigError('reachable_azimuths: not finite: expected azimuths, rad, got '
                              f'{list(self.reachable_azimuths)}')
        if not self.allows(self.candidates(AZIMUTHS)).any():
            raise ConfigError(
                'azimuth_range, forbidden_sectors, reachable_azimuths: no azimuth left: expected '
                'one where the camera can go, but together they leave none')

    def allows(self, azimuths: ArrayLike) -> NDArray[np.bool_]:
        """Return for each azimuth whether the camera can go there."""
        asked = np.asarray(azimuths, np.float64)
        low, high = self.azimuth_range
        allowed = _within(asked, low, high, END_TOLERANCE)
        for low, high in self._sectors:
            allowed &= ~_within(asked, low, high, _ROUNDING)
        if self.reachable_azimuths:
            away = np.abs(azimuth_difference(asked[..., None], self.reachable_azimuths))
            allowed &= away.min(axis=-1) <= END_TOLERANCE
        return allowed

    def candidates(self, grid: NDArray[np.float64]) -> NDArray[np.float64]:
        """
        Return the azimuths from which a goal is chosen, (N,) in [0, 2 pi).

        They are `reachable_azimuths` where given, else the grid of azimuths (M,) and the middle of
        every free interval that contains none of them. Azimuths of the grid that cannot be
        reached are included; see `allows`.
        """
        if self.reachable_azimuths:
            listed = np.unique([wrap_azimuth(azimuth) for azimuth in self.reachable_azimuths])
            apart = np.diff(listed, append=listed[:1] + TURN)
            return listed[apart > END_TOLERANCE]  # each once, in whatever turn it is told
        free = grid[self.allows(grid)]
        middles = [middle for low, width in self._stretches()
                   if self.allows(middle := wrap_azimuth(low + width / 2))
                   and not ((free - low) % TURN <= width).any()]
        return np.append(grid, middles)

    def way(self, azimuth: float, goals: ArrayLike) -> NDArray[np.float64]:
        """
        Return how far it is around the object from an azimuth to each of N others, radians (N,).

        It is the shorter of the two ways that leaves `azimuth_range` nowhere and crosses no
        forbidden sector; where neither does, the shorter.
        """
        onward = (np.asarray(goals, np.float64) - azimuth) % TURN
        back = (TURN - onward) % TURN
        ways = np.stack([onward, back])
        free = ~np.stack([self._is_barred(azimuth, onward),
                          self._is_barred(azimuth - back, back)])
        return np.asarray(np.where(free | ~free.any(axis=0), ways, np.inf).min(axis=0))

    def _is_barred(self, start: ArrayLike, width: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return whether any of the ways counter-clockwise from a start is barred, (N,)."""
        barred = np.zeros(width.shape, np.bool_)
        low, high = self.azimuth_range
        behind = high, TURN - _width(low, high)
        for low, whole in [*((low, _width(low, high)) for low, high in self._sectors), behind]:
            low, breadth = low + END_TOLERANCE, whole - 2 * END_TOLERANCE
            begins_inside = (np.asarray(start) - low) % TURN < breadth
            barred |= (breadth > 0) & (begins_inside | ((low - np.asarray(start)) % TURN < width))
        return barred

    @property
    def _sectors(self) -> list[tuple[float, float]]:
        return list(zip(self.forbidden_sectors[::2], self.forbidden_sectors[1::2], strict=True))

    def _stretches(self) -> list[tuple[float, float]]:
        """Return the start and the width of each interval between consecutive limits."""
        low, high = self.azimuth_range
        ends = [] if _width(low, high) == TURN else [low, high]
        marks = np.unique([wrap_azimuth(end) for end in (*ends, *self.forbidden_sectors)])
        widths = np.diff(marks, append=marks[:1] + TURN)
        return list(zip(marks.tolist(), widths.tolist(), strict=True))


def _are_sectors(ends: Sequence[float]) -> bool:
    """Whether these are pairs of finite azimuths that differ."""
    return (len(ends) % 2 == 0 and all(map(math.isfinite, ends))
            and all(low != high for low, high in zip(ends[::2], ends[1::2], strict=True)))


def _within(azimuths: NDArray[np.float64], low: float, high: float,
            tolerance: float) -> NDArray[np.bool_]:
    return np.asarray(
        (azimuths - low + tolerance) % TURN <= _width(low, high) + 2 * tolerance)


def _width(low: float, high: float) -> float:
    """Return the angle counter-clockwise from low to high, (0, 2 pi]."""
    return TURN if high - low >= TURN else (high - low) % TURN or TURN
