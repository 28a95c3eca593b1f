"""Bookshelves built as boxes: bookcases, cube grids, cupboards below, steps, wall units."""

from collections.abc import Sequence

from active_recon.shapes.bookshelf.loads import draw_load, fill, Load
from active_recon.shapes.cabinet import layouts
from active_recon.shapes.cabinet.bays import Bay, carcass, columns, doors, rows
from active_recon.shapes.cabinet.fronts import fronts, left_open
from active_recon.shapes.cabinet.style import draw_style, Style
from active_recon.shapes.cabinet.trims import base, lift, top
from active_recon.shapes.common.parts import box, Mesh, mirrored, prism
from active_recon.shapes.table.legs import Room
import numpy as np

_BASES = 'none none plinth plinth skirting blocks brackets square tapered buns'
_TOPS = 'flush flush slab slab cornice gallery pediment'


def _block(rng: np.random.Generator, style: Style, load: Load, bays: Sequence[Bay], rear: float,
           front: float, backed: bool) -> list[Mesh]:
    """Return a carcass with the fronts of its closed bays and the load of its open ones."""
    parts = carcass(bays, rear, front, style.board, style.body, style.inside if backed else None)
    parts += fronts(rng, style, list(bays), front, front - rear)
    for bay in bays:
        if bay.kind == 'open':
            parts += fill(rng, load, bay, rear + 0.5 * style.board * backed,
                          front - 0.03 * (front - rear), style.board)
    return parts


def _size(rng: np.random.Generator) -> Room:
    """Return the size of a bookcase: tall, narrow, square, or low and long."""
    low, high = {'tall': ((0.6, 1.1), (1.6, 2.2)), 'tower': ((0.25, 0.5), (1.2, 2.1)),
                 'middle': ((0.6, 1.3), (0.8, 1.4)), 'low': ((0.9, 1.9), (0.45, 0.85)),
                 'wide': ((1.3, 2.4), (1.6, 2.3))}[
        rng.choice(['tall', 'tower', 'middle', 'low', 'wide'], p=[0.4, 0.14, 0.24, 0.12, 0.1])]
    return Room(rng.uniform(0.23, 0.42), rng.uniform(*low), rng.uniform(*high))


def _shelves(rng: np.random.Generator, face: Bay) -> list[Bay]:
    """Return the bays of a bookcase: even or graded shelves, columns, broken dividers."""
    count = int(np.clip(round(face.height / rng.uniform(0.26, 0.42)), 1, 8))
    across = max(1, round(face.width / rng.uniform(0.55, 1.1)))
    most = max(1, int(face.width / 0.24))
    kind = rng.choice(['even', 'graded', 'columns', 'broken'], p=[0.5, 0.2, 0.15, 0.15])
    if kind == 'columns':
        shares = rng.uniform(0.6, 1.4, min(most, max(2, across)))
        shares = np.minimum(shares, shares[::-1])
        return [bay for column in columns(face, shares.tolist())
                for bay in rows(column, int(rng.integers(max(1, count - 1), count + 2)))]
    if kind == 'broken':
        return [bay for row in rows(face, count)
                for bay in columns(row, rng.uniform(0.5, 1.5, min(most, int(rng.integers(
                    1, max(2, across) + 2)))).tolist())]
    shares = np.geomspace(1, rng.uniform(0.5, 0.85) if kind == 'graded' else 1, count)
    return [bay for row in rows(face, shares.tolist()) for bay in columns(row, across)]


def bookcase(rng: np.random.Generator) -> list[Mesh]:
    """Return a plain bookcase, perhaps with a few closed bays, with a back or without one."""
    room = _size(rng)
    style, load = draw_style(rng, max(room)), draw_load(rng)
    stand = rng.choice(_BASES.split())
    under, half, x = min(lift(rng, stand), 0.3 * room.height), style.board / 2, room.depth / 2
    face = Bay(half - room.width / 2, room.width / 2 - half, under + half, room.height - half)
    bays = _shelves(rng, face)
    closed = rng.choice([0.0, 0.1, 0.4], p=[0.75, 0.15, 0.1])
    bays = [bay._replace(kind='drawer' if bay.height < 0.6 * bay.width else 'door', side=1)
            if rng.random() < closed else bay for bay in bays]
    crown = rng.choice(_TOPS.split())
    return [*_block(rng, style, load, bays, -x, x, rng.random() < 0.72),
            *base(rng, stand, room._replace(height=under), style.board, style.body, style.body),
            *top(rng, crown, room, style.board, (style.top, style.body))]


def cubes(rng: np.random.Generator) -> list[Mesh]:
    """Return a grid of square bays, some with doors, drawers or boxes; seldom one is missing."""
    across, up = int(rng.integers(1, 6)), int(rng.integers(1, 6))
    if across * up == 1:
        up = 3
    cell, depth = rng.uniform(0.3, 0.42), rng.uniform(0.28, 0.42)
    style, load = draw_style(rng, max(across, up) * cell), draw_load(rng)
    stand = rng.choice(['none', 'none', 'none', 'plinth', 'castors', 'square', 'blocks'])
    under, half, x = lift(rng, stand), style.board / 2, depth / 2
    y = across * cell / 2
    face = Bay(-y, y, under + half, under + half + up * cell)
    bays = [bay for row in rows(face, up) for bay in columns(row, across)]
    closed = rng.choice([0.0, 0.2, 0.45], p=[0.6, 0.25, 0.15])
    kind = rng.choice(['door', 'drawer'])
    bays = [bay._replace(kind=kind, side=1) if rng.random() < closed else bay for bay in bays]
    parts = _block(rng, style, load, left_open(rng, bays), -x, x, rng.random() < 0.45)
    outer = style.board * rng.choice([0, 0.4])
    if outer:  # a frame thicker than the dividers
        high = face.high + half
        parts += [mirrored(box([-x, y, under], [x, y + half + outer, high + outer], style.body)),
                  box([-x, -y - half, high - half], [x, y + half, high + outer], style.body)]
    return parts + base(rng, stand, Room(depth, 2 * y + style.board, under), style.board,
                        style.body, style.top)


def cupboard(rng: np.random.Generator) -> list[Mesh]:
    """Return a bookcase over doors or drawers, which often stand further out."""
    room = Room(rng.uniform(0.3, 0.48), rng.uniform(0.7, 1.8), rng.uniform(1.6, 2.3))
    style, load = draw_style(rng, max(room)), draw_load(rng)
    stand = rng.choice(['none', 'plinth', 'skirting', 'blocks', 'brackets', 'buns'])
    under, waist = lift(rng, stand), room.height * rng.uniform(0.22, 0.42)
    half, x = style.board / 2, room.depth / 2
    front = x - room.depth * rng.choice([0, 0.2, 0.35])
    count = max(1, round(room.width / rng.uniform(0.4, 0.6)))
    face = Bay(half - room.width / 2, room.width / 2 - half, under + half, waist)
    closed = doors(face, count) if rng.random() < 0.6 else layouts.sideboard(rng, face)
    upper = _shelves(rng, face._replace(low=waist, high=room.height - half))
    backed = rng.random() < 0.85
    parts = [*_block(rng, style, load, closed, -x, x, True),
             *_block(rng, style, load, upper, -x, front, backed)]
    if front < x:
        parts.append(box([-x, -room.width / 2 - half, waist - half],
                         [x + half, room.width / 2 + half, waist + half], style.top))
    crown = top(rng, rng.choice(_TOPS.split()), room._replace(depth=front + x), style.board,
                (style.top, style.body))
    for part in crown:
        part.apply_translation([(front - x) / 2, 0, 0])
    return [*parts, *crown, *base(rng, stand, room._replace(height=under), style.board,
                                  style.body, style.body)]


def tapered(rng: np.random.Generator) -> list[Mesh]:
    """Return shelves between two sides that narrow upwards, straight or in a curve."""
    room = Room(rng.uniform(0.32, 0.5), rng.uniform(0.4, 1.2), rng.uniform(0.8, 1.9))
    style, load = draw_style(rng, max(room)), draw_load(rng)
    board, x, y = style.board, room.depth / 2, room.width / 2
    head, bend = rng.uniform(0.35, 0.7), rng.choice([0.6, 1.0, 1.0, 2.0])
    both = rng.random() < 0.35  # an A from the side, else upright behind
    levels = np.linspace(0, 1, 9)
    out = x * (1 - (1 - head) * (2 - both) * levels ** bend)
    rear = -out if both else np.full(9, -x)
    side = np.vstack([np.column_stack([out, room.height * levels]),
                      np.column_stack([rear, room.height * levels])[::-1]])
    parts = [mirrored(prism(side, y - board, y, 'y', style.body))]
    count = max(2, round(room.height / rng.uniform(0.26, 0.4)))
    heights = np.linspace(rng.uniform(0.03, 0.15), rng.choice([0.96, 0.75]), count + 1)
    half = board / 2
    for low, high in zip(heights[:-1], heights[1:], strict=True):
        bay = Bay(half - y, y - half, low * room.height, high * room.height)
        near, far = (float(np.interp(low, levels, edge)) for edge in (rear, out))
        parts.append(box([near, -y + half, bay.low - half], [far, y - half, bay.low + half],
                         style.top))
        parts += fill(rng, load, bay, float(np.interp(high, levels, rear)),
                      float(np.interp(high, levels, out)), board)
    last = float(heights[-1])
    near, far = (float(np.interp(last, levels, edge)) for edge in (rear, out))
    parts.append(box([near, -y + half, last * room.height - half],
                     [far, y - half, last * room.height + half], style.top))
    if not both and rng.random() < 0.6:
        parts.append(box([-x, -y + half, heights[0] * room.height],
                         [-x + board, y - half, last * room.height], style.inside))
    return parts


def steps(rng: np.random.Generator) -> list[Mesh]:
    """Return columns of bays whose heights rise to one side, or to the middle."""
    count, cell = int(rng.integers(3, 6)), rng.uniform(0.3, 0.4)
    heights = np.arange(1, count + 1)
    if rng.random() < 0.3:
        heights = np.minimum(heights, heights[::-1]) + int(rng.integers(0, 2))
    elif rng.random() < 0.5:
        heights = heights[::-1]
    style, load = draw_style(rng, count * cell), draw_load(rng)
    x, y, half = rng.uniform(0.13, 0.2), count * cell / 2, style.board / 2
    bays = [bay for column, levels in zip(columns(Bay(-y, y, half, 1.0), count), heights,
                                          strict=True)
            for bay in rows(column._replace(high=half + cell * float(levels)), int(levels))]
    return _block(rng, style, load, bays, -x, x, rng.random() < 0.6)


def wall_unit(rng: np.random.Generator) -> list[Mesh]:
    """Return two bookcases with a bridge above, and below a low unit or shelves further back."""
    width, height, depth = rng.uniform(1.8, 2.8), rng.uniform(1.5, 2.2), rng.uniform(0.3, 0.45)
    style, load = draw_style(rng, max(width, height)), draw_load(rng)
    half, x, y = style.board / 2, depth / 2, width / 2
    tower = width * rng.uniform(0.18, 0.3)
    left = Bay(half - y, tower - y, half, height - half)
    count = int(rng.integers(3, 7))
    bays = rows(left, count)
    if rng.random() < 0.5:
        bays[0] = bays[0]._replace(kind='door', side=1)
    bays += [bay._replace(left=-bay.right, right=-bay.left, side=-bay.side) for bay in bays]
    middle = Bay(left.right, -left.right, half, height * rng.uniform(0.18, 0.3))
    bays += layouts.media(rng, middle)
    shelf = middle._replace(low=height * rng.uniform(0.76, 0.86), high=height - half)
    bays += columns(shelf, int(rng.integers(1, 4)))
    parts = _block(rng, style, load, bays, -x, x, True)
    if rng.random() < 0.3:
        parts.append(box([-x, middle.left, middle.high], [-x + style.board, middle.right,
                                                          shelf.low], style.inside))
    return parts
