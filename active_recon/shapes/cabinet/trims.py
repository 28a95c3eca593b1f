"""What a cabinet stands on and what finishes it above: plinths, feet, legs, tops, cornices."""

import math

from active_recon.shapes.common.parts import (
    beam,
    box,
    Color,
    lathe,
    loft,
    Mesh,
    mirrored,
    prism,
    rod,
)
from active_recon.shapes.table.legs import fourfold, legs, Room
import numpy as np

# How high each base is, metres.
_LIFTS = {'none': (0.0, 0.0), 'plinth': (0.05, 0.1), 'skirting': (0.05, 0.1),
          'blocks': (0.04, 0.1), 'buns': (0.05, 0.1), 'brackets': (0.07, 0.14),
          'castors': (0.06, 0.1), 'tapered': (0.12, 0.28), 'square': (0.12, 0.3),
          'sled': (0.1, 0.25), 'table': (0.3, 0.6)}


def lift(rng: np.random.Generator, kind: str) -> float:
    """Return how high above the floor a base of a kind carries its cabinet."""
    return float(rng.uniform(*_LIFTS[kind]))


def base(rng: np.random.Generator, kind: str, room: Room, board: float, body: Color,
         accent: Color) -> list[Mesh]:
    """Return what fills the room under a cabinet; it reaches into the cabinet by a little."""
    high = room.height + board / 2
    x, y = room.depth / 2, room.width / 2
    if kind == 'none':
        return []
    if kind == 'plinth':
        inset = rng.uniform(0.5, 2) * board
        return [box([-x, -y + board / 2, 0], [x - inset, y - board / 2, high], accent)]
    if kind == 'skirting':
        proud = board * rng.uniform(0.2, 0.6)
        return [box([-x, -y - proud, 0], [x + proud, y + proud, room.height], accent)]
    if kind == 'table':
        return [legs(rng, Room(room.depth, room.width, high), body, accent)]
    if kind == 'brackets':
        return _brackets(rng, x, y, high, board, body)
    thick = max(board, 0.03) * rng.uniform(1, 1.7)
    inset = thick * rng.uniform(0.5, 1)
    cx, cy = x - inset, y - inset
    if kind == 'sled':
        loop = [beam([-cx, cy, thick / 2], [cx, cy, thick / 2], thick, accent),
                beam([-cx, cy, room.height], [cx, cy, room.height], thick, accent)]
        loop += [beam([s * (cx - thick / 2), cy, 0], [s * (cx - thick / 2), cy, high], thick,
                      accent) for s in (-1, 1)]
        if rng.random() < 0.5:
            loop.append(beam([0, -cy, thick / 2], [0, cy, thick / 2], thick, accent))
        return [mirrored(part) for part in loop]
    if kind == 'blocks':
        foot = box([cx - thick, cy - thick, 0], [cx + inset, cy + inset, high], accent)
    elif kind == 'buns':
        radius = thick * rng.uniform(0.7, 1)
        bulge = np.array([[0.6, 0], [1, 0.35], [1, 0.6], [0.5, 0.85], [0.9, 1]])
        foot = lathe(bulge * [radius, high], accent, [cx - radius / 2, cy - radius / 2, 0], 10)
    elif kind == 'castors':
        at = np.array([cx - thick / 2, cy - thick / 2, high * 0.4])
        axle = np.array([0, thick * 0.3, 0])
        foot = rod(at - axle, at + axle, high * 0.4, [35] * 3, sections=10)
        post = rod(at, [at[0], at[1], high], thick * 0.35, accent, sections=8)
        return [fourfold(foot), fourfold(post)]
    else:
        splay = rng.choice([0, 0.15, 0.3]) * high if kind == 'tapered' else 0.0
        head = np.array([cx - thick / 2 - splay, cy - thick / 2 - splay, high])
        toe = np.array([cx - thick / 2, cy - thick / 2, 0])
        if kind == 'tapered':
            foot = rod(head, toe, thick * 0.65, accent, thick * 0.4, sections=10)
        else:
            foot = beam(head, toe, thick, accent)
    parts = [fourfold(foot)]
    if room.width > 1.4 and rng.random() < 0.6:  # it would sag
        parts.append(box([-cx, -thick / 2, 0], [cx, thick / 2, high], accent))
    elif kind in ('tapered', 'square') and rng.random() < 0.4:
        rail = room.height - 0.3 * thick
        parts += [mirrored(box([-cx, cy - thick, rail], [cx, cy, high], accent)),
                  box([cx - thick, -cy, rail], [cx, cy, high], accent),
                  box([-cx, -cy, rail], [-cx + thick, cy, high], accent)]
    return parts


def _brackets(rng: np.random.Generator, x: float, y: float, high: float, board: float,
              color: Color) -> list[Mesh]:
    """Return boards round the foot, cut out between the corners: across, in an arch, in steps."""
    foot, brow = rng.uniform(0.12, 0.25), rng.uniform(0.45, 0.7)
    steps = {'straight': [1.0], 'arch': [1.0, 0.75, 0.5], 'ogee': [1.0, 0.55]}[
        rng.choice(['straight', 'arch', 'ogee'])]
    parts = []
    for index, share in enumerate(steps):
        low = high * brow * (index + 1) / len(steps)
        reach = 2 * y * foot * share / (1 if index else 1.0)
        below = high * brow * index / len(steps)
        parts += [mirrored(box([x - board, y - reach, below], [x, y, low + 0.01], color)),
                  fourfold(box([x - 2 * x * foot * share, y - board, below], [x, y, low + 0.01],
                               color))]
    return [*parts, box([x - board, -y, high * brow], [x, y, high], color),
            box([-x, -y, high * brow], [-x + board, y, high], color),
            mirrored(box([-x, y - board, high * brow], [x, y, high], color))]


def top(rng: np.random.Generator, kind: str, room: Room, board: float,
        colors: tuple[Color, Color]) -> list[Mesh]:
    """
    Return what lies on a cabinet whose upper side is at the room's height.

    Colours: the top's and the body's. Kinds: flush, slab, worktop, cornice, gallery, pediment.
    """
    color, body = colors
    x, y, low = room.depth / 2, room.width / 2, room.height - board / 4
    if kind == 'flush':
        return []
    over = board * rng.uniform(0.2, 1.4)
    if kind == 'slab':
        thick = board * rng.uniform(0.8, 1.6)
        rim = rng.choice([1.0, 1.0, 0.985])
        corners = np.array([[-x, -y - over], [x + over, -y - over], [x + over, y + over],
                            [-x, y + over]])
        return [loft([np.column_stack([corners * share, np.full(4, z)])
                      for share, z in ((rim, low), (1.0, low + thick / 2),
                                       (rim, low + thick))], color)]
    if kind == 'worktop':
        thick = rng.uniform(1, 1.8) * board
        parts = [box([-x, -y - 0.5 * over, low], [x + over, y + 0.5 * over, low + thick], color)]
        if rng.random() < 0.5:
            parts.append(box([-x, -y - 0.5 * over, low],
                             [-x + board, y + 0.5 * over, low + thick + rng.uniform(0.04, 0.15)],
                             color))
        return parts
    if kind == 'cornice':
        steps = int(rng.integers(2, 4))
        rise = board * rng.uniform(0.7, 1.2)
        return [box([-x, -y - over * (i + 1) / 2, low + i * rise * 0.95],
                    [x + over * (i + 1) / 2, y + over * (i + 1) / 2, low + (i + 1) * rise],
                    body if i % 2 else color) for i in range(steps)]
    if kind == 'gallery':
        rise = board * rng.uniform(1.5, 4)
        parts = [box([-x, -y, low], [-x + board, y, low + rise], color)]
        if rng.random() < 0.7:
            parts.append(mirrored(box([-x, y - board, low],
                                      [x * rng.uniform(-0.2, 1), y, low + rise * 0.8], color)))
        return parts
    rise = 2 * y * rng.uniform(0.1, 0.22)  # a pediment
    if rng.random() < 0.5:
        outline = [[-y, low], [y, low], [y, low + board], [0, low + rise], [-y, low + board]]
    else:
        turn = np.linspace(0, math.pi, 11)
        arch = np.column_stack([y * np.cos(turn), low + board + (rise - board) * np.sin(turn)])
        outline = [[-y, low], [y, low], *arch.tolist()]
    rear = rng.choice([-x, x - 1.6 * board])
    return [prism(outline, rear, x + 0.3 * board, 'x', color)]
