"""Bookshelves: bookcases, cube grids, étagères, ladders, steps, racks and wall shelves."""

from collections.abc import Callable

from active_recon.shapes.bookshelf import cases
from active_recon.shapes.bookshelf import open as open_ones
from active_recon.shapes.common.parts import assemble, Mesh
import numpy as np

_MAKERS: list[tuple[float, Callable[[np.random.Generator], list[Mesh]]]] = [
    (0.34, cases.bookcase), (0.13, cases.cubes), (0.08, cases.cupboard), (0.06, cases.tapered),
    (0.05, cases.steps), (0.04, cases.wall_unit), (0.08, open_ones.etagere),
    (0.07, open_ones.ladder), (0.04, open_ones.zigzag), (0.04, open_ones.corner),
    (0.04, open_ones.wall_shelves), (0.03, open_ones.spine)]


def bookshelf(rng: np.random.Generator) -> Mesh:
    """Return a random bookshelf, with or without books; its open side is at +x."""
    chances, makers = zip(*_MAKERS, strict=True)
    return assemble(makers[rng.choice(len(makers), p=chances)](rng))
