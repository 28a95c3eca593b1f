"""Small craft under oars and paddles: rowing boats, canoes, kayaks, gondolas."""

import math

from active_recon.shapes.common.parts import (
    assemble,
    beam,
    box,
    Color,
    Mesh,
    mirrored,
    rod,
)
from active_recon.shapes.common.soft_parts import cushion
from active_recon.shapes.watercraft.house import canopy, outboard
from active_recon.shapes.watercraft.hull import Hull, Livery, Well
import numpy as np


def _thwart(hull: Hull, x: float, v: float, depth: float, livery: Livery) -> Mesh:
    """Return a bench across an open hull."""
    s = x / hull.length + 0.5
    reach = s + depth / hull.length * np.array([-0.6, 0, 0.6])
    half = float((hull.half_beam(reach, v - 0.04) - 0.006 * hull.length).min())
    z = float(hull.z(s, v))
    return box((x - depth / 2, -half, z - 0.035 * hull.depth), (x + depth / 2, half,
               z + 0.06 * hull.depth), livery.wood)


def _oar(hull: Hull, x: float, length: float, color: Color, shipped: bool) -> Mesh:
    """Return a pair of oars out to both sides, or laid along the gunwales."""
    thick, y, z = hull.length / 45, hull.half_deck(x), hull.deck(x) + hull.length / 120
    if shipped:
        start, end = np.array([x + 0.2 * length, y * 0.72, z]), np.array([x - 0.6 * length,
                                                                        y * 0.6, z])
    else:
        start = np.array([x + 0.12 * length, y * 0.45, z + 0.05 * length])
        end = np.array([x - 0.22 * length, y + 0.6 * length, z - 0.14 * length])
    blade = end + (end - start) * 0.22
    return mirrored(assemble([rod(start, end, thick / 2, color, sections=6),
                              beam(end - (end - start) * 0.02, blade, thick * 3, color,
                                   thick * 0.8)]))


def rowboat(rng: np.random.Generator, livery: Livery) -> list[Mesh]:
    """Return a rowing boat, a dory, a dinghy with an engine or a punt, with thwarts and oars."""
    kind = rng.choice(['boat', 'dory', 'punt', 'double'], p=[0.5, 0.22, 0.1, 0.18])
    length = rng.uniform(2.6, 6)
    hull = Hull(
        length, length * rng.uniform(0.3, 0.46) * (0.85 if kind == 'double' else 1),
        length * rng.uniform(0.12, 0.2), 'flat' if kind in ('dory', 'punt') else 'round',
        parallel=rng.uniform(0.3, 0.5), entry=(rng.uniform(1.2, 1.6), rng.uniform(1.7, 2.3)),
        blunt=rng.uniform(0.5, 0.8) if kind == 'punt' else 0.03, run=rng.uniform(0.35, 0.5),
        stern=0.08 if kind == 'double' else rng.uniform(0.5, 0.85), tuck=rng.uniform(0.4, 0.9),
        rake=rng.uniform(0.04, 0.16), stem=rng.uniform(0.8, 1.8), counter=rng.uniform(0, 0.1),
        sheer=(rng.uniform(0.1, 0.6), rng.uniform(0, 0.35)),
        rocker=(rng.uniform(0, 0.3), rng.uniform(0, 0.2)))
    wall = hull.length * rng.uniform(0.016, 0.026)
    floor = rng.uniform(0.12, 0.3)
    parts = [hull.skin(livery, Well(0.03 if kind != 'double' else 0.08,
                                    rng.choice([0.9, 0.93, 0.75]), floor, wall),
                       rng.choice([0.0, 0.2, 0.4]), rng.choice([0.8, 0.9]))]
    for x in np.linspace(-0.38, rng.uniform(0.1, 0.28), int(rng.integers(2, 5))):
        parts.append(_thwart(hull, x * length, rng.uniform(0.55, 0.72), 0.08 * length, livery))
    if rng.random() < 0.45:
        parts.append(_oar(hull, rng.uniform(-0.1, 0.1) * length, length * rng.uniform(0.5, 0.65),
                          livery.wood, rng.random() < 0.4))
    elif kind != 'double' and rng.random() < 0.5:
        parts.append(outboard(float(hull.x(0, 1)), 0, hull.deck(-length / 2), length * 0.11,
                              livery.accent))
    if rng.random() < 0.1:
        top = hull.depth + length * rng.uniform(0.2, 0.3)
        parts.append(canopy((-0.32 * length, 0.15 * length), hull.beam * 0.42, hull.depth * 0.4,
                            top, length / 35, livery.sail, livery.trim))
    return parts


def canoe(rng: np.random.Generator, livery: Livery) -> list[Mesh]:
    """Return a canoe, a decked kayak or a gondola, pointed at both ends."""
    kind = rng.choice(['canoe', 'kayak', 'gondola', 'outrigger'], p=[0.45, 0.33, 0.14, 0.08])
    length = rng.uniform(3.2, 6)
    slim = rng.uniform(0.11, 0.15) if kind in ('kayak', 'gondola') else rng.uniform(0.15, 0.22)
    rise = {'canoe': (0.3, 0.9), 'kayak': (0.1, 0.4), 'gondola': (1.2, 2.6),
            'outrigger': (0.1, 0.7)}[kind]
    middle = rng.uniform(0.42, 0.5)
    hull = Hull(length, length * slim, length * rng.uniform(0.06, 0.1), 'round', parallel=middle,
                entry=(1.2, rng.uniform(1.5, 2.2)), run=middle, stern=0.04, tuck=0.9,
                rake=rng.uniform(0.02, 0.08), stem=rng.uniform(1.2, 2.5), counter=0.04,
                sheer=(rng.uniform(*rise), rng.uniform(*rise)),
                rocker=(rng.uniform(0.1, 0.5), rng.uniform(0.1, 0.5)))
    wall = length * 0.013
    if kind == 'kayak':
        parts = [hull.skin(livery, Well(0.38, 0.58, 0.35, hull.beam * 0.16), 0.0, 0.75)]
        if rng.random() < 0.5:
            half = length * rng.uniform(0.16, 0.2)
            z, tilt = hull.depth * 1.15, length * rng.uniform(-0.04, 0.04)
            ends = np.array([[0.06 * length, y, z + tilt * y / half] for y in (-half, half)])
            parts.append(rod(ends[0], ends[1], length / 90, livery.trim, sections=8))
            parts += [beam(end, end + (0, math.copysign(0.07 * length, end[1]), 0),
                           length / 28, livery.accent, length / 60) for end in ends]
        return parts
    parts = [hull.skin(livery, Well(0.07, 0.93, 0.25, wall), rng.choice([0.0, 0.35]), 0.85)]
    for x in np.linspace(-0.3, 0.3, int(rng.integers(2, 5))):
        parts.append(_thwart(hull, x * length, 0.75, 0.05 * length, livery))
    if kind == 'gondola':
        for side in (-1, 1):
            top = float(hull.z((side + 1) / 2, 1))
            x = side * length * 0.475
            parts.append(box((x - 0.012 * length, -0.01 * length, top - 0.1 * length),
                             (x + 0.012 * length, 0.01 * length, top + 0.07 * length),
                             livery.trim))
        parts.append(cushion((-0.1 * length, -hull.beam * 0.3, hull.depth * 0.25),
                             (0.02 * length, hull.beam * 0.3, hull.depth * 1.3), livery.accent))
    elif kind == 'outrigger':
        y, thick = length * rng.uniform(0.18, 0.25), length / 32
        parts.append(rod((-0.3 * length, y, thick), (0.32 * length, y, thick), thick,
                         livery.wood, end_radius=thick * 0.7))
        parts += [_boom(x * length, y, hull.deck(x * length), thick, livery.wood)
                  for x in (-0.2, 0.2)]
    elif rng.random() < 0.4:
        parts.append(_oar(hull, 0.05 * length, length * 0.4, livery.wood, False))
    return parts


def _boom(x: float, y: float, z: float, thick: float, color: Color) -> Mesh:
    """Return an outrigger's boom from the far gunwale out and down to its float at y."""
    return assemble([rod((x, -0.25 * y, z), (x, 0.75 * y, z), thick / 2, color, sections=8),
                     rod((x, 0.72 * y, z), (x, y, thick), thick / 2, color, sections=8)])
