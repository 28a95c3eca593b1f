"""Submarines: modern ones like cigars, old ones with a casing and a gun."""

import math

from active_recon.shapes.common.parts import (
    beam,
    box,
    loft,
    Mesh,
    rod,
    superellipse,
)
from active_recon.shapes.common.skin import painted_loft
from active_recon.shapes.watercraft.hull import Hull, Livery
from active_recon.shapes.watercraft.navy import turret
import numpy as np


def submarine(rng: np.random.Generator, livery: Livery) -> list[Mesh]:
    """Return a submarine: a modern one like a cigar, or an old one with a casing and a gun."""
    old = rng.random() < 0.35
    length = rng.uniform(60, 170)
    radius = length * (rng.uniform(0.045, 0.06) if old else rng.uniform(0.05, 0.075))
    wide = radius * (rng.uniform(1.5, 1.8) if rng.random() < 0.08 else 1)
    parts: list[Mesh] = []
    axis = radius * 1.15
    fore, aft = rng.uniform(0.1, 0.2), rng.uniform(0.25, 0.42)
    steps = np.array([0.0, 0.05, 0.2, 0.45, 0.7, 1.0])
    nose = np.sqrt(1 - (1 - steps) ** 2).clip(0.05)
    tail = 1 - steps ** rng.uniform(1.5, 2.2) * 0.95
    x = np.concatenate([0.5 - fore * steps, -0.5 + aft * (1 - steps)]) * length
    sizes = np.concatenate([nose, tail])
    circle = superellipse(2, 2, 2, 16)
    loops = [np.insert(circle * [wide, radius] * size + (0, axis), 0, at, axis=1)
             for at, size in zip(x, sizes, strict=True)]
    level = circle[:, 1] + np.roll(circle[:, 1], -1)
    around = np.where((level < -0.4)[:, None], livery.boot, livery.hull)
    parts.append(painted_loft(loops, np.tile(around, (len(x) - 1, 1, 1)),
                              (livery.hull, livery.hull)))
    top = axis + radius
    thick = length / 60
    if old:
        deck = Hull(length * 0.98, radius * 1.3, radius * 1.1, 'box', parallel=0.5,
                    entry=(1.6, 1.8), run=0.4, stern=0.2, sheer=(0.3, 0), rake=0.0, counter=0.0)
        casing = deck.skin(livery, None, 0, 1)
        casing.apply_translation((0, 0, axis))
        parts.append(casing)
        top = axis + radius * 1.1
        if rng.random() < 0.7:
            parts.append(turret(length * 0.18, top, radius * 0.6, 1, 1, livery.trim, False))
    at, tall = rng.uniform(0.02, 0.2) * length, radius * rng.uniform(1.0, 1.8)
    chord = length * rng.uniform(0.09, 0.16)
    outline = superellipse(chord, radius * rng.uniform(0.55, 0.85), 2, 16)
    outline[:, 1] *= np.where(outline[:, 0] < 0, 1 + 0.9 * outline[:, 0] / chord, 1)
    leans = rng.uniform(0, 0.1)
    tower = [np.insert(outline * s + (at - leans * chord * s, 0), 2, z, axis=1)
             for s, z in ((1.15, axis + radius * 0.6), (1.0, top + 0.2 * tall), (
                 0.94, top + 0.94 * tall), (0.8, top + tall))]
    parts.append(loft(tower, livery.house))
    plane = radius * rng.uniform(0.8, 1.3)
    if rng.random() < 0.55:
        z = top + tall * 0.55
        parts.append(box((at - 0.01 * length, -plane, z - thick * 0.4), (at + 0.03 * length, plane,
                         z + thick * 0.4), livery.house))
    else:
        parts.append(box((0.33 * length, -radius * 1.8, axis - thick * 0.4), (
            0.37 * length, radius * 1.8, axis + thick * 0.4), livery.house))
    for i in range(int(rng.integers(1, 4))):
        place = at + (0.2 - 0.2 * i) * chord
        parts.append(rod((place, 0, top + tall * 0.7), (place, 0, top + tall * rng.uniform(
            1.3, 1.9)), thick * 0.4, livery.trim, sections=8))
    turn = math.pi / 4 if rng.random() < 0.2 else 0.0
    for k in range(4):
        angle = turn + k * math.pi / 2
        out = np.array([0, math.cos(angle), math.sin(angle)])
        root = np.array([-0.42 * length, 0, axis])
        tip = root + out * radius * rng.uniform(1.15, 1.5) - (0.01 * length, 0, 0)
        across = np.array([0, -out[2], out[1]])
        section = [(root if end == 0 else tip) + (s * 0.028 * length, 0, 0) + t * thick * 0.4
                   * across for end in (0, 1) for s, t in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        parts.append(loft([section[:4], section[4:]], livery.house))
    hub = -0.5 * length
    parts.append(rod((hub - 0.02 * length, 0, axis), (hub + 0.06 * length, 0, axis), radius * 0.18,
                     livery.trim, sections=8))
    for k in range(5):
        angle = k * 2 * math.pi / 5
        parts.append(beam((hub - 0.01 * length, 0, axis), (
            hub - 0.01 * length, radius * 0.65 * math.cos(angle), axis + radius * 0.65
            * math.sin(angle)), thick * 0.9, livery.trim, thick * 0.7))
    return parts
