"""Things of straight bars and wires: the edges of solids, racks, whisks."""

import math

from active_recon.shapes.common.parts import assemble, beam, ellipsoid, Mesh, rod
from active_recon.shapes.things.colors import draw_palette
from active_recon.shapes.things.drawing import arc, chance
from active_recon.shapes.things.solids import circle, moved, revolved, swept
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull
import trimesh

Points = NDArray[np.float64]


def _corners(rng: np.random.Generator) -> Points:
    """Return the corners of a solid: a prism, a pyramid, a block, or any points of a ball."""
    kind = rng.integers(4)
    if kind == 0:
        base = circle(int(rng.integers(3, 8)))
        top, rise = base * rng.uniform(0.3, 1.1), rng.uniform(0.6, 2.4)
        return np.vstack([np.insert(base, 2, 0, axis=1), np.insert(top, 2, rise, axis=1)])
    if kind == 1:
        base = np.insert(circle(int(rng.integers(3, 7))), 2, 0, axis=1)
        tips = [[0, 0, rng.uniform(0.8, 2)]]
        return np.vstack([base, tips, [[0, 0, -rng.uniform(0.5, 1.5)]] if chance(rng, 0.4)
                          else np.zeros((0, 3))])
    if kind == 2:
        grid = np.stack(np.meshgrid(*[[0, 1]] * 3, indexing='ij'), axis=-1).reshape(-1, 3)
        return grid * rng.uniform(0.6, 2, 3)
    points = rng.normal(size=(int(rng.integers(7, 13)), 3))
    return np.asarray(points / np.linalg.norm(points, axis=1, keepdims=True))


def _edges(corners: Points) -> list[tuple[int, int]]:
    """Return the edges of the convex hull, without those inside its flat faces."""
    hull = ConvexHull(corners)
    sides: dict[tuple[int, int], list[int]] = {}
    for face, simplex in enumerate(hull.simplices):
        for i in range(3):
            a, b = sorted((int(simplex[i]), int(simplex[i - 1])))
            sides.setdefault((a, b), []).append(face)
    normals = hull.equations[:, :3]
    return [edge for edge, (one, other) in sides.items()
            if normals[one] @ normals[other] < 0.999]


def frame(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return a frame: the edges of a solid as bars, with knots; or a rack of parallel wires."""
    main, second, accent, _ = draw_palette(rng)
    thick = rng.uniform(0.05, 0.13)
    if chance(rng, 0.3):
        return _rack(rng, main, second, thick)
    corners = _corners(rng)
    square = chance(rng, 0.4)
    parts: list[Mesh] = []
    for a, b in _edges(corners):
        start, end = corners[a], corners[b]
        parts.append(beam(start, end, 2 * thick, main) if square else
                     rod(start, end, thick, main, sections=10))
    swell = rng.choice([1.0, rng.uniform(1.5, 3)])
    parts += [ellipsoid(corner, (thick * swell * (1.3 if square else 1),) * 3,
                        second if swell > 1 else main, 1) for corner in corners]
    if chance(rng, 0.25):
        middle = corners.mean(axis=0)
        size = rng.uniform(0.2, 0.4)
        parts.append(ellipsoid(middle, (size,) * 3, accent))
        parts += [rod(middle, corner, 0.7 * thick, accent) for corner in corners]
    return assemble(parts)


def _rack(rng: np.random.Generator, main: Points, second: Points, thick: float) -> Mesh:
    """Return two rails with hoops or rungs across: a dish rack, a ladder, a toast rack."""
    long, wide, rise = rng.uniform(1.5, 3), rng.uniform(0.5, 1.5), rng.uniform(0, 1.2)
    parts = [beam([-0.1, y, 0], [long + 0.1, y, 0], 2 * thick, main)
             for y in (-wide / 2, wide / 2)]
    for x in np.linspace(0.05, long - 0.05, int(rng.integers(3, 10))):
        if rise < 0.3:
            parts.append(rod([x, -wide / 2, 0], [x, wide / 2, 0], 0.8 * thick, second))
            continue
        bow = arc(0, math.pi, 1, 16) * [wide / 2, rise]
        parts.append(swept(np.column_stack([np.full(16, x), bow]), circle(8, 0.8 * thick), second,
                           up=[1, 0, 0]))
    if chance(rng, 0.5):
        parts += [beam([x, -wide / 2, 0], [x, wide / 2, 0], 2 * thick, main) for x in (0, long)]
    mesh = assemble(parts)
    return mesh if chance(rng, 0.6) else moved(mesh, axis=[0, 1, 0], angle=-math.pi / 2)


def whisk(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return loops of wire from one handle: a whisk, a racket, a bubble wand, a magnifier."""
    main, second, accent, _ = draw_palette(rng)
    long, thick = rng.uniform(0.8, 2), rng.uniform(0.09, 0.2)
    parts = [revolved([[thick, -long], [thick * rng.uniform(0.7, 1.5), -0.5 * long],
                       [thick * 0.8, 0.02]], main)]
    wide, high = rng.uniform(0.35, 0.8), rng.uniform(0.5, 1)
    t = np.linspace(0, 2 * math.pi, 40, endpoint=False)
    loop = np.column_stack([wide * np.sin(t), np.zeros(40), high * (1 - np.cos(t))])
    wire = rng.uniform(0.035, 0.09)
    loops = int(rng.integers(2, 6)) if chance(rng, 0.5) else 1
    for angle in math.pi * np.arange(loops) / loops:
        parts.append(moved(swept(loop, circle(8, wire), second, closed=True), angle=float(angle)))
    if loops == 1:
        kind = rng.integers(3)
        if kind == 0:  # a pane
            disc = moved(revolved([[1, -0.4], [1, 0.4]], accent), axis=[1, 0, 0],
                         angle=math.pi / 2)
            disc.apply_transform(np.diag([wide, wire, high, 1.0]))
            parts.append(moved(disc, [0, 0, high]))
        elif kind == 1:  # strings
            for share in np.linspace(-0.7, 0.7, 6):
                half = math.sqrt(1 - share**2)
                parts += [rod([share * wide, 0, high * (1 - half)],
                              [share * wide, 0, high * (1 + half)], 0.03, accent, sections=6),
                          rod([-half * wide, 0, high * (1 + share)],
                              [half * wide, 0, high * (1 + share)], 0.03, accent, sections=6)]
    return assemble(parts)
