"""What lamps stand on, and how their parts are bent and aimed: feet, bodies, tripods, arms."""

import math

from active_recon.shapes.common.parts import (
    assemble,
    beam,
    box,
    Color,
    ellipsoid,
    lathe,
    loft,
    Mesh,
    rod,
    tube,
)
import numpy as np
from numpy.typing import ArrayLike, NDArray


def aim(mesh: Mesh, up: ArrayLike) -> None:
    """Turn a part in place, about the origin, so that its +z points along a direction, (3,)."""
    z = np.asarray(up, np.float64) / np.linalg.norm(up)
    y = np.cross(z, [0.0, 1, 0] if abs(z[0]) > 0.99 else [1.0, 0, 0])
    y /= np.linalg.norm(y)
    turn = np.eye(4)
    turn[:3, :3] = np.column_stack([np.cross(y, z), y, z])
    mesh.apply_transform(turn)


def bent(path: ArrayLike, radius: float, color: Color, sections: int = 8) -> Mesh:
    """Return a smoothly bent round bar along a path, (N, 3), that lies in one upright plane."""
    points = np.asarray(path, np.float64)
    x, y, _ = points[-1] - points[0]
    span = math.hypot(x, y)
    across = np.array([-y, x, 0]) / span if span > 0 else np.array([0.0, 1, 0])
    tangents = np.gradient(points, axis=0)
    above = np.cross(tangents, across)
    above /= np.linalg.norm(above, axis=1, keepdims=True)
    angles = np.arange(sections) * 2 * math.pi / sections
    return loft([p + radius * (np.outer(np.cos(angles), across) + np.outer(np.sin(angles), up))
                 for p, up in zip(points, above, strict=True)], color)


def foot(rng: np.random.Generator, radius: float, height: float, color: Color) -> Mesh:
    """Return a weight on the floor: a disc, a dome, a slab, a block or crossed feet."""
    kind = rng.choice(['disc', 'dome', 'cone', 'slab', 'steps', 'feet'])
    if kind == 'slab':
        x, y = radius * rng.uniform(0.6, 1, 2)
        return box([-x, -y, 0], [x, y, height], color)
    if kind == 'feet':
        count = int(rng.integers(3, 6))
        return assemble(beam([0, 0, height],
                             [radius * math.cos(a), radius * math.sin(a), height / 2],
                             height, color) for a in np.arange(count) * 2 * math.pi / count)
    profile = {'disc': [[1, 0], [1, 1]], 'dome': [[1, 0], [0.9, 0.5], [0.6, 0.9], [0.1, 1.3]],
               'cone': [[1, 0], [0.95, 0.3], [0.15, 2]],
               'steps': [[1, 0], [1, 0.6], [0.7, 0.6], [0.7, 1.2], [0.35, 1.2], [0.35, 1.8]]}[kind]
    return lathe(np.array(profile) * [radius, height], color,
                 sections=int(rng.choice([6, 8, 24, 24])))


def body(rng: np.random.Generator, radius: float, height: float, color: Color,
         accent: Color) -> Mesh:
    """Return a table lamp's body on the z axis: a vase, balls, a column, blocks or three legs."""
    kind = rng.choice(['vase', 'vase', 'balls', 'column', 'blocks', 'tripod', 'pole', 'frame'])
    if kind == 'vase':
        count = int(rng.integers(3, 7))
        levels = np.concatenate([[0], np.sort(rng.uniform(0.08, 0.92, count)), [1]])
        radii = np.concatenate([[rng.uniform(0.4, 0.9)], rng.uniform(0.25, 1, count), [0.2]])
        fine = np.linspace(0, 1, 16)
        smooth = np.interp(fine, levels, radii)
        smooth[1:-1] = (smooth[:-2] + 2 * smooth[1:-1] + smooth[2:]) / 4
        return lathe(np.column_stack([smooth * radius, fine * height]), color,
                     sections=int(rng.choice([4, 8, 20, 20])))
    if kind == 'balls':
        sizes = rng.uniform(0.45, 1, int(rng.integers(1, 5)))
        halves = sizes / sizes.sum() * height / 2
        centres = 2 * np.cumsum(halves) - halves
        balls = [ellipsoid([0, 0, z], [max(half, radius * size)] * 2 + [half * 1.05],
                           color if i % 2 == 0 else accent)
                 for i, (z, half, size) in enumerate(zip(centres, halves, sizes, strict=True))]
        return assemble([rod([0, 0, 0], [0, 0, height], radius * 0.15, accent), *balls])
    if kind == 'column':
        wide = radius * rng.uniform(0.3, 1)
        return assemble([rod([0, 0, 0], [0, 0, height], wide, color, wide * rng.uniform(0.4, 1.1),
                             int(rng.choice([4, 8, 20]))),
                         foot(rng, radius, height * 0.08, accent)])
    if kind == 'blocks':
        levels = np.linspace(0, height, int(rng.integers(2, 6)))
        return assemble(box([-w, -d, low], [w, d, high], color if i % 2 == 0 else accent)
                        for i, (low, high) in enumerate(zip(levels[:-1], levels[1:], strict=True))
                        for w, d in [radius * rng.uniform(0.35, 0.9, 2)])
    if kind == 'tripod':
        return tripod(rng, radius, height, height * rng.uniform(0.03, 0.06), color, accent)
    if kind == 'frame':
        thin, x = height * rng.uniform(0.04, 0.08), radius * rng.uniform(0.6, 1)
        hoop = [[-x, 0, thin], [x, 0, thin], [x, 0, height - thin], [-x, 0, height - thin],
                [-x, 0, thin]]
        return assemble([tube(hoop, thin, color, 6), foot(rng, radius, thin * 2, accent)])
    return assemble([rod([0, 0, 0], [0, 0, height], height * rng.uniform(0.03, 0.07), color),
                     foot(rng, radius, height * rng.uniform(0.05, 0.12), accent)])


def tripod(rng: np.random.Generator, radius: float, height: float, thick: float, color: Color,
           accent: Color) -> Mesh:
    """Return three or four straight legs that meet under the top."""
    count = int(rng.choice([3, 3, 4]))
    meet = height * rng.uniform(0.85, 1)
    angles = rng.uniform(0, 2 * math.pi) + np.arange(count) * 2 * math.pi / count
    feet = [np.array([radius * math.cos(a), radius * math.sin(a), 0]) for a in angles]
    hub = np.array([0, 0, meet])
    parts = [rod(hub - 0.02 * at, at, thick / 2, color, thick * rng.uniform(0.3, 0.5))
             for at in feet]
    parts.append(rod([0, 0, meet - thick * 1.5], [0, 0, height], thick * 0.8, accent))
    if rng.random() < 0.4:
        level = rng.uniform(0.3, 0.6)
        ties = [at + (hub - at) * level for at in feet]
        parts += [rod(ties[i - 1], ties[i], thick * 0.35, accent, sections=6)
                  for i in range(count)]
    return assemble(parts)


def arc(start: ArrayLike, end: ArrayLike, rise: float, points: int = 9) -> NDArray[np.float64]:
    """Return a path, (points, 3), bent upward from start to end by rise at its middle."""
    t = np.linspace(0, 1, points)[:, None]
    a, b = np.asarray(start, np.float64), np.asarray(end, np.float64)
    path: NDArray[np.float64] = a + (b - a) * t + 4 * t * (1 - t) * [0, 0, rise]
    return path
