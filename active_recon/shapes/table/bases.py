"""What a table top can stand on other than legs: pedestals, trestles, panels, drums, cages."""

import math

from active_recon.shapes.common.parts import (
    assemble,
    beam,
    box,
    Color,
    ellipsoid,
    lathe,
    Mesh,
    mirrored,
    prism,
    rod,
    tube,
)
from active_recon.shapes.table.legs import ring, Room, thickness, turned
import numpy as np


def pedestal(rng: np.random.Generator, room: Room, color: Color, accent: Color) -> Mesh:
    """Return a column on a foot, or two of them under a long top."""
    pair = room.width > 1.5 * room.depth and rng.random() < 0.85
    reach = min(room.depth, room.width) / 2 * rng.uniform(0.55, 0.95)
    one = _column(rng, room.height, reach, thickness(rng, room, 0.035, 0.12), color, accent)
    if not pair:
        return one
    one.apply_translation([0, room.width / 2 - reach * rng.uniform(1, 1.2), 0])
    return mirrored(one)


def _column(rng: np.random.Generator, height: float, reach: float, thick: float, color: Color,
            accent: Color) -> Mesh:
    foot = rng.choice(['disc', 'tulip', 'square', 'cross', 'claws', 'beams'])
    half = thick / 2
    if foot == 'tulip':
        waist = np.array([[1, 0], [0.95, 0.03], [0.35, 0.1], [0.16, 0.25], [0.12, 0.5],
                          [0.18, 0.8], [0.5, 1]])
        waist[2:-1, 0] *= rng.uniform(0.8, 1.8)
        return lathe(waist * [reach, height], color)
    low = height * rng.uniform(0.03, 0.08)
    if rng.random() < 0.35:
        post = turned(rng, height, thick * 0.9, color, int(rng.integers(3, 7)))
    elif rng.random() < 0.3:
        post = box([-half, -half, 0], [half, half, height], color)
    else:
        post = rod([0, 0, 0], [0, 0, height], half, color, half * rng.uniform(0.7, 1.3))
    spread = reach * rng.uniform(0.4, 0.9)
    plate = box([-spread, -spread, height * 0.97], [spread, spread, height], color)
    parts = [post, plate] if rng.random() < 0.5 else [post]
    if foot == 'disc':
        rim = rng.uniform(0.3, 1)
        sections = int(rng.choice([6, 8, 24, 24]))
        parts.append(lathe([[reach, 0], [reach, low * rim], [half, low * 1.5]], accent,
                           sections=sections))
    elif foot == 'square':
        reach *= 0.8
        parts.append(box([-reach, -reach, 0], [reach, reach, low], accent))
    else:
        count = 3 if foot == 'claws' and rng.random() < 0.6 else 4
        start = rng.choice([0, math.pi / 4]) if count == 4 else rng.choice([0, math.pi])
        hub = height * rng.uniform(0.15, 0.4)
        for angle in start + np.arange(count) * 2 * math.pi / count:
            out = np.array([math.cos(angle), math.sin(angle), 0])
            up = np.array([0, 0, 1.0])
            if foot == 'cross':
                parts.append(beam(up * low / 2, out * reach + up * low / 2, thick * 0.8, accent,
                                  low))
            elif foot == 'beams':
                parts.append(beam(up * hub, out * reach + up * thick * 0.3, thick * 0.7, accent))
            else:
                path = [up * hub, out * reach * 0.45 + up * hub * 0.9,
                        out * reach * 0.75 + up * hub * 0.35, out * reach + up * thick * 0.35]
                parts.append(tube(path, thick * 0.35, accent, sections=8))
    return assemble(parts)


def trestle(rng: np.random.Generator, room: Room, color: Color, accent: Color) -> Mesh:
    """Return two end frames of beams with, mostly, a stretcher between them."""
    thick = thickness(rng, room)
    x, high = room.depth / 2 - thick / 2, room.height
    y = room.width / 2 * rng.uniform(0.6, 1) - thick / 2
    foot, head = thick / 2, high - thick / 2
    kind = rng.choice(['post', 'twin', 'x', 'a', 'v', 'loop', 'trapezoid', 'u', 'k', 'c'])
    narrow, wide = x * rng.uniform(0.1, 0.5), thick * rng.uniform(1, 2.5)
    slant = y + rng.choice([0, 0, 0.3]) * (room.width / 2 - thick / 2 - y)

    def bar(x0: float, z0: float, x1: float, z1: float, width: float = thick) -> Mesh:
        start, end = ([at, y + (slant - y) * (1 - z / high), z] for at, z in ((x0, z0), (x1, z1)))
        return beam(start, end, width, color, thick)

    frame = {
        'post': [bar(-x, foot, x, foot), bar(0, foot, 0, head, wide), bar(-x, head, x, head)],
        'twin': [bar(-x, foot, x, foot), bar(-x, head, x, head),
                 bar(-narrow - thick, foot, -narrow - thick, head),
                 bar(narrow + thick, foot, narrow + thick, head)],
        'x': [bar(-x, 0, x, high), bar(x, 0, -x, high)],
        'a': [bar(-x, 0, -narrow, high), bar(x, 0, narrow, high),
              bar(-x * 0.7, high * 0.35, x * 0.7, high * 0.35)],
        'v': [bar(-narrow, 0, -x, high), bar(narrow, 0, x, high),
              bar(-narrow - thick, foot, narrow + thick, foot)],
        'loop': [bar(-x, foot, x, foot), bar(-x, head, x, head), bar(-x, 0, -x, high),
                 bar(x, 0, x, high)],
        'trapezoid': [bar(-x, foot, x, foot), bar(-x * 0.6, head, x * 0.6, head),
                      bar(-x, 0, -x * 0.6, high), bar(x, 0, x * 0.6, high)],
        'u': [bar(-x, foot, x, foot), bar(-x, 0, -x, high), bar(x, 0, x, high)],
        'k': [bar(-x, foot, x, foot), bar(-x * 0.8, foot, 0, head), bar(x * 0.8, foot, 0, head),
              bar(-x, head, x, head)],
        'c': [bar(-x, foot, x, foot), bar(-x * 0.7, foot, -x * 0.7, head, wide),
              bar(-x, head, x * 0.8, head)],
    }[kind]
    parts = [mirrored(assemble(frame))]
    level = {'x': 0.5, 'a': 0.35, 'v': 0.02, 'k': 0.02, 'trapezoid': 0.02}.get(kind)
    if level is not None or kind == 'post' or rng.random() < 0.5:
        at = high * (rng.uniform(0.15, 0.6) if level is None else level) + thick / 2
        centre = {'c': -x * 0.7}.get(kind, 0)
        if kind in ('twin', 'loop', 'u'):
            centre, at = (0, foot) if rng.random() < 0.7 else (0, head)
        reach = y + (slant - y) * (1 - at / high)
        parts.append(beam([centre, -reach, at], [centre, reach, at], thick * 0.8, accent,
                          thick * rng.uniform(0.8, 2) if at > 2 * thick else thick))
    return assemble(parts)


def panels(rng: np.random.Generator, room: Room, color: Color, accent: Color) -> Mesh:
    """Return two solid ends, perhaps with a back, shelves, or a middle wall."""
    thick, (depth, width, high) = thickness(rng, room, 0.03, 0.08), room
    x, y = depth / 2 * rng.uniform(0.75, 1), width / 2 * rng.uniform(0.8, 1)
    if rng.random() < 0.3:
        lean = rng.uniform(0.5, 0.9)
        outline = [[-x, 0], [x, 0], [x * lean, high], [-x * lean, high]]
        side = prism(outline, y - thick, y, 'y', color)
    else:
        side = box([-x, y - thick, 0], [x, y, high], color)
    parts = [mirrored(side)]
    back = rng.choice(['none', 'none', 'modesty', 'full', 'spine', 'front'])
    if back in ('modesty', 'full'):
        low = 0 if back == 'full' else high * rng.uniform(0.2, 0.7)
        parts.append(box([-x * 0.75, -y + thick, low], [-x * 0.75 + thick, y - thick, high],
                         accent))
    elif back == 'spine':
        parts.append(box([-thick / 2, -y + thick, high * 0.1], [thick / 2, y - thick, high],
                         accent))
    elif back == 'front':
        parts.append(box([-x * 0.6, -thick / 2, 0], [x * 0.6, thick / 2, high], accent))
    for level in rng.uniform(0.1, 0.75, rng.choice([0, 0, 1, 1, 2])):
        low = high * level
        parts.append(box([-x * 0.7, -y + thick / 2, low],
                         [x * 0.7, y - thick / 2, low + thick * 0.8], accent))
    return assemble(parts)


def drum(rng: np.random.Generator, room: Room, color: Color, accent: Color) -> Mesh:
    """Return a solid body of revolution: barrel, stool, hourglass, cone, prism, stacked discs."""
    reach = min(room.depth, room.width) / 2
    count = int(rng.integers(2, 7))
    levels = np.linspace(0, room.height, count)
    radii = reach * rng.uniform(0.35, 1, count)
    if rng.random() < 0.3:  # steps instead of slopes
        levels = np.repeat(np.linspace(0, room.height, count + 1), 2)[1:-1]
        radii = np.repeat(radii, 2)
    elif rng.random() < 0.5:
        radii = np.full(count, radii.max())
    sections = int(rng.choice([4, 6, 8, 20, 28]))
    body = lathe(np.column_stack([radii, levels]), color, sections=sections)
    stretch = max(1, room.width / room.depth * rng.uniform(0.5, 0.9))
    body.apply_transform(np.diag([1, stretch, 1, 1]))
    if rng.random() < 0.4:
        band = room.height * (rng.uniform(0.05, 0.9) + np.array([0, 0.06]))
        body = assemble([body, lathe(np.column_stack([[reach, reach], band]), accent,
                                     sections=sections)])
    return body


def cage(rng: np.random.Generator, room: Room, color: Color, accent: Color) -> Mesh:
    """Return rods between a ring at the floor and one under the top, upright or crossing."""
    reach, thick = min(room.depth, room.width) / 2, thickness(rng, room, 0.022, 0.04)
    count = int(rng.integers(3, 13))
    low, high = reach * rng.uniform(0.5, 0.95, 2)
    twist = rng.choice([0, 0, math.pi / 3, math.pi * 0.8])
    parts = [ring(low, thick / 2, thick, color), ring(high, room.height - thick / 2, thick, color)]
    for angle in np.arange(count) * 2 * math.pi / count:
        for turn in {twist, -twist}:
            foot = [low * math.cos(angle), low * math.sin(angle), thick / 2]
            head = [high * math.cos(angle + turn), high * math.sin(angle + turn),
                    room.height - thick / 2]
            parts.append(rod(foot, head, thick / 2, color, sections=6))
    if rng.random() < 0.3:
        parts.append(lathe([[low, thick], [low, thick * 2]], accent))
    return assemble(parts)


def crossed(rng: np.random.Generator, room: Room, color: Color, accent: Color) -> Mesh:
    """Return two boards, or two frames, standing upright through each other."""
    thick, high = thickness(rng, room, 0.03, 0.07), room.height
    span = math.hypot(room.depth, room.width) / 2 * rng.uniform(0.45, 0.9)
    lean = rng.uniform(0.3, 1)
    direction = math.atan2(room.width, room.depth) if rng.random() < 0.7 else 0.0
    if rng.random() < 0.5:
        board = [prism([[-span, 0], [span, 0], [span * lean, high], [-span * lean, high]],
                       -thick / 2, thick / 2, 'y', color)]
    else:
        board = [beam([-span, 0, 0], [span * lean, 0, high], thick, color),
                 beam([span, 0, 0], [-span * lean, 0, high], thick, color)]
    one, other = assemble(board), assemble(board)
    for mesh, angle in ((one, direction), (other, math.pi - direction)):
        turn = np.eye(4)
        angle = angle if direction else (angle + math.pi / 2 if mesh is other else 0)
        turn[:2, :2] = [[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]]
        mesh.apply_transform(turn)
    knot = ellipsoid([0, 0, high / 2], [thick] * 3, accent)
    return assemble([one, other, knot])
