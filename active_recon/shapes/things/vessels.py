"""Vessels with something to hold them by: mugs, jugs and teapots, buckets, pans and pots."""

import math

from active_recon.shapes.common.drawing import choose
from active_recon.shapes.common.parts import assemble, Color, Mesh
from active_recon.shapes.common.soft_parts import smoothed
from active_recon.shapes.things.colors import draw_palette
from active_recon.shapes.things.drawing import arc, chance, globe, section, smooth_profile
from active_recon.shapes.things.solids import circle, hollow, moved, pipe, revolved, swept
import numpy as np
from numpy.typing import NDArray
import trimesh

Points = NDArray[np.float64]


def mug(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return a cup, a mug or a beaker, open above, with none, one or two handles."""
    main, second, accent, detail = draw_palette(rng)
    height, wall = rng.uniform(1, 3), rng.uniform(0.07, 0.15)
    foot, belly = rng.uniform(0.55, 1), rng.uniform(0.85, 1.25)
    corners: dict[str, list[list[float]]] = {
        'straight': [[1, 0], [1, height]],
        'taper': [[foot, 0], [1, height]],
        'belly': [[foot, 0], [belly, 0.45 * height], [1, height]],
        'tulip': [[foot, 0], [belly, 0.3 * height], [0.8, 0.7 * height], [1, height]],
        'round': [[0.5, 0], [0.95, 0.15 * height], [1, height]]}
    kind = str(rng.choice([*corners]))
    outer = smooth_profile([[0.0, 0.0], *corners[kind]], 2 if kind != 'straight' else 1)
    profile = hollow(outer, wall)
    colors = np.tile(main, (len(profile) - 1, 1))
    colors[len(outer):] = second if chance(rng, 0.5) else main
    if chance(rng, 0.3):
        colors[len(outer) - 2:len(outer) + 1] = accent
    around = section(rng, 0.8)
    parts = [revolved(profile, colors, around)]
    handles = choose(rng, {0: 0.2, 1: 0.7, 2: 0.1})
    if handles:
        ear = _handle(rng, outer, wall, height, detail if chance(rng, 0.3) else main)
        parts += [moved(assemble([ear]), angle=math.pi * i) for i in range(handles)]
    if chance(rng, 0.15):  # a drink
        level = rng.uniform(0.6, 0.9) * height
        parts.append(revolved([[_radius(outer, level) - wall / 2, level - 0.02],
                               [_radius(outer, level) - wall / 2, level]], detail, around))
    if chance(rng, 0.12):
        parts.append(revolved(hollow([[0, -wall], [0.7, -wall], [rng.uniform(1.3, 2), 0.15]],
                                     wall), second))
    return assemble(parts)


def _radius(outer: Points, level: float) -> float:
    return float(np.interp(level, outer[1:, 1], outer[1:, 0]))


def _handle(rng: np.random.Generator, outer: Points, wall: float, height: float,
            color: Color) -> Mesh:
    """Return a handle at +x whose ends stand in the wall."""
    low, high = rng.uniform(0.12, 0.35) * height, rng.uniform(0.65, 0.9) * height
    out = rng.uniform(0.35, 0.9)
    a, b = _radius(outer, low) - 0.6 * wall, _radius(outer, high) - 0.6 * wall
    reach = max(a, b) + out
    kind = choose(rng, {'round': 0.5, 'square': 0.2, 'ear': 0.2, 'hook': 0.1})
    if kind in ('round', 'square'):
        corners = [[a, low], [reach, low], [reach, high], [b, high]]
    elif kind == 'ear':
        corners = [[a, low], [a + 0.5 * out, low], [reach + 0.2, high], [reach, high + 0.1],
                   [b, high]]
    else:
        corners = [[b, high], [reach, high], [reach, low], [a + 0.5 * out, low]]
    flat = smoothed(corners, 1 if kind == 'square' else 3)
    path = np.column_stack([flat[:, 0], np.zeros(len(flat)), flat[:, 1]])
    thick = rng.uniform(0.08, 0.17)
    profile = circle(12, thick) * [rng.uniform(0.8, 2), 1]
    if chance(rng, 0.3):
        profile = circle(4, 1.3 * thick) * [rng.uniform(0.8, 2), 0.8]
    return swept(path, profile, color, up=[0, 0, 1])


def jug(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return a jug, a teapot, a kettle or a watering can: a body, a spout, a handle, a lid."""
    main, second, accent, _ = draw_palette(rng)
    height = rng.uniform(0.9, 2.6)
    top = rng.uniform(0.35, 0.85)
    outer = smooth_profile([[0, 0], [rng.uniform(0.5, 0.95), 0], [1, 0.35 * height],
                            [0.95, 0.6 * height], [top, 0.9 * height], [top, height]], 2)
    wall = rng.uniform(0.07, 0.12)
    around = section(rng, 0.8)
    parts = [revolved(hollow(outer, wall), main, around)]
    start = rng.uniform(0.2, 0.6) * height
    out, rise = rng.uniform(0.5, 1.3), rng.uniform(0.2, 0.9) * height
    foot = _radius(outer, start) - 0.12
    flat = smoothed([[foot, start], [foot + 0.5 * out, start + 0.1 * rise],
                     [foot + 0.7 * out, start + 0.8 * rise], [foot + out, start + rise]], 2)
    spout = pipe(np.column_stack([flat[:, 0], np.zeros(len(flat)), flat[:, 1]]),
                 circle(14, rng.uniform(0.12, 0.24)), 0.35, second if chance(rng, 0.3) else main)
    parts.append(spout)
    if chance(rng, 0.7):
        color = main if chance(rng, 0.5) else second
        parts.append(moved(_handle(rng, outer, wall, height, color), angle=math.pi))
    else:  # a bail over the top
        bow = arc(0, math.pi, 1, 24) * [top - wall / 2, rng.uniform(0.6, 1.1)]
        parts.append(swept(np.column_stack([bow[:, 0], np.zeros(24), bow[:, 1] + height - 0.1]),
                           circle(10, 0.07), second))
    if chance(rng, 0.65):
        dome = rng.uniform(0.1, 0.5)
        parts += [revolved(smooth_profile([[top * 1.05, height], [0.8 * top, height + dome],
                                           [0.05, height + dome]], 2), accent, around),
                  moved(revolved(globe(0.16), second), [0, 0, height + dome + 0.1])]
    return assemble(parts)


def bucket(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return a bucket, a tub or a flower pot, open above, with a bail, ears or a thick rim."""
    main, second, accent, _ = draw_palette(rng)
    height, foot, wall = rng.uniform(0.9, 2.2), rng.uniform(0.5, 0.95), rng.uniform(0.05, 0.09)
    around = section(rng, 0.65)
    outer = smooth_profile([[0, 0], [foot, 0], [1, height]], 0)
    if chance(rng, 0.4):
        outer = np.vstack([outer[:-1], [[0.97, 0.85 * height], [1.12, 0.85 * height],
                                        [1.14, height]]])
    profile = hollow(outer, wall)
    colors = np.tile(main, (len(profile) - 1, 1))
    colors[len(outer):] = second
    parts = [revolved(profile, colors, around)]
    wide = float(np.abs(around[:, 1]).max()) * outer[-1, 0]
    if chance(rng, 0.6):  # a bail, standing or let down
        bow = arc(0, math.pi, wide - wall / 2, 24)
        bail = swept(np.column_stack([np.zeros(24), bow]), circle(8, rng.uniform(0.03, 0.07)),
                     accent, up=[1, 0, 0])
        parts.append(moved(bail, [0, 0, 0.93 * height], [0, 1, 0], rng.uniform(-0.9, 0.9)))
    if chance(rng, 0.3):
        level = rng.uniform(0.5, 1) * height
        parts.append(revolved([[_radius(outer, level) - wall / 2, level - 0.05],
                               [_radius(outer, level) - wall / 2, level]], accent, around))
    return assemble(parts)


def pan(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return a pan or a pot, a ladle or a big spoon: a wide vessel with a long handle or ears."""
    main, second, accent, _ = draw_palette(rng)
    height, wall = rng.choice([rng.uniform(0.2, 0.5), rng.uniform(0.6, 1.4)]), 0.08
    outer = smooth_profile([[0, 0], [rng.uniform(0.65, 1), 0], [1, height]],
                           int(rng.integers(0, 3)))
    parts = [revolved(hollow(outer, wall), main, section(rng, 0.85))]
    level, thick = 0.8 * height, rng.uniform(0.07, 0.13)
    at = _radius(outer, level) * 0.97 - wall / 2
    if chance(rng, 0.65):
        long, rise = rng.uniform(0.9, 2.6), rng.uniform(-0.1, 0.7)
        path = smoothed([[at, 0, level], [at + 0.4 * long, 0, level + rise],
                         [at + long, 0, level + rise]], 2)
        scales = np.linspace(rng.uniform(0.5, 1), 1, len(path))
        parts.append(swept(path, circle(10, thick) * [rng.uniform(1, 2), 1], second,
                           scales=scales))
    else:
        for side in (0, math.pi):
            path = smoothed([[at, -0.4, level], [at + 0.5, -0.4, level], [at + 0.5, 0.4, level],
                             [at, 0.4, level]], 2)
            path[[0, -1], 0] -= 0.15
            parts.append(moved(swept(path, circle(8, thick), second), angle=side))
    if chance(rng, 0.35):
        parts += [revolved([[1.03, height - 0.02], [0.9, height + 0.12], [0.1, height + 0.2]],
                           accent if chance(rng, 0.5) else main),
                  revolved([[0.1, height + 0.1], [0.1, height + 0.3], [0.2, height + 0.34],
                            [0.2, height + 0.42]], second)]
    return assemble(parts)
