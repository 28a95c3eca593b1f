"""Toys: vehicles, stacking pegs, figures of blocks and balls."""

import math

from active_recon.shapes.common.drawing import choose
from active_recon.shapes.common.parts import assemble, beam, box, Color, ellipsoid, loft, Mesh, rod
from active_recon.shapes.common.soft_parts import cushion
from active_recon.shapes.things.colors import draw_palette
from active_recon.shapes.things.drawing import chance, globe, section
from active_recon.shapes.things.outlines import rounded
from active_recon.shapes.things.solids import (
    moved,
    revolved,
    superquadric,
    torus,
)
import numpy as np
from numpy.typing import NDArray
import trimesh

Points = NDArray[np.float64]


def _wheels(rng: np.random.Generator, long: float, wide: float, color: Color,
            hub: Color) -> list[Mesh]:
    """Return two to four axles of wheels under a body from x = 0 to long."""
    radius, thick = rng.uniform(0.15, 0.35), rng.uniform(0.08, 0.2)
    parts: list[Mesh] = []
    for x in np.linspace(0.18, 0.82, int(choose(rng, {2: 0.75, 3: 0.2, 4: 0.05}))) * long:
        parts.append(rod([x, -wide / 2, 0], [x, wide / 2, 0], 0.4 * radius, hub))
        for y in (-wide / 2, wide / 2):
            wheel = rod([0, 0, -thick / 2], [0, 0, thick / 2], radius, color, sections=28)
            parts.append(moved(wheel, [x, y, 0], [1, 0, 0], math.pi / 2))
            parts.append(rod([x, y - 0.6 * thick, 0], [x, y + 0.6 * thick, 0], 0.45 * radius, hub,
                             sections=16))
    return parts


def vehicle(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return a toy on wheels: a car, lorry, engine, tractor, bus, digger, trolley, rocket car."""
    main, second, accent, detail = draw_palette(rng)
    long, wide, high = rng.uniform(1.2, 2.8), rng.uniform(0.5, 1.1), rng.uniform(0.25, 0.7)
    black = np.array([30.0, 30, 32]) if chance(rng, 0.6) else detail
    parts = _wheels(rng, long, wide, black, accent)
    base = 0.08
    if chance(rng, 0.5):
        parts.append(cushion([0, -wide / 2 + 0.05, base], [long, wide / 2 - 0.05, base + high],
                             main, rng.uniform(0.05, 0.2)))
    else:
        parts.append(box([0, -wide / 2 + 0.05, base], [long, wide / 2 - 0.05, base + high], main))
    top = base + high - 0.03
    kind = choose(rng, {'car': 0.3, 'lorry': 0.2, 'engine': 0.2, 'open': 0.15, 'crane': 0.15})
    side = wide / 2 - 0.08
    if kind == 'car':
        start, end = rng.uniform(0, 0.35) * long, rng.uniform(0.6, 1) * long
        rise = rng.uniform(0.25, 0.6)
        foot = rounded([end - start, 2 * side], 0.1)
        head = foot * [rng.uniform(0.5, 0.95), 0.85]
        parts.append(moved(loft([np.insert(foot, 2, 0, axis=1), np.insert(head, 2, rise, axis=1)],
                                second), [(start + end) / 2, 0, top]))
    elif kind == 'lorry':
        cab = rng.uniform(0.2, 0.35) * long
        parts += [box([long - cab, -side, top], [long, side, top + rng.uniform(0.3, 0.7)], second),
                  box([0, -side, top], [long - 1.15 * cab, side, top + rng.uniform(0.2, 1)],
                      accent)]
    elif kind == 'engine':
        radius = 0.85 * side
        parts += [rod([0.2 * long, 0, top + 0.6 * radius], [long, 0, top + 0.6 * radius], radius,
                      second, sections=28),
                  box([0, -side, top], [0.35 * long, side, top + rng.uniform(0.6, 1)], main),
                  revolved([[0.09, 0], [rng.uniform(0.09, 0.2), 0.5]], accent)]
        moved(parts[-1], [0.8 * long, 0, top + 1.4 * radius])
    elif kind == 'open':
        for x, y, dx, dy in ((0, 0, 0.05, side), (long - 0.1, 0, 0.05, side),
                             (long / 2 - 0.05, side - 0.05, long / 2, 0.05),
                             (long / 2 - 0.05, 0.05 - side, long / 2, 0.05)):
            parts.append(box([x + 0.05 - dx, y - dy, top - 0.1],
                             [x + 0.05 + dx, y + dy, top + 0.4], second))
    else:
        mast = [rng.uniform(0.2, 0.6) * long, 0, top]
        elbow = [mast[0] + rng.uniform(0.2, 0.6), 0, top + rng.uniform(0.6, 1.2)]
        tip = [elbow[0] + rng.uniform(0.5, 1.1), 0, elbow[2] - rng.uniform(-0.3, 0.7)]
        parts += [rod([mast[0], 0, top - 0.05], [mast[0], 0, top + 0.35], 0.75 * side, second),
                  beam([mast[0], 0, top + 0.2], elbow, 0.17, accent),
                  beam(elbow, tip, 0.15, accent),
                  ellipsoid(elbow, (0.14,) * 3, second),
                  box(np.array(tip) - 0.2, np.array(tip) + [0.15, 0.2, 0.1], detail)]
    if chance(rng, 0.4):
        parts += [ellipsoid([long - 0.02, y, base + 0.6 * high], (0.09,) * 3, detail)
                  for y in (-0.6 * side, 0.6 * side)]
    return assemble(parts)


def peg_toy(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return a stacking toy: rings, discs, blocks or cubes on a peg or on each other, askew."""
    palette = draw_palette(rng)
    count = int(rng.integers(3, 8))
    sizes = np.linspace(1, rng.uniform(0.3, 0.9), count)
    sizes = sizes if chance(rng, 0.7) else rng.permutation(sizes)
    kind = choose(rng, {'ring': 0.4, 'disc': 0.2, 'cube': 0.25, 'cup': 0.15})
    level = 0.0
    parts: list[Mesh] = [rod([0, 0, -0.1], [0, 0, 0.02], 1.05, palette[3], sections=32)]
    flat = section(rng, 0.5)
    for i, size in enumerate(sizes):
        color = palette[i % 4]
        high = rng.uniform(0.3, 0.45)
        if kind == 'ring':
            part = torus(size - 0.22, 0.24, color) if size > 0.5 else ellipsoid(
                [0, 0, 0], (size, size, 0.24), color)
            moved(part, [0, 0, level + 0.22])
            high = 0.42
        elif kind == 'disc':
            part = revolved([[size, level - 0.02], [size * rng.uniform(0.8, 1), level + high]],
                            color, flat)
        elif kind == 'cube':
            high = size * 0.8
            part = cushion([-0.6 * size, -0.6 * size, 0], [0.6 * size, 0.6 * size, high + 0.02],
                           color, 0.05)
            moved(part, [*rng.normal(0, 0.05, 2), level - 0.01], angle=rng.uniform(-0.5, 0.5))
        else:
            part = revolved([[0.9 * size, level - 0.02], [size * 0.75, level + 0.8 * high],
                             [size * 0.85, level + 0.8 * high], [size * 0.85, level + high]],
                            color)
        parts.append(part)
        level += high
    if kind in ('ring', 'disc'):
        parts += [rod([0, 0, 0], [0, 0, level + 0.2], 0.33, palette[3]),
                  moved(revolved(globe(rng.uniform(0.2, 0.4)), palette[0]), [0, 0, level + 0.25])]
    return assemble(parts)


def figure(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return a figure of blocks and balls: a robot, a doll, a snowman, a knight."""
    main, second, accent, detail = draw_palette(rng)
    hard = chance(rng, 0.5)

    def part(center: Points, half: Points, color: Color) -> Mesh:
        if hard:
            return box(center - half, center + half, color)
        return moved(superquadric(half, (0.7, 0.8), color), center)

    body = rng.uniform([0.3, 0.22, 0.35], [0.6, 0.4, 0.8])
    head = rng.uniform(0.22, 0.45, 3)
    leg, arm = rng.uniform(0.2, 0.9), rng.uniform(0.4, 1)
    up = np.array([0, 0, 1.0])
    top = leg + 2 * body[2]
    parts = [part((leg + body[2] * 0.97) * up, body, main),
             part((top + head[2] * 0.9) * up, head, second)]
    for sign in (-1, 1):
        across = np.array([sign, 0, 0])
        hip = across * 0.5 * body[0]
        parts.append(part(hip + up * leg / 2, np.array([0.3 * body[0], 0.15, 0.6 * leg]), accent))
        parts.append(part(hip + np.array([0, -0.1, 0.05]), np.array([0.3 * body[0], 0.28, 0.1]),
                          detail))
        shoulder = across * 0.9 * body[0] + up * (top - 0.15)
        hand = shoulder + across * rng.uniform(0.1, 0.5) + [0, rng.uniform(-0.5, 0.2),
                                                           arm * rng.choice([-1, -0.8, 0.6])]
        parts += [rod(shoulder, hand, rng.uniform(0.09, 0.16), accent),
                  ellipsoid(hand, (0.16,) * 3, second, 2)]
        parts.append(ellipsoid([sign * 0.4 * head[0], -head[1] * 0.93, top + head[2]],
                               (0.07,) * 3, detail))
    hat = choose(rng, {'none': 0.4, 'aerial': 0.2, 'cone': 0.2, 'brim': 0.2})
    crown = top + 1.8 * head[2]
    if hat == 'aerial':
        parts += [rod([0, 0, crown - 0.1], [0, 0, crown + 0.35], 0.05, accent),
                  ellipsoid([0, 0, crown + 0.35], (0.1,) * 3, detail)]
    elif hat == 'cone':
        parts.append(rod([0, 0, crown - 0.1], [0, 0, crown + rng.uniform(0.3, 0.8)],
                         0.9 * head[0], accent, 0.0, 24))
    elif hat == 'brim':
        parts += [rod([0, 0, crown - 0.08], [0, 0, crown], 1.5 * head[0], accent, sections=24),
                  rod([0, 0, crown - 0.05], [0, 0, crown + 0.35], 0.8 * head[0], accent,
                      sections=24)]
    return assemble(parts)
