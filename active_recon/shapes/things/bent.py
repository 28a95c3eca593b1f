"""Thin walls bent: folded, rolled and waved sheets, shades, hats, funnels."""

import math

from active_recon.shapes.common.drawing import choose
from active_recon.shapes.common.parts import assemble, Color, Mesh, rod
from active_recon.shapes.common.soft_parts import filleted
from active_recon.shapes.things.colors import draw_palette
from active_recon.shapes.things.drawing import arc, chance, section, smooth_profile
from active_recon.shapes.things.solids import (
    extruded,
    hollow,
    moved,
    revolved,
    skin,
    swept,
)
import numpy as np
import trimesh


def sheet(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return a bent sheet: folded, rolled, waved, cupped, a gutter, a tile, a tent, a fan."""
    main, second, _, _ = draw_palette(rng)
    thick, wide = rng.uniform(0.03, 0.07), rng.uniform(0.5, 2.2)
    kind = choose(rng, {'folded': 0.3, 'rolled': 0.25, 'waved': 0.2, 'cupped': 0.25})
    if kind == 'cupped':
        return _cupped(rng, main, second, thick)
    if kind == 'folded':
        angle = rng.uniform(0, 6.3)
        line = [np.zeros(2)]
        for _ in range(int(rng.integers(2, 7))):
            line.append(line[-1] + rng.uniform(0.4, 1) * np.array([math.cos(angle),
                                                                   math.sin(angle)]))
            angle += rng.choice([-1, 1]) * rng.uniform(0.5, 1.9)
        path = np.array(line)
        path = filleted(path, 0.12) if chance(rng, 0.5) else path
    elif kind == 'rolled':
        t = np.linspace(0, rng.uniform(1.5, 9), 60)
        radius = 1 - rng.uniform(0.05, 0.1) * t
        path = np.column_stack([radius * np.cos(t), radius * np.sin(t)])
    else:
        x = np.linspace(-1.5, 1.5, 60)
        path = np.column_stack([x, rng.uniform(0.1, 0.4) * np.sin(rng.uniform(3, 12) * x)
                                + rng.uniform(-0.4, 0.4) * x**2])
    flat = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) * [wide / 2, thick / 2]
    scales = np.linspace(1, rng.uniform(0.6, 1), len(path)) if chance(rng, 0.3) else 1.0
    line3 = np.column_stack([path[:, 0], np.zeros(len(path)), path[:, 1]])
    # The section's first axis runs across: the frame's normal lies in the plane of the path
    normal = np.array([-(path[1] - path[0])[1], 0, (path[1] - path[0])[0]])
    colors = np.where((np.arange(len(path) - 1) % 2 == 0)[:, None], main,
                      second if kind == 'folded' and chance(rng, 0.4) else main)
    mesh = swept(line3, flat, colors, scales=scales, up=normal)
    return mesh if chance(rng, 0.6) else moved(mesh, axis=[1, 0, 0], angle=math.pi / 2)


def _cupped(rng: np.random.Generator, main: Color, second: Color, thick: float) -> Mesh:
    """Return a sheet bent both ways: a saddle, a bowl's piece, a leaf, a crisp."""
    side = np.linspace(-1, 1, 25)
    x, y = np.meshgrid(side, side * rng.uniform(0.4, 1), indexing='ij')
    z = (rng.uniform(-0.6, 0.6) * x**2 + rng.uniform(-0.6, 0.6) * y**2 + rng.uniform(-0.3, 0.3)
         * x * y + rng.uniform(0, 0.12) * np.sin(rng.uniform(2, 8) * x + rng.uniform(0, 6)))
    if chance(rng, 0.5):  # a round or a pointed edge
        y = y * (1.02 - np.abs(x) ** rng.uniform(1.5, 4))
    rings = [np.vstack([np.column_stack([x[i], y[i], z[i] + thick]),
                        np.column_stack([x[i], y[i], z[i] - thick])[::-1]]) for i in range(25)]
    colors = np.where((np.arange(24) // 4 % 2 == 0)[:, None], main,
                      second if chance(rng, 0.3) else main)
    return skin(rings, colors)


def shade(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return an open shell about an axis: a lampshade, bell, funnel, hat, helmet, half a tube."""
    main, second, accent, _ = draw_palette(rng)
    high, wall = rng.uniform(0.5, 1.8), rng.uniform(0.05, 0.09)
    kind = choose(rng, {'shade': 0.35, 'hat': 0.25, 'funnel': 0.15, 'half': 0.25})
    top = rng.uniform(0.25, 1)
    line = smooth_profile([[1, 0], [rng.uniform(0.5, 1.1), 0.4 * high], [top, high]], 2)
    flat = section(rng, 0.6)
    if kind == 'half':
        turn = rng.uniform(1.5, 5)
        around = arc(0, turn, 1, 40)
        both = np.vstack([around, around[::-1] * (1 - wall)])
        rings = [np.column_stack([both * radius, np.full(80, level)]) for radius, level in line]
        mesh = skin(rings, main)
        return mesh if chance(rng, 0.5) else moved(mesh, axis=[0, 1, 0], angle=math.pi / 2)
    inner = line[::-1] - [wall, 0]
    if kind == 'shade':
        parts = [revolved(np.vstack([line, inner]), np.vstack([
            np.tile(main, (len(line), 1)), np.tile(second, (len(line), 1))]), flat, closed=True)]
        if chance(rng, 0.6):  # a spider that holds it, and what it hangs from
            level = high * 0.85
            reach = float(np.interp(level, line[:, 1], line[:, 0])) * float(
                np.abs(flat[:, 0]).max())
            parts += [rod([-reach, 0, level], [reach, 0, level], 0.04, accent),
                      rod([0, 0, level], [0, 0, high + rng.uniform(0.1, 0.8)], 0.07, accent)]
        return assemble(parts)
    if kind == 'funnel':
        tip = rng.uniform(0.1, 0.2)
        line = np.vstack([[[1, 0], [1, 0.12 * high], [tip, 0.7 * high], [tip, 1.3 * high]]])
        inner = line[::-1] - [0.6 * tip, 0]
        return revolved(np.vstack([line, inner]), main, closed=True)
    crown = hollow(np.vstack([line, [[0.6 * top, high * 1.08], [0.0, high * 1.1]]])[::-1]
                   * [1, -1], wall) * [1, -1]
    parts = [revolved(crown, main, flat)]
    if chance(rng, 0.6):
        brim = rng.uniform(1.2, 1.8)
        outline, hole = flat * brim, flat * 0.93
        parts.append(extruded(outline, 0, wall, main if chance(rng, 0.6) else second, [hole]))
    if chance(rng, 0.5):
        parts.append(revolved(np.vstack([line[:3] * [1.03, 1]]), accent, flat))
    return assemble(parts)
