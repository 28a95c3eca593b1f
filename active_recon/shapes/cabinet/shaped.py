"""Cabinets that are no boxes: for the corners of rooms, curved in plan, and with a sloping lid."""

import math

from active_recon.shapes.cabinet import layouts
from active_recon.shapes.cabinet.bays import Bay, doors, rows
from active_recon.shapes.cabinet.fronts import fronted, fronts
from active_recon.shapes.cabinet.style import draw_style
from active_recon.shapes.cabinet.trims import base, lift
from active_recon.shapes.common.parts import beam, box, Mesh, prism
from active_recon.shapes.table.legs import Room
import numpy as np
from numpy.typing import NDArray


def corner(rng: np.random.Generator) -> list[Mesh]:
    """Return a cabinet for the corner of a room: five-sided in plan, its corner at -x."""
    width, height = rng.uniform(0.6, 1.0), rng.choice([rng.uniform(0.7, 1.0),
                                                       rng.uniform(1.6, 2.1)])
    style = draw_style(rng, max(width, height))
    y, side = width / 2, width * rng.uniform(0.08, 0.2)
    face, half = 0.0, style.board / 2
    door = y * rng.uniform(0.6, 0.8)
    rim = y - door
    outline = np.array([[face, -door], [face, door], [face - rim, y], [face - rim - side, y],
                        [face - rim - side - y, 0], [face - rim - side, -y],
                        [face - rim, -y]])
    under = rng.uniform(0.05, 0.1)
    middle = outline.mean(axis=0)
    parts = [prism(outline, under, height, 'z', style.body),
             prism(middle + (outline - middle) * 0.93, 0, under + half, 'z', style.top)]
    crown = middle + (outline - middle) * 1.05
    parts.append(prism(crown, height - half, height + rng.uniform(0.5, 1.5) * style.board, 'z',
                       style.top))
    area = Bay(-door + half, door - half, under + half, height - half)
    count = 1 if door < 0.3 else 2
    if height < 1.2:
        bays = doors(area, count)
        if rng.random() < 0.5:
            low, high = rows(area, [3, 1])
            bays = [*doors(low, count), high._replace(kind='drawer')]
    else:
        low, high = rows(area, [1, rng.uniform(1, 1.8)])
        bays = [*doors(low, count), *doors(high, count, rng.choice(['glass', 'door']))]
    return parts + fronts(rng, style, bays, face, width / 2)


def bowed(rng: np.random.Generator) -> list[Mesh]:
    """Return a chest curved in plan: bowed, serpentine, half or fully round."""
    kind = rng.choice(['bow', 'serpentine', 'half', 'round'])
    width, height, depth = rng.uniform(0.6, 1.3), rng.uniform(0.6, 1.1), rng.uniform(0.3, 0.45)
    if kind == 'round':
        width, height = rng.uniform(0.35, 0.6), rng.uniform(0.45, 0.9)
    elif kind == 'half':
        depth = 0.45 * width
    style = draw_style(rng, max(width, height))

    def plan(over: float) -> NDArray[np.float64]:
        if kind == 'round':
            turn = np.linspace(0, 2 * math.pi, 25)[:-1]
            return (width / 2 + over) * np.column_stack([np.cos(turn), np.sin(turn)])
        y = np.linspace(-1, 1, 15)
        bulge = {'bow': 0.16 * (1 - y ** 2), 'half': 0.5 * np.sqrt(1 - y ** 2) - 0.4,
                 'serpentine': 0.06 * np.cos(1.5 * math.pi * y)}[kind] * width
        edge = np.column_stack([depth / 2 + bulge + over, y * (width / 2 + over)])
        return np.vstack([edge, [[-depth / 2, width / 2 + over], [-depth / 2, -width / 2 - over]]])

    stand = rng.choice(['buns', 'square', 'tapered', 'plinth'])
    under = lift(rng, stand)
    count = int(rng.integers(2, 5))
    edges = np.linspace(under, height - style.board, count + 1)
    parts = [prism(plan(0), under, height - style.board / 2, 'z', style.body),
             prism(plan(style.board * rng.uniform(0.3, 1)), height - style.board, height, 'z',
                   style.top)]
    outward = plan(style.proud)[0 if kind == 'round' else 7, 0]  # the middle of the front
    for low, high in zip(edges[:-1], edges[1:], strict=True):
        band, gap = plan(style.proud), 0.25 * style.board
        parts.append(prism(band, low + gap, high - gap, 'z', style.fronts[0]))
        size, z = style.grip_size, (low + high) / 2
        parts.append(box([outward - size, -3 * size, z - size * 0.6],
                         [outward + size, 3 * size, z + size * 0.6], style.handle))
    deep, wide = {'round': (0.68 * width, 0.68 * width), 'half': (0.7 * depth, 0.5 * width)}.get(
        kind, (0.95 * depth, 0.95 * width))
    return parts + base(rng, stand, Room(deep, wide, under), style.board, style.body, style.top)


def bureau(rng: np.random.Generator) -> list[Mesh]:
    """Return a writing chest with a sloping lid, shut or let down, over drawers or legs."""
    width, height, depth = rng.uniform(0.6, 1.0), rng.uniform(0.95, 1.2), rng.uniform(0.4, 0.5)
    style = draw_style(rng, max(width, height))
    x, y, desk = depth / 2, width / 2, height * rng.uniform(0.65, 0.75)
    stand = rng.choice(['brackets', 'buns', 'plinth', 'square', 'table'])
    under = lift(rng, stand)
    half, ledge = style.board / 2, -x + depth * rng.uniform(0.35, 0.6)
    face = Bay(half - y, y - half, under + half, desk - half)
    bays = layouts.drawers(face, max(1, round(face.height / rng.uniform(0.15, 0.22))))
    profile = [[-x, desk - half], [x, desk - half], [x, desk], [ledge, height], [-x, height]]
    parts = [*fronted(rng, style, bays, -x, x), prism(profile, -y, y, 'y', style.body)]
    slope = np.array([x - ledge, 0, desk - height])
    normal = np.array([height - desk, 0, x - ledge]) / np.linalg.norm(slope)
    if rng.random() < 0.35:  # let down
        reach = x + 0.9 * float(np.linalg.norm(slope))
        parts.append(box([x - style.board, -y * 0.95, desk - style.board],
                         [reach, y * 0.95, desk], style.fronts[0]))
    else:
        start, end = (np.array([ledge, 0, height]) + slope * s + normal * half * 0.4
                      for s in (0.06, 0.94))
        parts.append(beam(start, end, width * 0.9, style.fronts[0], style.board))
    return parts + base(rng, stand, Room(depth, width, under), style.board, style.body, style.top)
