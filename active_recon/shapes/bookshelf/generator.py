"""Bookshelves: bookcases, cube grids, étagères, ladders, steps, racks and wall shelves."""

from collections.abc import Callable

from active_recon.shapes.bookshelf import cases
from active_recon.shapes.bookshelf import open as open_ones
from active_recon.shapes.common.drawing import choose
from active_recon.shapes.common.parts import assemble, Mesh
import numpy as np

_MAKERS: dict[Callable[[np.random.Generator], list[Mesh]], float] = {
    cases.bookcase: 0.34, cases.cubes: 0.13, cases.cupboard: 0.08, cases.tapered: 0.06,
    cases.steps: 0.05, cases.wall_unit: 0.04, open_ones.etagere: 0.08, open_ones.ladder: 0.07,
    open_ones.zigzag: 0.04, open_ones.corner: 0.04, open_ones.wall_shelves: 0.04,
    open_ones.spine: 0.03}


def bookshelf(rng: np.random.Generator) -> Mesh:
    """Return a random bookshelf, with or without books; its open side is at +x."""
    return assemble(choose(rng, _MAKERS)(rng))
