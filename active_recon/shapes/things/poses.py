"""How things lie: upright, tipped over onto a side that they rest on, or any way at all."""

import math

from active_recon.shapes.common.parts import Mesh
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull
import trimesh

_UPRIGHT, _TIPPED = 0.6, 0.25


def stretched(rng: np.random.Generator, mesh: Mesh) -> Mesh:
    """Scale two things in five along each axis by 0.7 to 1.4; the mesh itself."""
    if rng.random() < 0.4:
        mesh.apply_transform(np.diag([*rng.uniform(0.7, 1.4, 3), 1.0]))
    return mesh


def laid(rng: np.random.Generator, mesh: Mesh) -> Mesh:
    """Turn a thing to one of its poses, then about the vertical by any angle; the mesh itself."""
    way = rng.random()
    if way < _UPRIGHT:
        turn = np.eye(4)
    elif way < _UPRIGHT + _TIPPED:
        turn = trimesh.geometry.align_vectors(  # type: ignore[no-untyped-call]
            _resting_side(rng, mesh), [0, 0, -1])
    else:
        turn = trimesh.transformations.random_rotation_matrix(rng.random(3))
    yaw = trimesh.transformations.rotation_matrix(  # type: ignore[no-untyped-call]
        rng.uniform(0, 2 * math.pi), [0, 0, 1])
    mesh.apply_transform(yaw @ turn)
    return mesh


def _resting_side(rng: np.random.Generator, mesh: Mesh) -> NDArray[np.float64]:
    """Return the outward normal of a side of the convex hull, a large one rather than a small."""
    hull = ConvexHull(mesh.vertices)
    corners = hull.points[hull.simplices]
    normals = hull.equations[:, :3]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]),
                           axis=1) / 2
    _, group = np.unique(np.round(normals, 3), axis=0, return_inverse=True)
    sides = np.bincount(group.ravel(), areas)[group.ravel()]
    # The centre of mass must stand over the side, or the thing would roll on
    middle = hull.points[hull.vertices].mean(axis=0)
    foot = corners.mean(axis=1) - middle
    slide = np.linalg.norm(foot - (foot * normals).sum(axis=1, keepdims=True) * normals, axis=1)
    steady = np.exp(-4 * slide / max(float(mesh.extents.max()), 1e-9))
    weights = areas * sides * steady * (normals[:, 2] > -0.85)
    if weights.sum() <= 0:
        return np.array([0.0, 0, -1])
    pick: NDArray[np.float64] = normals[rng.choice(len(weights), p=weights / weights.sum())]
    return pick
