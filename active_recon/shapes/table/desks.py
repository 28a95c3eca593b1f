"""Tables with storage or seats: desks, nightstands, workbenches, picnic tables."""

from active_recon.shapes.common.materials import metal, paint, plastic, wood
from active_recon.shapes.common.parts import (
    assemble,
    beam,
    box,
    Color,
    ellipsoid,
    Mesh,
    mirrored,
    rod,
)
from active_recon.shapes.table.bases import trestle
from active_recon.shapes.table.legs import fourfold, legs, Room, thickness
import numpy as np
from numpy.typing import ArrayLike


def _drawers(rng: np.random.Generator, low: ArrayLike, high: ArrayLike, rows: int, columns: int,
             color: Color, front: Color, handle: Color) -> Mesh:
    """Return a chest between two corners whose drawers' fronts stand out at +x."""
    (x, y0, z0), (x1, y1, z1) = np.sort([low, high], axis=0)
    gap, proud = 0.04 * min((y1 - y0) / columns, (z1 - z0) / rows), 0.03 * (x1 - x)
    parts = [box([x, y0, z0], [x1 - proud, y1, z1], color)]
    style = rng.choice(['knob', 'bar', 'slot'])
    across, up = np.linspace(y0, y1, columns + 1), np.linspace(z0, z1, rows + 1)
    for left, right in zip(across[:-1], across[1:], strict=True):
        for bottom, top in zip(up[:-1], up[1:], strict=True):
            parts.append(box([x1 - 2 * proud, left + gap, bottom + gap],
                             [x1, right - gap, top - gap], front))
            y, z, wide = (left + right) / 2, (bottom + top) / 2, (right - left) / 4
            size = 0.012 + 0.05 * min(right - left, top - bottom)
            if style == 'knob':
                parts.append(ellipsoid([x1 + size / 2, y, z], [size] * 3, handle, 1))
            elif style == 'bar':
                parts.append(box([x1 - proud, y - wide, z - size / 2],
                                 [x1 + size, y + wide, z + size / 2], handle))
            else:
                parts.append(box([x1 - proud, y - wide, top - gap - size],
                                 [x1 + size / 4, y + wide, top - gap], handle))
    return assemble(parts)


def _palette(rng: np.random.Generator) -> tuple[Color, Color, Color, Color]:
    """Return the colours of the top, the body, the fronts and the handles."""
    body = [wood, wood, paint, plastic][rng.integers(4)](rng)
    top = body if rng.random() < 0.4 else [wood, wood, paint][rng.integers(3)](rng)
    front = body if rng.random() < 0.5 else [wood, paint][rng.integers(2)](rng)
    return top, body, front, metal(rng)


def desk(rng: np.random.Generator) -> Mesh:
    """Return a desk: a top on chests, panels or legs; perhaps an arm, a hutch, a modesty panel."""
    top, body, front, handle = _palette(rng)
    depth, width, height = rng.uniform(0.5, 0.85), rng.uniform(0.9, 1.8), rng.uniform(0.7, 0.78)
    slab = width * rng.uniform(0.02, 0.045)
    x, y, under = depth / 2, width / 2, height - slab
    inset = rng.uniform(0.9, 1)
    parts = [box([-x, -y, under], [x, y, height], top)]
    thick = thickness(rng, Room(depth, width, under), 0.025, 0.05)
    sides = ['chest', rng.choice(['chest', 'panel', 'legs', 'legs', 'frame'])]
    if rng.random() < 0.25:
        sides[0] = 'legs'
    lift = rng.choice([0, 0, 0.06, 0.2]) if rng.random() < 0.7 else rng.uniform(0.3, 0.55)
    flip = rng.choice([-1, 1])
    for sign, side in zip((flip, -flip), sides, strict=True):
        edge, wide = sign * y * inset, width * rng.uniform(0.2, 0.33)
        if side == 'chest':
            low = lift * under
            parts.append(_drawers(rng, [-x * inset, edge, low],
                                  [x * inset, edge - sign * wide, under], int(rng.integers(1, 5)),
                                  1, body, front, handle))
            inner = edge - sign * (wide - thick) if rng.random() < 0.5 else edge - sign * thick
            if low:
                parts += [_post(at, s, thick, low + 0.01, body)
                          for at in (x * inset - thick / 2, -x * inset + thick / 2)
                          for s in {edge - sign * thick / 2, inner}]
        elif side == 'panel':
            parts.append(box([-x * inset, edge, 0], [x * inset, edge - sign * thick, under], body))
        else:
            at = x * inset - thick / 2
            middle = edge - sign * thick / 2
            parts += [_post(s, middle, thick, under, body) for s in (at, -at)]
            if side == 'frame':
                parts.append(beam([-at, middle, thick / 2], [at, middle, thick / 2], thick, body))
    if rng.random() < 0.5:
        back, low = -x * inset + thick * 0.3, under * rng.uniform(0.05, 0.7)
        parts.append(box([back, -y * inset, low], [back + thick * 0.7, y * inset, under], body))
    if rng.random() < 0.35 or sides[0] == 'legs':
        span = y * inset - thick
        parts.append(_drawers(rng, [-x * inset, -span, under * 0.85], [x * inset, span, under], 1,
                              int(rng.integers(1, 4)), body, front, handle))
    extra = rng.random()
    if extra < 0.2:
        parts.append(_arm(rng, x, flip * y, under, slab, thick, top, body))
    elif extra < 0.45:
        parts.append(_hutch(rng, x, y, height, thick, body, front))
    return assemble(parts)


def _post(x: float, y: float, thick: float, height: float, color: Color) -> Mesh:
    return beam([x, y, height], [x, y, 0], thick, color)


def _arm(rng: np.random.Generator, x: float, edge: float, under: float, slab: float,
         thick: float, top: Color, body: Color) -> Mesh:
    """Return the short arm of an L desk: it reaches to +x along the side at y = edge."""
    inner = edge * (1 - rng.uniform(0.5, 0.75))
    end = x + rng.uniform(0.4, 1)
    parts = [box([x - slab, edge, under], [end, inner, under + slab], top)]
    if rng.random() < 0.5:
        parts.append(box([end - thick, edge, 0], [end, inner, under], body))
    elif rng.random() < 0.5:
        parts.append(box([end - rng.uniform(0.3, 0.4), edge, 0], [end, inner, under], body))
    else:
        near = thick / 2 * np.sign(edge)
        parts += [_post(end - thick / 2, s, thick, under, body)
                  for s in (edge - near, inner + near)]
    return assemble(parts)


def _hutch(rng: np.random.Generator, x: float, y: float, height: float, thick: float,
           color: Color, back: Color) -> Mesh:
    """Return shelves that stand on the rear of a desk, from a low riser to a tall bookcase."""
    rise, deep = rng.uniform(0.12, 0.7), x * rng.uniform(0.4, 0.8)
    reach = y * rng.choice([1, 1, 0.6])
    walls = np.linspace(-reach + thick / 2, reach - thick / 2, int(rng.integers(2, 5)))
    parts = [box([-x, s - thick / 2, height], [-x + deep, s + thick / 2, height + rise], color)
             for s in walls]
    for level in np.linspace(1, 0, int(rng.integers(2, 4)))[:-1]:
        z = height + rise * level
        parts.append(box([-x, -reach, z - thick], [-x + deep, reach, z], color))
    if rng.random() < 0.6:
        parts.append(box([-x, -reach, height], [-x + thick, reach, height + rise], back))
    return assemble(parts)


def cabinet_table(rng: np.random.Generator) -> Mesh:
    """Return a low or tall table whose body holds drawers or open shelves: nightstands, chests."""
    top, body, front, handle = _palette(rng)
    depth, width = rng.uniform(0.35, 0.6), rng.uniform(0.35, 1.3)
    height = rng.uniform(0.35, 0.65)
    low = height * rng.choice([0.08, 0.2, 0.4, 0.6])
    x, y, slab = depth / 2, width / 2, 0.03
    over = rng.uniform(1, 1.12)
    parts = [box([-x * over, -y * over, height - slab], [x * over, y * over, height], top),
             legs(rng, Room(depth, width, low + 0.01), body, body) if low > 0.2
             else fourfold(box([x * 0.7, y * 0.7, 0], [x * 0.95, y * 0.95, low + 0.01], body))]
    rows = max(1, round((height - low) / rng.uniform(0.14, 0.3)))
    if rng.random() < 0.6:
        columns = max(1, round(width / rng.uniform(0.3, 0.7)))
        parts.append(_drawers(rng, [-x, -y, low], [x, y, height - slab], rows, columns, body,
                              front, handle))
        return assemble(parts)
    thick = rng.uniform(0.02, 0.04)
    parts += [mirrored(box([-x, y - thick, low], [x, y, height - slab / 2], body)),
              box([-x, -y, low], [-x + thick, y, height - slab / 2], front)]
    parts += [box([-x, -y, z], [x, y, z + thick], body)
              for z in np.linspace(low, height - slab, rows + 1)[:-1]]
    return assemble(parts)


def bench_table(rng: np.random.Generator) -> Mesh:
    """Return a workbench with a vise or pegboard, or a picnic table with its benches."""
    color, accent = [wood, wood, paint][rng.integers(3)](rng), metal(rng)
    if rng.random() < 0.5:
        return _picnic(rng, color, wood(rng) if rng.random() < 0.5 else accent)
    depth, width, height = rng.uniform(0.5, 0.8), rng.uniform(1.1, 1.9), rng.uniform(0.8, 0.95)
    slab = rng.uniform(0.05, 0.1)
    x, y = depth / 2, width / 2
    room = Room(depth * 0.92, width * 0.92, height - slab)
    parts = [box([-x, -y, height - slab], [x, y, height], color),
             (legs if rng.random() < 0.75 else trestle)(rng, room, color, accent)]
    if rng.random() < 0.6:
        at = y * rng.uniform(-0.7, 0.7)
        parts += [box([x - 0.01, at - 0.1, height - 0.14], [x + 0.07, at + 0.1, height], accent),
                  rod([x, at, height - 0.08], [x + 0.2, at, height - 0.08], 0.02, accent)]
    if rng.random() < 0.4:
        rise = rng.uniform(0.3, 0.7)
        parts.append(box([-x, -y, height - slab], [-x + 0.04, y, height + rise], paint(rng)))
    return assemble(parts)


def _picnic(rng: np.random.Generator, color: Color, frame: Color) -> Mesh:
    width, height, thick = rng.uniform(1.2, 2), rng.uniform(0.7, 0.78), rng.uniform(0.035, 0.06)
    x, seat, reach = rng.uniform(0.32, 0.42), rng.uniform(0.4, 0.46), rng.uniform(0.62, 0.8)
    y = width / 2
    end = y * rng.uniform(0.6, 0.8)
    bar = thick * 1.6
    frames = [beam([x * 0.6, end, height - thick], [reach * 0.85, end, 0], bar, frame),
              beam([-x * 0.6, end, height - thick], [-reach * 0.85, end, 0], bar, frame),
              beam([-reach, end, seat - bar / 2], [reach, end, seat - bar / 2], bar, frame)]
    count = int(rng.integers(2, 6))
    edges = np.linspace(-x, x, count + 1)
    boards = [box([a + 0.006, -y, height - thick], [b - 0.006, y, height], color)
              for a, b in zip(edges[:-1], edges[1:], strict=True)]
    seats = [box([s * reach, -y, seat - thick * 0.2], [s * (reach - 0.26), y, seat + thick], color)
             for s in (-1, 1)]
    under = box([-x * 0.9, -end - bar / 2, height - thick * 2.2],
                [x * 0.9, -end + bar / 2, height - thick * 0.9], frame)
    return assemble([mirrored(assemble([*frames, under])), *boards, *seats])
