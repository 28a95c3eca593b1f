"""Things about the house: cases with knobs and screens, plants in pots."""

import math

from active_recon.shapes.common.drawing import choose
from active_recon.shapes.common.parts import assemble, box, ellipsoid, Mesh, rod
from active_recon.shapes.common.soft_parts import cushion, smoothed
from active_recon.shapes.things.colors import draw_palette, ripe
from active_recon.shapes.things.drawing import chance, section, smooth_profile
from active_recon.shapes.things.solids import (
    circle,
    hollow,
    moved,
    revolved,
    superquadric,
    swept,
)
import numpy as np
import trimesh


def device(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return a case with knobs, keys, a screen, a lens, an aerial, feet: a radio, a camera."""
    main, second, accent, detail = draw_palette(rng)
    half = rng.uniform([0.5, 0.15, 0.25], [1.2, 0.6, 0.9])
    parts: list[Mesh] = [box(-half, half, main) if chance(rng, 0.4) else
                         cushion(-half, half, main, rng.uniform(0.05, 0.15))]
    front = -half[1]
    for _ in range(int(rng.integers(1, 6))):
        x, z = rng.uniform(-0.6, 0.6, 2) * half[[0, 2]]
        kind = choose(rng, {'knob': 0.3, 'screen': 0.25, 'lens': 0.2, 'keys': 0.25})
        if kind == 'knob':
            parts.append(rod([x, front + 0.05, z], [x, front - rng.uniform(0.06, 0.2), z],
                             rng.uniform(0.1, 0.2), second, sections=20))
        elif kind == 'screen':
            size = rng.uniform(0.25, 0.7) * half[[0, 2]]
            parts.append(box([x - size[0], front - 0.03, z - size[1]],
                             [x + size[0], front + 0.05, z + size[1]], detail))
        elif kind == 'lens':
            radius = rng.uniform(0.3, 0.8) * half[2]
            lens = revolved(hollow([[0, 0], [radius, 0], [radius, rng.uniform(0.2, 0.7)]],
                                   0.2 * radius), second)
            parts.append(moved(lens, [0.4 * x, front + 0.05, 0.3 * z], [1, 0, 0], math.pi / 2))
        else:
            pitch = 0.16
            parts += [box([x + i * pitch, front - 0.06, z + j * pitch],
                          [x + i * pitch + 0.1, front + 0.05, z + j * pitch + 0.1], accent)
                      for i in range(2) for j in range(2) if x + i * pitch + 0.1 < half[0]
                      and z + j * pitch + 0.1 < half[2]]
    if chance(rng, 0.3):
        x = rng.uniform(-0.8, 0.8) * half[0]
        tip = [x + rng.uniform(-0.3, 0.3), 0, half[2] + rng.uniform(0.3, 0.9)]
        parts.append(rod([x, 0, half[2] - 0.1], tip, 0.04, detail))
    if chance(rng, 0.35):
        wide, rise = rng.uniform(0.5, 0.85) * half[0], rng.uniform(0.2, 0.5)
        path = smoothed([[-wide, 0, half[2] - 0.05], [-wide, 0, half[2] + rise],
                         [wide, 0, half[2] + rise], [wide, 0, half[2] - 0.05]], 2)
        parts.append(swept(path, circle(10, rng.uniform(0.05, 0.1)), second))
    if chance(rng, 0.5):
        parts += [rod([x * 0.75 * half[0], y * 0.6 * half[1], -half[2] + 0.05],
                      [x * 0.8 * half[0], y * 0.6 * half[1], -half[2] - rng.uniform(0.08, 0.1)],
                      0.09, detail) for x in (-1, 1) for y in (-1, 1)]
    return assemble(parts)


def plant(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return a plant in a pot, a toy tree or a mushroom."""
    main, second, _, _ = draw_palette(rng)
    green = ripe(rng, (0.2, 0.42)) if chance(rng, 0.8) else second
    high = rng.uniform(0.5, 0.9)
    pot = hollow(smooth_profile([[0, 0], [rng.uniform(0.3, 0.5), 0], [0.55, high]], 1), 0.07)
    parts: list[Mesh] = [revolved(pot, main, section(rng, 0.7)),
                         revolved([[0.42, 0.6 * high], [0.42, 0.75 * high]], [70, 50, 35])]
    stem, base = rng.uniform(0.2, 1.2), 0.7 * high
    kind = choose(rng, {'leaves': 0.4, 'crown': 0.3, 'cactus': 0.3})
    if kind == 'leaves':
        for angle in 2 * math.pi * np.arange(n := int(rng.integers(5, 12))) / n:
            out, rise = rng.uniform(0.4, 1.1), rng.uniform(0.5, 1.5)
            path = smoothed([[0, 0, base - 0.1], [0.3 * out, 0, base + rise],
                             [out, 0, base + rise * rng.uniform(0.3, 1)]], 3)
            wide = np.sin(np.linspace(0.25, math.pi - 0.1, len(path)))
            leaf = swept(path, circle(8) * [rng.uniform(0.14, 0.26), 0.045], green, scales=wide)
            parts.append(moved(leaf, angle=float(angle)))
    elif kind == 'crown':
        parts.append(rod([0, 0, base - 0.1], [0, 0, base + stem + 0.2], 0.1, [95, 65, 40]))
        for _ in range(int(rng.integers(1, 6))):
            center = np.array([*rng.normal(0, 0.2, 2), base + stem + 0.4])
            parts.append(ellipsoid(center, rng.uniform(0.35, 0.7, 3), green))
    else:
        tall = rng.uniform(0.5, 1.2)
        parts.append(moved(superquadric([0.32, 0.32, tall], (0.8, 1), green),
                           [0, 0, base + 0.8 * tall]))
        for side in (-1, 1):
            path = smoothed([[0, 0, base + 0.7 * tall], [side * 0.65, 0, base + 0.7 * tall],
                             [side * 0.65, 0, base + 1.4 * tall]], 2)
            parts.append(swept(path, circle(12, 0.15), green))
    return assemble(parts)
