"""Where a surface runs through itself."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
import trimesh

_CHUNK = 200_000
"""Pairs of faces that are compared at once: some 200 MB."""
_TOUCHING = 1e-9
"""Volume of a tetrahedron, in cubed radii of the largest face, up to which it is flat."""


def self_intersections(mesh: trimesh.Trimesh) -> NDArray[np.intp]:
    """
    Return the pairs of faces, (N, 2), of which one's edge pierces the inside of the other.

    Faces that only touch, at a corner or along an edge that they share, do not count, nor do
    faces in one plane. Time goes with the faces, if they are about as large as each other.
    """
    corners = np.asarray(mesh.triangles, np.float64)
    middle = corners.mean(axis=1)
    radius = np.linalg.norm(corners - middle[:, None], axis=2).max()
    corners, middle = corners / radius, middle / radius
    pairs = cKDTree(middle).query_pairs(2, output_type='ndarray')
    low, high = corners.min(axis=1), corners.max(axis=1)
    first, second = pairs.T
    close = ((low[first] <= high[second]) & (low[second] <= high[first])).all(axis=1)
    found = [part[_pierces(mesh.faces, corners, part) | _pierces(mesh.faces, corners,
                                                                 part[:, ::-1])]
             for part in np.array_split(pairs[close], close.sum() // _CHUNK + 1)]
    return np.concatenate(found)


def _pierces(faces: NDArray[np.integer], corners: NDArray[np.float64],
             pairs: NDArray[np.intp]) -> NDArray[np.bool_]:
    """Return of which pairs an edge of the first, with no corner of the second, pierces it."""
    one, other = pairs.T
    a, b, c = corners[other].swapaxes(0, 1)
    pierced = np.zeros(len(pairs), np.bool_)
    for begin, end in ((0, 1), (1, 2), (2, 0)):
        apart = ((faces[one, begin, None] != faces[other]).all(axis=1)
                 & (faces[one, end, None] != faces[other]).all(axis=1))
        p, q = corners[one, begin], corners[one, end]
        # The ends are on two sides of the plane, and the line passes the edges on one side
        sides = _side(p, a, b, c) * _side(q, a, b, c) < 0
        turns = np.stack([_side(p, q, a, b), _side(p, q, b, c), _side(p, q, c, a)])
        pierced |= apart & sides & (np.abs(turns.sum(axis=0)) == 3)
    return pierced


def _side(p: NDArray[np.float64], a: NDArray[np.float64], b: NDArray[np.float64],
          c: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return on which side of the triangles a, b, c points are, 1 or -1, (N,); 0: in its plane."""
    volume = np.einsum('ij,ij->i', a - p, np.cross(b - p, c - p))
    return np.asarray(np.where(np.abs(volume) > _TOUCHING, np.sign(volume), 0))
