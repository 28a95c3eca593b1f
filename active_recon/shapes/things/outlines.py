"""Flat outlines, (N, 2), about 0: gears, figures, profiles, bores and cut-outs."""

import math

from active_recon.shapes.common.drawing import choose
from active_recon.shapes.things.drawing import arc, chance
from active_recon.shapes.things.solids import circle
import numpy as np
from numpy.typing import ArrayLike, NDArray

Points = NDArray[np.float64]


def rounded(size: ArrayLike, radius: float, points: int = 5) -> Points:
    """Return a rectangle of some size, (2,), with its corners rounded off."""
    half = np.asarray(size, np.float64) / 2
    if radius <= 1e-6:
        return half * [[1, 1], [-1, 1], [-1, -1], [1, -1]]
    corners = [(sign_x, sign_y) for sign_x, sign_y in ((1, 1), (-1, 1), (-1, -1), (1, -1))]
    return np.vstack([arc(i * math.pi / 2, (i + 1) * math.pi / 2, radius, points)
                      + (half - radius) * corner for i, corner in enumerate(corners)])


def gear(rng: np.random.Generator, teeth: int, root: float) -> Points:
    """Return a gear's outline of radius 1: trapezoid, round, pointed or slanting teeth."""
    tops = {'trapezoid': [(0.0, root), (0.3, root), (0.42, 1), (0.68, 1), (0.8, root)],
            'square': [(0.0, root), (0.48, root), (0.5, 1), (0.98, 1)],
            'pointed': [(0.0, root), (0.5, 1)],
            'slanting': [(0.0, root), (0.85, 1), (0.9, 1)],
            'round': [(s, root + (1 - root) * abs(math.sin(math.pi * s)))
                      for s in np.linspace(0, 0.83, 6)]}
    kind = choose(rng, {'trapezoid': 0.45, 'square': 0.12, 'pointed': 0.12, 'slanting': 0.11,
                        'round': 0.2})
    share, radius = np.array(tops[kind]).T
    angles = (np.arange(teeth)[:, None] + share) * 2 * math.pi / teeth
    radii = np.broadcast_to(radius, angles.shape)
    return np.stack([radii * np.cos(angles), radii * np.sin(angles)], axis=-1).reshape(-1, 2)


def bore(rng: np.random.Generator, radius: float) -> Points:
    """Return a shaft's hole: round, flattened, keyed, square or six-sided."""
    kind = rng.integers(4)
    if kind == 0:
        return circle(int(rng.choice([4, 6])), radius)
    hole = circle(24, radius)
    if kind == 1:
        hole[:, 0] = np.minimum(hole[:, 0], 0.6 * radius)
    if kind == 2:
        hole[np.abs(hole[:, 1]) < 0.3 * radius, 0] *= 1.25
    return hole


def cutout(rng: np.random.Generator, size: ArrayLike) -> Points:
    """Return a hole that fits into a size, (2,)."""
    half = np.asarray(size, np.float64) / 2
    kind = rng.integers(4)
    if kind == 0:
        return circle(20, float(half.min()))
    if kind == 1:
        return rounded(2 * half, 0)
    if kind == 2:
        return rounded(2 * half, 0.95 * float(half.min()))
    return circle(int(rng.choice([3, 5, 6])), float(half.min()))


def figure(rng: np.random.Generator) -> Points:
    """Return a simple figure of radius 1 or so."""
    kinds = {_star: 0.25, _flower: 0.17, _heart: 0.1, _moon: 0.1, _arrow: 0.1, _cross: 0.1,
             _blot: 0.12, _polygon: 0.06}
    return choose(rng, kinds)(rng)


def _star(rng: np.random.Generator) -> Points:
    points = int(rng.integers(3, 13))
    outline = circle(2 * points)
    outline[::2] *= rng.uniform(0.3, 0.8)
    return outline


def _flower(rng: np.random.Generator) -> Points:
    angles = np.arange(90) * 2 * math.pi / 90
    lobes, depth = rng.integers(3, 10), rng.uniform(0.1, 0.4)
    wave = np.cos(lobes * angles)
    radius = 1 - depth + depth * (np.abs(wave) * 2 - 1 if chance(rng, 0.4) else wave)
    return np.asarray(radius[:, None] * np.column_stack([np.cos(angles), np.sin(angles)]))


def _heart(rng: np.random.Generator) -> Points:
    t = np.arange(48) * 2 * math.pi / 48
    return np.column_stack([np.sin(t) ** 3 * rng.uniform(0.8, 1.1),
                            (13 * np.cos(t) - 5 * np.cos(2 * t) - 2 * np.cos(3 * t)
                             - np.cos(4 * t)) / 16])


def _moon(rng: np.random.Generator) -> Points:
    wide = rng.uniform(0.25, 0.75)
    outer = arc(0.35, 2 * math.pi - 0.35, 1, 36)
    inner = np.column_stack([outer[::-1, 0] * (1 - wide) + wide * outer[0, 0],
                             outer[::-1, 1] * (1 - wide * 0.6)])
    return np.vstack([outer, inner[1:-1]])


def _arrow(rng: np.random.Generator) -> Points:
    shaft, neck = rng.uniform(0.12, 0.35), rng.uniform(-0.3, 0.5)
    upper = [[-1, shaft], [neck, shaft], [neck - rng.uniform(0, 0.2), rng.uniform(0.5, 0.9)],
             [1, 0]]
    if chance(rng, 0.3):  # two heads
        upper = [[-1, 0], [-neck - 0.3, 0.7], [-neck - 0.3, shaft], [neck + 0.3, shaft],
                 [neck + 0.3, 0.7], [1, 0]] if neck > 0 else upper
    points = np.array(upper)
    lower = points[::-1] * [1, -1]
    keep = lower[:, 1] != 0
    return np.vstack([points, lower[keep]])


def _cross(rng: np.random.Generator) -> Points:
    a, b, c = rng.uniform(0.15, 0.45), rng.uniform(0.15, 0.45), rng.uniform(0.6, 1.2)
    return np.array([[1, a], [b, a], [b, c], [-b, c], [-b, a], [-1, a], [-1, -a], [-b, -a],
                     [-b, -1], [b, -1], [b, -a], [1, -a]], np.float64)


def _blot(rng: np.random.Generator) -> Points:
    angles = np.arange(72) * 2 * math.pi / 72
    radius = 0.7 + sum(rng.uniform(-0.18, 0.18) * np.cos(k * angles + rng.uniform(0, 6.3))
                       for k in range(1, 6))
    return np.asarray(np.maximum(radius, 0.2)[:, None]
                      * np.column_stack([np.cos(angles), np.sin(angles)]))


def _polygon(rng: np.random.Generator) -> Points:
    return circle(int(rng.integers(3, 9))) * [1, rng.uniform(0.4, 1)]


def profile(rng: np.random.Generator) -> tuple[Points, list[Points]]:
    """Return the section of a bar and its holes."""
    w, h, t = rng.uniform(0.4, 1.2), rng.uniform(0.5, 1.2), rng.uniform(0.08, 0.25)
    k = rng.uniform(0.4, 1) * w
    shapes: dict[str, list[list[float]]] = {
        'L': [[0, 0], [w, 0], [w, t], [t, t], [t, h], [0, h]],
        'U': [[0, 0], [w, 0], [w, h], [w - t, h], [w - t, t], [t, t], [t, h], [0, h]],
        'T': [[-w / 2, h], [-w / 2, h - t], [-t / 2, h - t], [-t / 2, 0], [t / 2, 0],
              [t / 2, h - t], [w / 2, h - t], [w / 2, h]],
        'I': [[-w / 2, 0], [w / 2, 0], [w / 2, t], [t / 2, t], [t / 2, h - t], [k / 2, h - t],
              [k / 2, h], [-k / 2, h], [-k / 2, h - t], [-t / 2, h - t], [-t / 2, t],
              [-w / 2, t]],
        'Z': [[0, 0], [w, 0], [w, t], [t, t], [t, h], [-w + t, h], [-w + t, h - t], [0, h - t]]}
    kind = str(rng.choice([*shapes, 'tube', 'box', 'steps', 'wedge']))
    if kind in shapes:
        return np.array(shapes[kind]), []
    if kind == 'tube':
        size = circle(36) * [w, h] if chance(rng, 0.5) else circle(int(rng.integers(3, 9)), w)
        return size, [size * rng.uniform(0.5, 0.88)]
    if kind == 'box':
        outer = rounded([w, h], 0.1 * w)
        t = min(t, 0.2 * w)
        if chance(rng, 0.4):
            half = np.array([(w - 3 * t) / 2, h - 2 * t])
            return outer, [rounded(half, 0) + [s * (half[0] + t) / 2, 0] for s in (-1, 1)]
        return outer, [rounded([w - 2 * t, h - 2 * t], 0)]
    if kind == 'wedge':
        return np.array([[0, 0], [w, 0], [w, t], [k, t + rng.uniform(0, 0.4)], [0, h]]), []
    widths = np.cumsum(rng.uniform(0.15, 0.5, rng.integers(2, 6)))
    tops = rng.uniform(0.2, 1.2, len(widths))
    if chance(rng, 0.5):
        tops = np.sort(tops)
    line = [[0.0, 0.0], [float(widths[-1]), 0.0]]
    for left, right, top in zip([*widths[:-1][::-1], 0.0], widths[::-1], tops, strict=True):
        line += [[float(right), float(top)], [float(left), float(top)]]
    return np.array(line), []


def holds(outline: Points, hole: Points) -> bool:
    """Tell whether a hole lies inside an outline and keeps clear of it."""
    start, end = outline, np.roll(outline, -1, axis=0)
    for x, y in hole:
        crosses = (start[:, 1] > y) != (end[:, 1] > y)
        run = np.where(end[:, 1] == start[:, 1], 1, end[:, 1] - start[:, 1])
        at = start[:, 0] + (y - start[:, 1]) / run * (end[:, 0] - start[:, 0])
        if (crosses & (at > x)).sum() % 2 == 0:
            return False
    step = end - start
    share = (((hole[:, None] - start) * step).sum(-1) / np.maximum((step**2).sum(-1), 1e-12))
    nearest = start + np.clip(share, 0, 1)[..., None] * step
    return bool(np.linalg.norm(hole[:, None] - nearest, axis=-1).min() > 0.04)
