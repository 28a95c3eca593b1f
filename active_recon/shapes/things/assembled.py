"""Simple solids put together: clusters of any primitives, towers, twins about a plane."""

import math

from active_recon.shapes.common.drawing import choose
from active_recon.shapes.common.parts import assemble, box, Color, ellipsoid, Mesh, mirrored, rod
from active_recon.shapes.common.soft_parts import cushion
from active_recon.shapes.things.colors import draw_palette
from active_recon.shapes.things.devices import device, plant
from active_recon.shapes.things.drawing import chance, Generator
from active_recon.shapes.things.solids import moved, painted, superquadric, torus
from active_recon.shapes.things.tools import hammer, handled, pincers, spanner
from active_recon.shapes.things.toys import figure, peg_toy, vehicle
import numpy as np
from numpy.typing import NDArray
import trimesh


def _primitive(rng: np.random.Generator, color: Color, rings: float = 0.08) -> Mesh:
    """Return a simple solid about 0, of a half size from 0.2 to 0.8; rings is a ring's share."""
    size = rng.uniform(0.2, 0.8, 3)
    kind = choose(rng, {'box': 0.2, 'soft box': 0.08, 'cylinder': 0.18, 'cone': 0.12, 'ball': 0.14,
                        'superquadric': 0.14, 'torus': rings, 'wedge': 0.06})
    if kind == 'box':
        return box(-size, size, color)
    if kind == 'soft box':
        return cushion(-size, size, color, rng.uniform(0.05, 0.2))
    if kind == 'cylinder':
        return rod([0, 0, -size[2]], [0, 0, size[2]], size[0], color,
                   sections=int(rng.choice([5, 6, 8, 32])))
    if kind == 'cone':
        return rod([0, 0, -size[2]], [0, 0, size[2]], size[0], color,
                   float(rng.choice([0, 0.5]) * size[0]), sections=int(rng.choice([4, 6, 32])))
    if kind == 'ball':
        return ellipsoid([0, 0, 0], size if chance(rng, 0.5) else [size[0]] * 3, color, 3)
    if kind == 'superquadric':
        powers = float(rng.choice([0.2, 0.5, 1, 1.8])), float(rng.choice([0.2, 0.5, 1, 2]))
        return superquadric(size, powers, color)
    if kind == 'torus':
        return torus(float(size[0]), float(size[0] * rng.uniform(0.2, 0.5)), color)
    flat = np.array([[-size[0], -size[2]], [size[0], -size[2]],
                     [rng.uniform(-size[0], size[0]), size[2]]])
    corners = np.vstack([np.insert(flat, 1, y, axis=1) for y in (-size[1], size[1])])
    return painted(trimesh.convex.convex_hull(corners), color)


def _spot(rng: np.random.Generator, mesh: Mesh) -> NDArray[np.float64]:
    """Return a point of the surface, (3,), anywhere on it alike."""
    face = rng.choice(len(mesh.faces), p=mesh.area_faces / mesh.area)
    a, b = np.sort(rng.random(2))
    return np.asarray(np.array([a, b - a, 1 - b]) @ mesh.triangles[face])


def cluster(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return two to seven simple solids, each pushed into the surface of an earlier one."""
    palette = draw_palette(rng)
    askew = chance(rng, 0.6)
    parts: list[Mesh] = []
    for i in range(int(rng.integers(2, 8))):
        part = _primitive(rng, palette[rng.integers(4)])
        part.apply_transform(np.diag([*[rng.uniform(0.6, 1.4)] * 3, 1.0]))
        if askew and chance(rng, 0.7):
            moved(part, axis=rng.normal(size=3), angle=rng.uniform(0, math.pi))
        elif chance(rng, 0.5):
            moved(part, axis=np.eye(3)[rng.integers(2)], angle=math.pi / 2)
        if i:
            other = parts[rng.integers(len(parts))]
            # A point of its surface, a little inside, comes to lie on the other's
            part.apply_translation(_spot(rng, other) - 0.94 * _spot(rng, part))
        parts.append(part)
    mesh = assemble(parts)
    if chance(rng, 0.25):  # twins about a plane that cuts it
        mesh.apply_translation([0, -float(np.median(mesh.vertices[:, 1])), 0])
        mesh = mirrored(mesh)
    return mesh


def tower(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return simple solids stood on each other or side by side, flush or shifted."""
    palette = draw_palette(rng)
    axis = 2 if chance(rng, 0.7) else 0
    shift = rng.choice([0, 0.15])
    at = np.zeros(3)
    parts: list[Mesh] = []
    for _ in range(int(rng.integers(2, 7))):
        part = _primitive(rng, palette[rng.integers(4)], rings=0)
        if chance(rng, 0.3):
            moved(part, axis=[1, 0, 0], angle=math.pi / 2)
        low, high = part.bounds
        at[:] = [at[i] if i == axis else rng.normal(0, shift) * 0.5 for i in range(3)]
        offset = at.copy()
        offset[axis] -= low[axis]
        if axis == 0:
            offset[2] = -low[2]
        parts.append(part)
        part.apply_translation(offset)
        at[axis] += (high - low)[axis] * 0.97
    if axis == 0:  # a row stands on one board, stacked solids on their own feet
        wide = max(float(part.extents[1]) for part in parts)
        parts.append(box([-0.1, -wide / 2, -0.12], [at[0] + 0.1, wide / 2, 0.05], palette[1]))
    else:  # a peg through all of them, at times seen above
        above = 0.2 if chance(rng, 0.2) else -0.1
        parts.append(rod([0, 0, 0.1], [0, 0, at[2] + above], 0.07, palette[3]))
    return assemble(parts)


ASSEMBLED: dict[Generator, float] = {
    cluster: 0.25, tower: 0.1, hammer: 0.1, handled: 0.1, spanner: 0.08, pincers: 0.06,
    vehicle: 0.1, peg_toy: 0.05, figure: 0.06, device: 0.07, plant: 0.03}
