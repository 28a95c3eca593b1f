"""Things bent from a bar or a wire: pipes, hooks, handles, rings, springs, frames, knots."""

import math

from active_recon.shapes.common.drawing import choose
from active_recon.shapes.common.parts import assemble, beam, box, ellipsoid, Mesh, rod
from active_recon.shapes.common.soft_parts import filleted, smoothed
from active_recon.shapes.things.colors import draw_palette
from active_recon.shapes.things.drawing import arc, chance, Generator, helix, section
from active_recon.shapes.things.frames import frame, whisk
from active_recon.shapes.things.solids import circle, moved, pipe, revolved, swept, torus
import numpy as np
from numpy.typing import NDArray
import trimesh

Points = NDArray[np.float64]


def _bent(path: Points, radius: float) -> Points:
    """Return a path of corners with each of them bent round in several steps."""
    return smoothed(filleted(path, radius), 1)


def pipes(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return a tube with bends, its ends open, with flanges, collars or a branch."""
    main, second, accent, _ = draw_palette(rng)
    radius = rng.uniform(0.12, 0.4)
    steps = np.vstack([np.eye(3), -np.eye(3)])
    path = [np.zeros(3)]
    before = np.zeros(3)
    for _ in range(int(rng.integers(1, 5))):
        turns = [step for step in steps if abs(step @ before) < 0.5] if before.any() else steps
        step = turns[rng.choice(len(turns))]
        if chance(rng, 0.3) and before.any():  # a half bend
            step = (step + before) / math.sqrt(2)
        path.append(path[-1] + step * rng.uniform(0.9, 2))
        before = np.eye(3)[np.abs(step).argmax()] * np.sign(step[np.abs(step).argmax()])
    line = np.array(path)
    smooth = _bent(line, rng.uniform(0.15, 0.5)) if len(line) > 2 and chance(rng, 0.8) else line
    flat = circle(20, radius) if chance(rng, 0.75) else section(rng, 0, 20) * radius
    parts = [pipe(smooth, flat, rng.uniform(0.12, 0.4), main)]
    for end, inward in ((line[0], line[1]), (line[-1], line[-2])):
        along = (inward - end) / np.linalg.norm(inward - end)
        kind = choose(rng, {'bare': 0.4, 'flange': 0.4, 'collar': 0.2})
        if kind != 'bare':
            wide = radius * (rng.uniform(1.5, 2) if kind == 'flange' else 1.25)
            deep = rng.uniform(0.08, 0.15) if kind == 'flange' else rng.uniform(0.2, 0.4)
            parts.append(pipe([end, end + along * deep], circle(int(rng.choice([6, 8, 28])), wide),
                              1 - 0.8 * radius / wide, second))
    if chance(rng, 0.3):
        middle = (line[0] + line[1]) / 2
        side = np.cross(line[1] - line[0], rng.normal(size=3))
        side /= np.linalg.norm(side)
        parts.append(pipe([middle + side * 0.5 * radius, middle + side * rng.uniform(0.6, 1.2)],
                          circle(20, radius * rng.uniform(0.6, 0.95)), 0.25, accent))
    return assemble(parts)


def hook(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return a hook: J, S or question mark, with an eye, a plate, a screw or a cross bar."""
    main, second, accent, _ = draw_palette(rng)
    bow, shank, thick = rng.uniform(0.4, 0.9), rng.uniform(0.3, 2.2), rng.uniform(0.08, 0.24)
    sweep = rng.uniform(0.8, 1.45) * math.pi
    # The bow about (0, 0) from the shank at its right, then the shank upwards
    low = arc(0, -sweep, bow, 20)[::-1]
    flat = np.vstack([low, [[bow, 0.5 * shank], [bow, shank]]])
    if chance(rng, 0.3):  # S
        other = arc(math.pi, math.pi - sweep, rng.uniform(0.3, 0.8), 20)
        flat = np.vstack([flat[:-1], other - other[0] + flat[-1]])
    else:
        flat = np.vstack([flat[:-1], smoothed([flat[-2], [bow, shank], [0.3 * bow, shank + 0.6],
                                               [0.3 * bow, shank + 1]], 2)[1:]])
    path = np.column_stack([flat[:, 0], np.zeros(len(flat)), flat[:, 1]])
    scales = np.interp(np.linspace(0, 1, len(path)), [0, 0.3, 1], [rng.uniform(0.3, 1), 1, 1])
    profile = circle(12, thick) * [rng.uniform(0.6, 1.3), 1]
    parts = [swept(path, profile, main, scales=scales, up=[0, 1, 0])]
    top = path[-1]
    kind = choose(rng, {'eye': 0.3, 'plate': 0.3, 'ball': 0.2, 'bare': 0.2})
    if kind == 'eye':
        ring = moved(torus(2.4 * thick, thick, second), axis=[1, 0, 0], angle=math.pi / 2)
        parts.append(moved(ring, top + [0, 0, 2 * thick]))
    elif kind == 'plate':
        wide = rng.uniform(0.3, 0.7)
        parts.append(box(top - [wide, wide, 0.05], top + [wide, wide, 0.12], second))
    elif kind == 'ball':
        parts += [ellipsoid(top, (2 * thick,) * 3, accent),
                  ellipsoid(path[0], (1.6 * thick,) * 3, accent)]
    return assemble(parts)


def grip(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return a handle as on a door or a case: a bowed bar between two feet or on a plate."""
    main, second, accent, _ = draw_palette(rng)
    half, rise = rng.uniform(0.6, 1.5), rng.uniform(0.3, 1)
    kind = rng.integers(3)
    corners = [[-half, 0], [-half, rise], [half, rise], [half, 0]]
    if kind == 0:
        flat = filleted(corners, rng.uniform(0.1, 0.4))
    elif kind == 1:
        flat = arc(math.pi, 0, 1, 24) * [half, rise]
    else:
        flat = smoothed([[-half, 0], [-0.7 * half, 0.1], [-0.5 * half, rise], [0.5 * half, rise],
                         [0.7 * half, 0.1], [half, 0]], 2)
    path = np.column_stack([flat[:, 0], np.zeros(len(flat)), flat[:, 1]])
    thick = rng.uniform(0.07, 0.2)
    swell = 1 + rng.uniform(0, 0.9) * np.sin(np.linspace(0, math.pi, len(path)))
    parts = [swept(path, section(rng, 0.5, 16) * [rng.uniform(1, 2.5) * thick, thick], main,
                   scales=swell, up=[0, 1, 0])]
    if chance(rng, 0.6):
        for x in (-half, half):
            size = thick * rng.uniform(1.5, 2.5)
            parts.append(moved(revolved([[size, -0.04], [size, 0.08]], second), [x, 0, 0]))
    if chance(rng, 0.35):
        parts.append(box([-1.25 * half, -0.3 * half, -0.15], [1.25 * half, 0.3 * half, 0.0],
                         accent))
    return assemble(parts)


def rings(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return a ring or a bangle, round or faceted, twisted, with a stone; or links of a chain."""
    main, second, accent, _ = draw_palette(rng)
    if chance(rng, 0.4):
        return _chain(rng, main, second)
    tube = rng.uniform(0.08, 0.45)
    flat = section(rng, 0.4, 16) * tube * [rng.uniform(0.3, 1), 1]
    angles = 2 * math.pi * np.arange(60) / 60
    lobes = int(rng.choice([0, 0, 2, 3, 5, 8]))
    radius = 1 + rng.uniform(0.05, 0.2) * np.cos(lobes * angles) if lobes else np.ones(60)
    path = np.column_stack([radius * np.cos(angles), radius * np.sin(angles),
                            rng.uniform(0, 0.3) * np.sin(lobes * angles)])
    colors = np.where((np.arange(60) // rng.integers(3, 16) % 2 == 0)[:, None], main,
                      main if chance(rng, 0.5) else second)
    ring = swept(path, flat, colors, closed=True)
    parts = [ring]
    if chance(rng, 0.3):
        size = rng.uniform(0.25, 0.5)
        parts.append(ellipsoid([1 + tube * 0.3, 0, 0], [size, size, size], accent,
                               int(rng.integers(0, 3))))
    mesh = assemble(parts)
    return mesh if chance(rng, 0.4) else moved(mesh, axis=[0, 1, 0], angle=math.pi / 2)


def _chain(rng: np.random.Generator, main: Points, second: Points) -> Mesh:
    thick, long = rng.uniform(0.14, 0.24), rng.uniform(1, 1.8)
    links = []
    outline = np.vstack([arc(-math.pi / 2, math.pi / 2, 0.5, 12) + [long / 2, 0],
                         arc(math.pi / 2, 1.5 * math.pi, 0.5, 12) - [long / 2, 0]])
    path = np.column_stack([outline, np.zeros(len(outline))])
    pitch = long + 1 - 2 * thick * 0.97
    for i in range(int(rng.integers(2, 6))):
        link = swept(path, circle(12, thick), main if i % 2 else second, closed=True)
        links.append(moved(link, [i * pitch, 0, 0], [1, 0, 0], math.pi / 2 * (i % 2)))
    return assemble(links)


def spring(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return a spring or a coil: straight, conical, waisted or flat, with ends or on a core."""
    main, second, _, _ = draw_palette(rng)
    turns, thick = rng.uniform(1.5, 7), rng.uniform(0.06, 0.17)
    radii = np.array([1, rng.uniform(0.3, 1.2), rng.uniform(0.2, 1.2)])
    radii = radii if chance(rng, 0.5) else np.ones(3)
    flat_spiral = chance(rng, 0.15)
    rise = turns * rng.uniform(2.4, 5) * thick
    path = helix(np.array([1, 0.15]) if flat_spiral else radii, turns,
                 rng.uniform(0, 0.4) if flat_spiral else rise)
    shape = section(rng, 0.7, 12) * thick * ([1, rng.uniform(1, 2.5)] if flat_spiral else [1, 1])
    parts = [swept(path, shape, main)]
    if not flat_spiral and chance(rng, 0.4):
        for at, size in ((path[0], radii[0]), (path[-1], radii[-1])):
            size = size + thick * rng.uniform(0.5, 2)
            parts.append(moved(revolved([[size, -thick], [size, thick]], second),
                               [0, 0, at[2]]))
    elif not flat_spiral and chance(rng, 0.4):
        end = path[-1] * [0, 0, 1]
        parts += [rod([0, 0, -0.5], end + [0, 0, 0.5], float(radii.min()) * 0.5, second),
                  beam(path[0], path[0] * [0, 0, 1], thick, second),
                  beam(path[-1], end, thick, second)]
    return assemble(parts)


def knot(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return a closed rope: a torus knot, or a loop of any shape."""
    main, second, _, _ = draw_palette(rng)
    t = 2 * math.pi * np.arange(160) / 160
    if chance(rng, 0.5):
        p, q = [(2, 3), (3, 2), (1, 3), (1, 5), (2, 5), (3, 4)][rng.integers(6)]
        inner = rng.uniform(0.3, 0.55)
        path = np.column_stack([(1 + inner * np.cos(q * t)) * np.cos(p * t),
                                (1 + inner * np.cos(q * t)) * np.sin(p * t),
                                inner * rng.uniform(0.8, 1.5) * np.sin(q * t)])
    else:
        path = sum((rng.normal(size=(1, 3)) * np.cos(k * t)[:, None]
                    + rng.normal(size=(1, 3)) * np.sin(k * t)[:, None]) / k**1.3
                   for k in range(1, 4))
        path = path / np.abs(path).max()
    colors = np.where((np.arange(160) // 8 % 2 == 0)[:, None], main,
                      second if chance(rng, 0.4) else main)
    return swept(path, section(rng, 0.7, 14) * rng.uniform(0.07, 0.22), colors, closed=True)


SWEPT: dict[Generator, float] = {
    pipes: 0.24, hook: 0.15, grip: 0.12, rings: 0.15, spring: 0.11, knot: 0.08, frame: 0.1,
    whisk: 0.05}
