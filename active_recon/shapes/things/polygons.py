"""Flat polygons with holes, cut into triangles without any other library."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

Points = NDArray[np.float64]
Faces = NDArray[np.int64]


def area(outline: ArrayLike) -> float:
    """Return the signed area of an outline, (N, 2): positive where it runs anticlockwise."""
    x, y = np.asarray(outline, np.float64).T
    return float(0.5 * (x * np.roll(y, -1) - y * np.roll(x, -1)).sum())


def triangulated(outline: ArrayLike, holes: Sequence[ArrayLike] = ()) -> tuple[Points, Faces]:
    """
    Return the triangles of a simple polygon, (N, 2), with holes in it: points and faces.

    The points are those of the outline and then of each hole, in their order. The holes must lie
    inside and must not touch. Every hole is tied to the outline by a bridge, then ears are cut.
    """
    loops = [np.asarray(loop, np.float64) for loop in (outline, *holes)]
    points = np.vstack(loops)
    starts = np.cumsum([0, *map(len, loops)])
    rings = [np.arange(start, start + len(loop))
             for start, loop in zip(starts, loops, strict=False)]
    ring = rings[0] if area(loops[0]) > 0 else rings[0][::-1]
    inner = [hole if area(loop) < 0 else hole[::-1]
             for hole, loop in zip(rings[1:], loops[1:], strict=True)]
    inner.sort(key=lambda hole: -points[hole, 0].max())
    for number, hole in enumerate(inner):
        ring = _bridged(points, ring, hole, inner[number:])
    return points, _clipped(points, ring)


def _cross(a: Points, b: Points) -> Points:
    product: Points = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return product


def _bridged(points: Points, ring: Faces, hole: Faces, obstacles: list[Faces]) -> Faces:
    """Return the ring with a hole spliced in at the nearest corner that sees it."""
    hole = np.roll(hole, -int(points[hole, 0].argmax()))
    start = points[hole[0]]
    edges = np.vstack([np.column_stack([loop, np.roll(loop, -1)]) for loop in (ring, *obstacles)])
    for at in np.argsort(((points[ring] - start) ** 2).sum(axis=1)):
        end = points[ring[at]]
        if not _crosses(start, end, points[edges[:, 0]], points[edges[:, 1]]) and _within(
                points[ring[at - 1]], end, points[ring[(at + 1) % len(ring)]], start):
            break
    return np.concatenate([ring[:at + 1], hole, hole[:1], ring[at:]])


def _crosses(a: Points, b: Points, start: Points, end: Points) -> bool:
    """Tell whether a segment meets any of others, apart from those that share a corner with it."""
    shared = ((start == a).all(axis=1) | (end == a).all(axis=1)
              | (start == b).all(axis=1) | (end == b).all(axis=1))
    side_start, side_end = _cross(b - a, start - a), _cross(b - a, end - a)
    side_a, side_b = _cross(end - start, a - start), _cross(end - start, b - start)
    meets = (side_start * side_end <= 0) & (side_a * side_b <= 0)
    return bool((meets & ~shared).any())


def _within(before: Points, corner: Points, after: Points, point: Points) -> bool:
    """Tell whether a point is seen from a corner on the inner side of its two edges."""
    left_in = _cross(corner - before, point - corner) > 0
    left_out = _cross(after - corner, point - corner) > 0
    convex = _cross(corner - before, after - corner) > 0
    return bool(left_in and left_out if convex else left_in or left_out)


def _clipped(points: Points, ring: Faces) -> Faces:
    """Return the triangles of a ring of corners that runs anticlockwise, ear by ear."""
    left = list(ring)
    faces = []
    at, failures = 0, 0
    while len(left) > 3:
        count = len(left)
        at %= count
        ear = [left[at - 1], left[at], left[(at + 1) % count]]
        if failures > count or _is_ear(points, ear, left):
            faces.append(ear)
            del left[at]
            failures = 0
            at += 1  # the next corner but one, so that the triangles fan out less
        else:
            failures += 1
            at += 1
    return np.array([*faces, left], np.int64)


def _is_ear(points: Points, ear: list[int], left: list[int]) -> bool:
    a, b, c = points[ear]
    if (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) <= 1e-14:
        return False
    others = points[left]
    inside = ((_cross(b - a, others - a) >= 0) & (_cross(c - b, others - b) >= 0)
              & (_cross(a - c, others - c) >= 0))
    inside &= ~((others == a).all(axis=1) | (others == b).all(axis=1) | (others == c).all(axis=1))
    return not inside.any()
