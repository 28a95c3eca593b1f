"""Means with their intervals, as `active-recon evaluate` prints them."""

from collections.abc import Sequence
from typing import Any


def difference(figures: dict[str, Any]) -> str:
    """Return the differences of two policies or models, after each view and in area, in words."""
    after = '  '.join(spread(values) for values in figures['iou'])
    return f'{after}   area {spread(figures["auc"], 4)}'


def spread(values: dict[str, float], digits: int = 3) -> str:
    """Return a mean with its interval's ends, in words."""
    return f'{values["mean"]:.{digits}f} [{values["low"]:.{digits}f}, {values["high"]:.{digits}f}]'


def line(name: str, values: Sequence[dict[str, float]]) -> str:
    """Return a named row of means with their intervals."""
    return f'{name:>14}: ' + '  '.join(spread(value) for value in values)
