"""Cabinets put together from several: dressers, stairs, living-room walls, basins, mirrors."""

from dataclasses import replace

from active_recon.shapes.cabinet import layouts, shaped
from active_recon.shapes.cabinet.bays import Bay, columns, doors, rows
from active_recon.shapes.cabinet.fronts import fronted
from active_recon.shapes.cabinet.style import draw_style, Style
from active_recon.shapes.cabinet.trims import base, lift, top
from active_recon.shapes.common.materials import glass, metal, plastic
from active_recon.shapes.common.parts import (
    assemble,
    box,
    lathe,
    Mesh,
    mirrored,
    rod,
    tube,
)
from active_recon.shapes.table.legs import Room
import numpy as np


def special(rng: np.random.Generator) -> Mesh:
    """Return a cabinet of one of the rarer builds."""
    makers = [dresser, dresser, stairs, composition, basin, mirrored_chest, shaped.corner,
              shaped.bowed, shaped.bureau]
    return assemble(makers[rng.integers(len(makers))](rng))


def dresser(rng: np.random.Generator) -> list[Mesh]:
    """Return a deep lower cabinet with a shallow upper one: open, glazed or with doors."""
    width, height, depth = rng.uniform(0.7, 1.7), rng.uniform(1.6, 2.2), rng.uniform(0.4, 0.55)
    style = draw_style(rng, height)
    stand = rng.choice(['none', 'plinth', 'skirting', 'buns', 'brackets', 'tapered'])
    under, waist = lift(rng, stand), height * rng.uniform(0.36, 0.5)
    half, x = style.board / 2, depth / 2
    face = Bay(half - width / 2, width / 2 - half, under + half, waist - half)
    front = -x + depth * rng.uniform(0.55, 0.85)
    gap = rng.choice([0, rng.uniform(0.1, 0.25)])
    parts = fronted(rng, style, layouts.sideboard(rng, face), -x, x)
    parts += top(rng, 'slab', Room(depth, width, waist), style.board, (style.top, style.body))
    inset = rng.choice([0, 0, 1]) * style.board
    head = face._replace(low=waist + gap + half, high=height - half, left=face.left + inset,
                         right=face.right - inset)
    kind = rng.choice(['open', 'glass', 'door', 'flanked'])
    count = max(1, round(width / rng.uniform(0.4, 0.6)))
    if kind == 'open':
        bays = [b for row in rows(head, int(rng.integers(2, 4)))
                for b in columns(row, int(rng.choice([1, 1, count])))]
    elif kind == 'flanked':
        left, middle, right = columns(head, [1, rng.uniform(0.8, 2), 1])
        bays = [*doors(left, 1), *rows(middle, int(rng.integers(2, 4))),
                right._replace(kind='door', side=-1)]
    else:
        bays = doors(head, count, kind)
    parts += fronted(rng, style, bays, -x, front)
    if gap:  # the upper cabinet stands on its back and its sides
        parts += [box([-x, head.left - half, waist - half], [-x + style.board, head.right + half,
                                                             head.low], style.inside),
                  mirrored(box([-x, head.right - half, waist - half],
                               [front, head.right + half, head.low], style.body))]
    upper = Room(front + x, width - 2 * inset, height)
    crown = top(rng, rng.choice(['flush', 'slab', 'cornice', 'cornice', 'pediment']), upper,
                style.board, (style.top, style.body))
    for part in crown:
        part.apply_translation([(front - x) / 2, 0, 0])
    return [*parts, *crown, *base(rng, stand, Room(depth, width, under), style.board, style.body,
                                  style.top)]


def stairs(rng: np.random.Generator) -> list[Mesh]:
    """Return columns of boxes that rise like steps to one side."""
    count, depth = int(rng.integers(3, 6)), rng.uniform(0.3, 0.5)
    size, rise = rng.uniform(0.28, 0.45), rng.uniform(0.25, 0.4)
    style = draw_style(rng, count * max(size, rise))
    half, parts = style.board / 2, []
    tallest = count * size / 2
    for index, column in enumerate(columns(Bay(-tallest, tallest, half, rise + half), count)):
        levels = index + 1
        kinds = rng.choice(['drawer', 'drawer', 'door', 'open'], levels)
        cells = rows(column._replace(high=levels * rise + half), levels)
        parts += fronted(rng, style, [cell._replace(kind=kind, side=1) for cell, kind in zip(
            cells, kinds, strict=True)], -depth / 2, depth / 2)
        parts.append(box([-depth / 2, column.left - half, cells[-1].high],
                         [depth / 2 + half, column.right + half, cells[-1].high + style.board],
                         style.top))
    if rng.random() < 0.5:
        parts = [_flipped(part) for part in parts]
    return parts


def _flipped(part: Mesh) -> Mesh:
    """Return a part's mirror image in the plane y = 0."""
    part.apply_transform(np.diag([1.0, -1.0, 1.0, 1.0]))
    return part


def composition(rng: np.random.Generator) -> list[Mesh]:
    """Return a wall of living-room units: a low one with towers at one end or both."""
    depth, low, high = rng.uniform(0.35, 0.5), rng.uniform(0.35, 0.6), rng.uniform(1.1, 2.0)
    tower, width = rng.uniform(0.4, 0.7), rng.uniform(1.6, 2.6)
    style = draw_style(rng, max(width, high))
    half, x, y = style.board / 2, depth / 2, width / 2
    both, bridge = rng.random() < 0.5, rng.random() < 0.4
    left = Bay(-y, tower - y, half, high)
    right = Bay(y - tower, y, half, high if both else rng.uniform(low, high))
    middle = Bay(left.right, right.left, half, low)
    parts = fronted(rng, style, layouts.media(rng, middle), -x, x)
    shallow = x - depth * rng.choice([0, 0.25])
    upright = _tower(rng, left)
    parts += fronted(rng, style, upright, -x, shallow)
    other = [b._replace(left=-b.right, right=-b.left, side=-b.side) for b in upright]
    parts += fronted(rng, style, other if both else _tower(rng, right), -x, shallow)
    if bridge and both:
        bridged = middle._replace(low=high - rng.uniform(0.25, 0.4), high=high)
        kind = rng.choice(['open', 'door', 'glass'])
        parts += fronted(rng, style, doors(bridged, int(rng.integers(1, 4)), kind), -x,
                        shallow - 0.1 * depth)
    if rng.random() < 0.4:
        parts.append(box([-x, middle.left, low], [-x + style.board, middle.right,
                                                  min(high, right.high) * 0.97], style.inside))
    return parts


def _tower(rng: np.random.Generator, bay: Bay) -> list[Bay]:
    if bay.height < 0.9:
        return layouts.bedside(rng, bay)
    kind = rng.integers(3)
    if kind == 0:
        return rows(bay, int(rng.integers(3, 6)))
    low, high = rows(bay, [rng.uniform(0.6, 1.2), 1])
    if kind == 1:
        return [*doors(low, 1), *doors(high, 1, 'glass')]
    return [*layouts.drawers(low, int(rng.integers(2, 4))), *rows(high, int(rng.integers(1, 4)))]


def basin(rng: np.random.Generator) -> list[Mesh]:
    """Return a washstand: a basin with its tap on a cabinet, perhaps with a mirror above."""
    width, height, depth = rng.uniform(0.5, 1.4), rng.uniform(0.75, 0.9), rng.uniform(0.4, 0.55)
    shelf = rng.random() < 0.3
    tall = height + (rng.uniform(0.7, 1.0) if shelf else 0.15)
    style = draw_style(rng, max(width, tall))
    stand = rng.choice(['none', 'plinth', 'square', 'blocks'])
    under = lift(rng, stand)
    x, half, board = depth / 2, style.board / 2, style.board
    face = Bay(half - width / 2, width / 2 - half, under + half, height - 2 * board)
    parts = fronted(rng, style, layouts.kitchen(rng, face), -x, x)
    china, steel = np.full(3, rng.uniform(215, 250)), metal(rng)
    parts.append(box([-x, -width / 2 - half, height - 2.2 * board],
                     [x + board, width / 2 + half, height - board], plastic(rng)))
    spots = [-width / 4, width / 4] if width > 1.1 else [0.0]
    radius = min(0.2, depth * 0.4, width / 2.5)
    for y in spots:
        bowl = [[radius * 0.7, 0], [radius, 0.1], [radius * 0.88, 0.1], [radius * 0.6, 0.035]]
        parts.append(lathe(bowl, china, [0.02, y, height - 1.3 * board], 16))
        spout = np.array([-radius - 0.015, y, height - board - 0.02])
        parts.append(tube([spout, spout + [0, 0, 0.16], spout + [0.11, 0, 0.17]],
                          max(0.012, board * 0.4), steel, 8))
    if shelf:
        parts += _mirror(rng, style, -x, width * rng.uniform(0.35, 0.5), height - board, tall)
    return parts + base(rng, stand, Room(depth, width, under), board, style.body, style.top)


def mirrored_chest(rng: np.random.Generator) -> list[Mesh]:
    """Return a chest of drawers that carries a mirror."""
    width, height, depth = rng.uniform(0.7, 1.5), rng.uniform(0.65, 0.9), rng.uniform(0.38, 0.5)
    tall = height + rng.uniform(0.5, 0.9)
    style = draw_style(rng, max(width, tall))
    stand = rng.choice(['none', 'plinth', 'tapered', 'square', 'buns', 'brackets'])
    under, half = lift(rng, stand), style.board / 2
    face = Bay(half - width / 2, width / 2 - half, under + half, height - half)
    style = replace(style, face=rng.choice(['slab', 'raised']))
    return [*fronted(rng, style, layouts.chest(rng, face), -depth / 2, depth / 2),
            *top(rng, 'slab', Room(depth, width, height), style.board, (style.top, style.body)),
            *_mirror(rng, style, -depth / 2, width * rng.uniform(0.28, 0.45), height, tall),
            *base(rng, stand, Room(depth, width, under), style.board, style.body, style.top)]


def _mirror(rng: np.random.Generator, style: Style, x: float, y: float, low: float,
            high: float) -> list[Mesh]:
    """Return a framed mirror upright on the rear edge x, y wide to each side, round or square."""
    board, pane = style.board, glass(rng) * 1.2
    if rng.random() < 0.4:
        radius = min(y, (high - low) / 2)
        middle = np.array([x, 0, low + radius - board / 2])
        return [rod(middle, middle + [board, 0, 0], radius, style.body, sections=24),
                rod(middle, middle + [board * 1.2, 0, 0], radius - board, pane, sections=24),
                box([x, -y * 0.6, low - board], [x + board, y * 0.6, low + board], style.body)]
    return [box([x, -y, low - board], [x + board, y, high], style.body),
            box([x, -y + board, low + board], [x + board * 1.2, y - board, high - board], pane)]
