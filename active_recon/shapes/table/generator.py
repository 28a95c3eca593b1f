"""Tables: dining, coffee, side, console and bar tables, desks, workbenches, picnic tables."""

from collections.abc import Callable
import math

from active_recon.shapes.common.materials import fabric, glass, metal, paint, plastic, wood
from active_recon.shapes.common.parts import assemble, beam, box, Color, loft, Mesh, superellipse
from active_recon.shapes.table import bases as table_bases
from active_recon.shapes.table import legs as table_legs
from active_recon.shapes.table.desks import bench_table, cabinet_table, desk
from active_recon.shapes.table.legs import Room
import numpy as np
from numpy.typing import NDArray

# Metres: ranges of the depth (x), the width (y) and the height.
_SIZES = {
    'dining': ((0.7, 1.1), (1.0, 2.3), (0.68, 0.8)),
    'coffee': ((0.45, 0.9), (0.7, 1.4), (0.28, 0.5)),
    'side': ((0.32, 0.6), (0.32, 0.65), (0.4, 0.7)),
    'console': ((0.25, 0.45), (0.8, 1.6), (0.7, 0.95)),
    'bar': ((0.5, 0.75), (0.5, 1.4), (0.9, 1.15)),
}
_BASES: list[tuple[float, Callable[[np.random.Generator, Room, Color, Color], Mesh]]] = [
    (0.42, table_legs.legs), (0.05, table_legs.three_legs), (0.14, table_bases.pedestal),
    (0.15, table_bases.trestle), (0.1, table_bases.panels), (0.05, table_bases.drum),
    (0.04, table_bases.cage), (0.05, table_bases.crossed)]


def table(rng: np.random.Generator) -> Mesh:
    """Return a random table; a desk's sitter is at +x, other tables are long along y."""
    special = rng.random()
    if special < 0.2:
        return desk(rng)
    if special < 0.26:
        return bench_table(rng)
    if special < 0.31:
        return cabinet_table(rng)
    kind = rng.choice(list(_SIZES), p=[0.36, 0.26, 0.18, 0.1, 0.1])
    depth, width, height = (rng.uniform(*limits) for limits in _SIZES[kind])
    if kind != 'console' and rng.random() < 0.35:
        width = depth = (depth + width) / 2  # round and square tops
    color, body, accent = _colors(rng)
    thick = max(depth, width) * rng.choice([0.025, 0.035, 0.05, 0.09], p=[0.35, 0.35, 0.2, 0.1])
    outline, filled = _outline(rng, depth, width)
    top = _top(rng, outline, height, thick, color, accent)
    inset = filled * rng.uniform(0.8, 1)
    room = Room(depth * inset, width * inset, height - thick * 0.9)
    chances, bases = zip(*_BASES, strict=True)
    base = bases[rng.choice(len(bases), p=chances)]
    if base in (table_bases.cage, table_legs.three_legs) and width > 1.5 * depth:
        base = table_legs.legs
    return assemble([top, base(rng, room, body, accent)])


def _colors(rng: np.random.Generator) -> tuple[Color, Color, Color]:
    """Return the colours of the top, the base and the details."""
    top = [wood, wood, wood, paint, plastic, glass, metal, fabric][rng.integers(8)](rng)
    body = top if rng.random() < 0.35 else [wood, metal, metal, paint][rng.integers(4)](rng)
    accent = [top, body, wood(rng), metal(rng), paint(rng)][rng.integers(5)]
    return top, body, accent


def _outline(rng: np.random.Generator, depth: float,
             width: float) -> tuple[NDArray[np.float64], float]:
    """Return a top's outline, (N, 2), and the share of its box that legs at corners may fill."""
    kind = rng.choice(['rectangle', 'rounded', 'ellipse', 'polygon', 'boat', 'clipped'],
                      p=[0.42, 0.18, 0.24, 0.06, 0.05, 0.05])
    half = np.array([depth, width]) / 2
    if kind == 'rounded':
        return superellipse(depth, width, rng.uniform(3.5, 9), 28), 0.85
    if kind == 'ellipse':
        return superellipse(depth, width, 2, 28), 0.68
    if kind == 'polygon':
        count = int(rng.choice([6, 8]))
        angles = (np.arange(count) + rng.choice([0, 0.5])) * 2 * math.pi / count
        return np.column_stack([np.cos(angles), np.sin(angles)]) * half, 0.68
    if kind == 'boat':
        y = np.linspace(-1, 1, 9)
        x = 1 - rng.uniform(0.15, 0.4) * y ** 2
        sides = np.vstack([np.column_stack([x, y]), np.column_stack([-x, y])[::-1]])
        return sides * half, 0.75
    if kind == 'clipped':
        cut = min(half) * rng.uniform(0.2, 0.5)
        x, y = half
        corner = np.array([[x, y - cut], [x - cut, y]])
        return np.vstack([corner, corner[::-1] * [-1, 1], -corner, corner[::-1] * [1, -1]]), 0.8
    return np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) * half, 1.0


def _slab(outline: NDArray[np.float64], low: float, high: float, color: Color,
          low_scale: float = 1.0) -> Mesh:
    loops = [np.column_stack([outline * scale, np.full(len(outline), z)])
             for scale, z in ((low_scale, low), (1.0, high))]
    return loft(loops, color)


def _top(rng: np.random.Generator, outline: NDArray[np.float64], height: float, thick: float,
         color: Color, accent: Color) -> Mesh:
    """Return the top, its upper side at height: plain, bevelled, planked, inlaid, or a tray."""
    low = height - thick
    kind = rng.choice(['plain', 'bevelled', 'inlaid', 'edged', 'planks', 'tray', 'gap'],
                      p=[0.42, 0.12, 0.12, 0.1, 0.12, 0.06, 0.06])
    if kind == 'planks' and len(outline) == 4:
        return _planks(rng, outline[0], low, height, color)
    if kind == 'bevelled':
        return _slab(outline, low, height, color, rng.uniform(0.85, 0.96))
    if kind == 'inlaid':
        inner = _slab(outline * rng.uniform(0.6, 0.92), height - thick / 2, height + thick * 0.08,
                      accent)
        return assemble([_slab(outline, low, height, color), inner])
    if kind == 'edged':
        return assemble([_slab(outline * 0.99, low + thick / 2, height, color),
                         _slab(outline, low, height - thick * 0.2, accent)])
    if kind == 'tray':
        rim, rise = [], height + thick * rng.uniform(0.6, 2)
        closed = np.vstack([outline, outline[:1]]) * 0.98
        for start, end in zip(closed[:-1], closed[1:], strict=True):
            middle = (low + rise) / 2
            rim.append(beam([*start, middle], [*end, middle], thick * 0.6, accent, rise - low))
        return assemble([_slab(outline * 0.98, low, height, color), *rim])
    if kind == 'gap':  # a pane carried clear of a lower board by short studs
        pane = _slab(outline, height - thick * 0.4, height, color)
        board = _slab(outline * 0.9, low, height - thick * 0.3, accent)
        return assemble([pane, board])
    return _slab(outline, low, height, color)


def _planks(rng: np.random.Generator, corner: NDArray[np.float64], low: float, high: float,
            color: Color) -> Mesh:
    """Return boards side by side on battens, each in a shade of its own."""
    x, y = corner
    count = int(rng.integers(3, 8))
    gap = rng.choice([0, 0.1, 0.25]) * 2 * x / count
    edges = np.linspace(-x, x, count + 1)
    boards = [box([a + gap / 2, -y, low + (high - low) * 0.2], [b - gap / 2, y, high],
                  np.asarray(color) * rng.uniform(0.8, 1.1))
              for a, b in zip(edges[:-1], edges[1:], strict=True)]
    battens = [box([-x, s - y * 0.1, low], [x, s + y * 0.1, (low + high) / 2], color)
               for s in (-0.75 * y, 0.0, 0.75 * y)]
    return assemble([*boards, *battens])
