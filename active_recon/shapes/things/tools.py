"""Hand tools: hammers and axes, things in line with their grip, spanners, pincers."""

import math

from active_recon.shapes.common.drawing import choose
from active_recon.shapes.common.parts import assemble, beam, box, Color, ellipsoid, Mesh, rod
from active_recon.shapes.common.soft_parts import smoothed
from active_recon.shapes.things.colors import draw_palette
from active_recon.shapes.things.drawing import chance, section, smooth_profile
from active_recon.shapes.things.solids import circle, extruded, moved, revolved, swept
import numpy as np
import trimesh


def _grip(rng: np.random.Generator, long: float, thick: float, main: Color,
          second: Color) -> list[Mesh]:
    """Return a handle along z from -long up to 0, swollen, ringed or flat."""
    knots = int(rng.integers(3, 6))
    radii = thick * rng.uniform(0.75, 1.35, knots)
    profile = smooth_profile(np.column_stack([radii, np.linspace(-long, 0.02, knots)]), 2)
    flat = section(rng, 0.6, 24) * [1, rng.uniform(0.6, 1)]
    parts = [revolved(profile, main, flat)]
    if chance(rng, 0.4):
        start, end = np.sort(rng.uniform(-0.95 * long, -0.05 * long, 2))
        inside = (profile[:, 1] >= start) & (profile[:, 1] <= end)
        if inside.sum() >= 2:
            parts.append(revolved(profile[inside] * [1.12, 1], second, flat))
    return parts


def hammer(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return a hammer, a mallet, an axe, a pickaxe, a hoe or a rake: a head across a handle."""
    main, second, accent, _ = draw_palette(rng)
    long, thick = rng.uniform(1.3, 3.2), rng.uniform(0.09, 0.2)
    parts = _grip(rng, long, thick, main, accent)
    half, deep = rng.uniform(0.35, 0.9), rng.uniform(0.15, 0.4)
    kind = choose(rng, {'mallet': 0.25, 'hammer': 0.3, 'axe': 0.2, 'pick': 0.15, 'rake': 0.1})
    if kind == 'mallet':
        if chance(rng, 0.5):
            parts.append(rod([-half, 0, 0], [half, 0, 0], deep, second, sections=28))
            parts += [rod([s * half, 0, 0], [s * half * 1.08, 0, 0], deep * 1.08, accent,
                          sections=28) for s in (-1, 1)]
        else:
            parts.append(box([-half, -deep, -deep], [half, deep, deep], second))
    elif kind == 'hammer':
        parts += [rod([0, 0, 0], [half, 0, 0], 0.7 * deep, second, sections=8),
                  rod([0.8 * half, 0, 0], [1.1 * half, 0, 0], 0.95 * deep, second, sections=20),
                  box([-0.7 * deep, -0.8 * deep, -deep], [0.7 * deep, 0.8 * deep, 0.9 * deep],
                      second)]
        if chance(rng, 0.5):  # a claw
            path = smoothed(np.array([[0, 0, 0], [-0.6 * half, 0, 0.1],
                                      [-1.1 * half, 0, -0.5 * half]]), 2)
            for side in (-0.5, 0.5):
                prong = path + np.array([0, side * deep, 0]) * np.linspace(
                    0.4, 1.2, len(path))[:, None]
                parts.append(swept(prong, circle(8, 0.4 * deep), second,
                                   scales=np.linspace(1.2, 0.4, len(path))))
        else:
            parts.append(beam([0, 0, 0], [-half, 0, 0], deep * 1.2, second, end_scale=0.25))
    elif kind == 'axe':
        edge, wide = rng.uniform(0.4, 0.9), rng.uniform(0.12, 0.25)
        outline = smoothed([[-0.2, -deep], [0.3, -0.8 * deep], [edge, -edge], [edge * 1.2, 0],
                            [edge, edge * 0.7], [0.3, 0.8 * deep], [-0.2, deep]], 1)
        parts.append(moved(extruded(outline, -wide / 2, wide / 2, second), axis=[1, 0, 0],
                           angle=math.pi / 2))
        if chance(rng, 0.3):
            parts.append(moved(extruded(outline, -wide / 2, wide / 2, second), [0, 0, 0],
                               [0, 1, 0], math.pi))
            moved(parts[-1], axis=[1, 0, 0], angle=math.pi / 2)
    elif kind == 'pick':
        path = smoothed([[-1.5 * half, 0, -0.5 * half], [0, 0, 0.25],
                         [1.5 * half, 0, -0.5 * half]], 3)
        bow = 1 - 0.8 * np.abs(np.linspace(-1, 1, len(path)))
        parts.append(swept(path, circle(8, 0.8 * deep), second, scales=np.maximum(bow, 0.15)))
    else:
        parts.append(box([-0.1, -half, -0.08], [0.1, half, 0.08], second))
        for y in np.linspace(-0.93 * half, 0.93 * half, int(rng.integers(4, 9))):
            parts.append(rod([0, y, 0], [rng.uniform(0.35, 0.4), y, -0.1], 0.06, second))
    return assemble(parts)


def handled(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return something in line with its grip: a screwdriver, brush, knife, spoon, torch, spade."""
    main, second, accent, detail = draw_palette(rng)
    grip, thick = rng.uniform(0.7, 1.8), rng.uniform(0.13, 0.3)
    parts = _grip(rng, grip, thick, main, accent)
    long = rng.uniform(0.6, 1.8)
    kind = choose(rng, {'driver': 0.22, 'brush': 0.2, 'knife': 0.15, 'spoon': 0.13, 'torch': 0.15,
                        'spade': 0.15})
    if kind == 'driver':
        shaft = rng.uniform(0.06, 0.11)
        parts.append(rod([0, 0, -0.1], [0, 0, long], shaft, second))
        parts.append(beam([0, 0, long - 0.1], [0, 0, long + 0.2], 3 * shaft, second,
                          height=1.2 * shaft) if chance(rng, 0.6) else
                     rod([0, 0, long - 0.1], [0, 0, long + 0.3], 1.8 * shaft, second, 0.5 * shaft,
                         sections=6))
    elif kind == 'brush':
        wide, deep = rng.uniform(0.2, 0.7), rng.uniform(0.12, 0.3)
        parts += [box([-wide, -deep, -0.05], [wide, deep, 0.3], second),
                  beam([0, 0, 0.25], [0, 0, 0.3 + 0.6 * long], 1.9 * deep, detail,
                       height=1.9 * wide, end_scale=rng.uniform(0.5, 1.2))]
    elif kind == 'knife':
        wide = rng.uniform(0.13, 0.3)
        outline = np.array([[-wide, -0.2], [wide, -0.2], [wide, 0.7 * long],
                            [rng.uniform(-wide, wide), 1.3 * long], [-wide, 0.8 * long]])
        blade = extruded(outline, -0.045, 0.045, second)
        parts.append(moved(blade, axis=[1, 0, 0], angle=math.pi / 2))
        if chance(rng, 0.5):
            parts.append(box([-0.5, -0.13, -0.06], [0.5, 0.13, 0.08], accent))
    elif kind == 'spoon':
        wide = rng.uniform(0.3, 0.6)
        dome = ellipsoid([0, 0, 0], [wide, 0.25, wide * rng.uniform(1, 1.5)], second, 3)
        keep = dome.triangles_center[:, 1] < 0.02
        dome.update_faces(keep)
        parts += [rod([0, -0.02, -0.1], [0, -0.02, 0.7 * long], 0.09, second),
                  moved(dome, [0, 0.08, 0.7 * long + wide])]
    elif kind == 'torch':
        wide = thick * rng.uniform(1.3, 2.2)
        parts += [revolved([[thick, -0.1], [wide, 0.35], [wide, 0.6]], second),
                  revolved([[0.85 * wide, 0.55], [0.85 * wide, 0.62]], detail),
                  box([thick * 0.6, -0.06, -0.5 * grip], [thick * 1.3, 0.06, -0.3 * grip], detail)]
    else:
        wide = rng.uniform(0.35, 0.6)
        outline = smoothed([[-wide, 0], [wide, 0], [wide, 0.6 * long], [0, 1.2 * long],
                            [-wide, 0.6 * long]], 1)
        blade = moved(extruded(outline, -0.05, 0.05, second), axis=[1, 0, 0], angle=math.pi / 2)
        parts += [rod([0, 0, -0.1], [0, 0, 0.8], 0.1, accent), moved(blade, [0, 0, 0.55])]
        if chance(rng, 0.5):
            parts.append(rod([-0.35, 0, -grip], [0.35, 0, -grip], 0.1, accent))
    return assemble(parts)


def spanner(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return a flat spanner, key or bottle opener: jaws, rings or a bit at the ends of a bar."""
    main, second, _, _ = draw_palette(rng)
    half, wide, thick = rng.uniform(0.7, 1.6), rng.uniform(0.12, 0.24), rng.uniform(0.1, 0.3)
    parts: list[Mesh] = [box([-half, -wide, -0.35 * thick], [half, wide, 0.35 * thick],
                             second if chance(rng, 0.3) else main)]
    for sign in (-1, 1):
        kind = choose(rng, {'jaw': 0.4, 'ring': 0.35, 'bare': 0.1, 'bit': 0.15})
        size = wide * rng.uniform(1.6, 2.6)
        if kind == 'jaw':
            mouth = size * rng.uniform(0.35, 0.55)
            around = circle(36, size)
            jaw = around[np.abs(np.arctan2(around[:, 1], around[:, 0])) > math.asin(mouth / size)]
            start = int(np.argmax(jaw[:, 1] * (jaw[:, 0] > 0)))
            jaw = np.roll(jaw, -start, axis=0)
            low, high = [-0.2 * size, -mouth], [-0.2 * size, mouth]
            order = [high, *jaw, low] if jaw[0, 1] > 0 else [low, *jaw, high]
            head = extruded(order, -thick / 2, thick / 2, main)
            moved(head, angle=rng.uniform(-0.5, 0.5))
        elif kind == 'ring':
            hole = circle(int(rng.choice([6, 12, 24])), rng.uniform(0.45, 0.7) * size)
            head = extruded(circle(36, size), -thick / 2, thick / 2, main, [hole])
        elif kind == 'bit':
            head = box([-0.1, 0, -0.3 * thick], [0.15, 3 * wide, 0.3 * thick], main)
        else:
            head = extruded(circle(24, 1.05 * wide), -0.4 * thick, 0.4 * thick, main)
        moved(head, angle=0 if sign > 0 else math.pi)
        at = half + (0.75 * size if kind in ('jaw', 'ring') else -0.1)
        parts.append(moved(head, [sign * at, 0, 0]))
    return assemble(parts)


def pincers(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return scissors, pliers, tongs or a clothes peg: two bent arms about a pivot."""
    main, second, accent, _ = draw_palette(rng)
    grip, jaw, open_by = rng.uniform(0.8, 1.8), rng.uniform(0.4, 1.5), rng.uniform(0.08, 0.5)
    thick, bow = rng.uniform(0.09, 0.17), rng.uniform(0, 0.5)
    loops = chance(rng, 0.5)
    parts: list[Mesh] = [rod([0, 0, -0.2], [0, 0, 0.2], rng.uniform(0.13, 0.25), accent,
                             sections=20)]
    for sign in (-1, 1):
        path = smoothed([[-grip, -open_by - 0.1, 0], [-0.6 * grip, -open_by - bow, 0],
                         [-0.1, -0.12, 0], [0.1, 0.12, 0], [0.5 * jaw, 0.15 + 0.3 * bow, 0],
                         [jaw, open_by * 0.3 + 0.04, 0]], 2) * [1, sign, 1]
        scales = np.interp(path[:, 0], [-grip, -0.3, 0.15, jaw], [1, 1, 1.4, 0.5])
        flat = circle(10, thick) * [rng.uniform(0.9, 1.2), 0.9]
        colors = np.where((path[:-1, 0] < -0.3)[:, None], second, main)
        parts.append(swept(path, flat, colors, scales=scales))
        if loops:
            size = rng.uniform(0.28, 0.42)
            ring = revolved(thick * circle(10) + [size, 0], second, closed=True)
            off = open_by + 0.1 + 0.4 * size
            parts.append(moved(ring, [-grip - size * 0.9, -sign * off, 0]))
    return assemble(parts)
