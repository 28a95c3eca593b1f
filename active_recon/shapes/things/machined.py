"""Machine parts: flanges, bolts and nuts, levers, finned and studded blocks."""

import math

from active_recon.shapes.common.drawing import choose
from active_recon.shapes.common.parts import assemble, beam, box, Mesh
from active_recon.shapes.things import outlines
from active_recon.shapes.things.colors import draw_palette
from active_recon.shapes.things.drawing import chance, Generator, helix, smooth_profile
from active_recon.shapes.things.milled import housing, milled
from active_recon.shapes.things.solids import circle, extruded, moved, revolved, swept
import numpy as np
from numpy.typing import NDArray
import trimesh

Points = NDArray[np.float64]


def flange(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return a flanged hub, a bushing, a pulley or a knob: coaxial discs bored through."""
    palette = draw_palette(rng)
    bore = rng.uniform(0.12, 0.4)
    hole = outlines.bore(rng, bore) if chance(rng, 0.5) else circle(28, bore)
    parts: list[Mesh] = []
    level = 0.0
    reach = float(np.linalg.norm(hole, axis=1).max())
    for i in range(int(rng.integers(2, 5))):
        wide = rng.choice([rng.uniform(reach + 0.1, 0.7), rng.uniform(0.8, 1.2)])
        thick = rng.uniform(0.1, 0.35) if wide > 0.7 else rng.uniform(0.15, 1)
        outline = circle(40, wide)
        kind = choose(rng, {'round': 0.6, 'hex': 0.15, 'square': 0.15, 'ears': 0.1})
        if kind == 'hex':
            outline = circle(6, max(wide, 1.3 * reach + 0.1))
        elif kind == 'square':
            outline = outlines.rounded([2 * wide, 2 * wide], 0.3 * wide)
        elif kind == 'ears':
            outline = circle(60, wide)
            outline[:, 0] *= 1.45
            outline[:, 1] *= 0.85
        holes = [hole]
        room = wide - reach
        if room > 0.3 and kind != 'hex':
            count = int(rng.integers(2, 9))
            if kind == 'ears':
                count, ring = 2, 1.05 * wide
            else:
                ring = reach + 0.55 * room
            size = min(rng.uniform(0.06, 0.14), 0.25 * room)
            if wide * 0.85 > reach + 0.1 or kind != 'ears':
                holes += [circle(14, size) + ring * np.array([math.cos(a), math.sin(a)])
                          for a in 2 * math.pi * np.arange(count) / count]
        parts.append(extruded(outline, level - 0.01, level + thick, palette[i % 4], holes,
                              palette[0]))
        level += thick
    mesh = assemble(parts)
    return mesh if chance(rng, 0.5) else moved(mesh, axis=[1, 0, 0], angle=math.pi / 2)


def bolt(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return a bolt or a screw with its head and thread, with a nut or washers, or a nut alone."""
    main, second, accent, _ = draw_palette(rng)
    radius, long = rng.uniform(0.25, 0.5), rng.uniform(0.6, 3.5)
    high = rng.uniform(0.25, 0.7)
    heads = {'hex': circle(6, 0.9), 'square': circle(4, 1), 'round': circle(32, 0.8),
             'wing': outlines.rounded([2.6, 0.35], 0.17), 'star': outlines.gear(rng, 12, 0.85),
             'pan': circle(32, 0.9)}
    kind = str(rng.choice([*heads]))
    parts: list[Mesh] = []
    if chance(rng, 0.2):
        hole = circle(28, radius)
        nut = extruded(heads['hex'], 0, high * 1.5, main, [hole], second)
        if chance(rng, 0.5):
            nut = assemble([nut, extruded(circle(40, 1.2), -0.12, 0.01, accent, [hole])])
        return nut
    if kind == 'pan':
        parts.append(revolved(smooth_profile([[0.9, 0], [0.9, 0.3 * high], [0.5, high],
                                              [0.01, high]], 2), second))
    else:
        holes = [circle(6, 0.35)] if kind == 'round' else []
        parts.append(extruded(heads[kind], 0, high, second, holes))
        if holes:
            parts.append(revolved([[0.4, 0], [0.4, 0.3 * high]], second))
    tip = radius * rng.choice([1, 0.05])
    parts.append(revolved([[radius, 0.05], [radius, -0.8 * long], [tip, -long]], main))
    if chance(rng, 0.6):
        turns = rng.uniform(3, 9)
        thread = helix(radius, turns, 0.75 * long, 16) - [0, 0, 0.85 * long]
        parts.append(swept(thread, circle(4, 0.3 * 0.75 * long / turns + 0.02), main))
    if chance(rng, 0.4):
        at = rng.uniform(0.2, 0.7) * long
        parts.append(extruded(circle(6, 0.85), -at - 0.3, -at, accent))
    if chance(rng, 0.3):
        parts.append(extruded(circle(36, 1.15), -0.1, 0.02, accent))
    return assemble(parts)


def clevis(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return a lever: eyes at the ends of arms, a crank, a connecting rod, a rocker, a fork."""
    main, second, accent, _ = draw_palette(rng)
    thick = rng.uniform(0.15, 0.5)
    count = int(rng.integers(2, 5))
    ends = np.cumsum(np.vstack([[0, 0], rng.uniform(0.9, 1.8, (count - 1, 1))
                                * circle(40)[rng.choice(40, count - 1)]]), axis=0)
    if chance(rng, 0.3):  # a spider: all arms from the first eye
        ends = np.vstack([[[0, 0]], circle(count + 1) * rng.uniform(1, 1.6)])
    parts: list[Mesh] = []
    for i, (x, y) in enumerate(ends):
        radius = rng.uniform(0.3, 0.55)
        tall = thick * rng.choice([1, rng.uniform(1.2, 2.5)])
        hole = outlines.bore(rng, rng.uniform(0.35, 0.65) * radius)
        outline = circle(32 if chance(rng, 0.8) else 6, radius)
        eye = extruded(outline, -tall / 2, tall / 2, main if i else second, [hole], accent)
        parts.append(moved(eye, [x, y, 0]))
        if i:
            before = ends[i - 1] if len(ends) == count else ends[0]
            gap = ends[i] - before
            along = gap / np.linalg.norm(gap)
            start, end = before + 0.28 * along, ends[i] - 0.8 * radius * along
            parts.append(beam([*start, 0], [*end, 0], rng.uniform(0.25, 0.42), main,
                              height=0.8 * thick))
    mesh = assemble(parts)
    return mesh if chance(rng, 0.5) else moved(mesh, axis=[1, 0, 0], angle=math.pi / 2)


def finned(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return a heat sink, a comb, a brick with studs, a rack or a connector with pins."""
    main, second, accent, _ = draw_palette(rng)
    half = np.array([1, rng.uniform(0.3, 1), rng.uniform(0.06, 0.3)])
    parts = [box(-half, half, main)]
    kind = choose(rng, {'fins': 0.4, 'studs': 0.4, 'pins': 0.2})
    rise = half[2] + rng.uniform(0.15, 1.0)
    if kind == 'fins':
        count = int(rng.integers(3, 11))
        thin = rng.uniform(0.25, 0.6) / count
        tops = rise + rng.choice([0, 0.3]) * np.abs(np.linspace(-1, 1, count))
        for x, top in zip(np.linspace(-1 + thin, 1 - thin, count), tops, strict=True):
            parts.append(box([x - thin, -half[1], 0.97 * half[2]], [x + thin, half[1], top],
                             second))
    else:
        columns, rows = int(rng.integers(2, 7)), int(rng.integers(1, 5))
        pitch = 2 * half[:2] / [columns, rows]
        radius = rng.uniform(0.25, 0.38) * pitch.min()
        top = half[2] + 0.5 * radius if kind == 'studs' else rise
        if kind == 'studs':  # a taller body, hollow below at times
            deep = half[2] * rng.uniform(0.5, 3)
            parts = [box([-1, -half[1], -deep], [1, half[1], half[2]], main)]
            if chance(rng, 0.5):
                parts = _hollow_box(half[:2], deep, half[2], main)
        outline = circle(int(rng.choice([4, 18])), radius)
        for i in range(columns):
            for j in range(rows):
                x, y = (np.array([i, j]) + 0.5) * pitch - half[:2]
                stud = extruded(outline, 0, top, second if kind == 'pins' else main)
                parts.append(moved(stud, [x, y, 0]))
    if chance(rng, 0.3):
        parts.append(box([-1.2, -0.4 * half[1], -0.9 * half[2]],
                         [1.2, 0.4 * half[1], 0.8 * half[2]], accent))
    return assemble(parts)


def _hollow_box(half: Points, deep: float, top: float, color: Points) -> list[Mesh]:
    """Return a box open below, from z = -deep up to top."""
    wall = 0.09
    parts = [box([-half[0], -half[1], 0], [half[0], half[1], top], color)]
    for sign in (-1, 1):
        parts += [box([sign * half[0], -half[1], -deep],
                      [sign * (half[0] - wall), half[1], 0.02], color),
                  box([-half[0], sign * half[1], -deep],
                      [half[0], sign * (half[1] - wall), 0.02], color)]
    return parts


MACHINED: dict[Generator, float] = {
    milled: 0.3, flange: 0.18, bolt: 0.14, housing: 0.17, clevis: 0.11, finned: 0.1}
