"""Soft and moulded parts of seats: cushions, walls bent in plan, shells bent in profile."""

import math

from active_recon.shapes.common.parts import assemble, Color, loft, Mesh
import numpy as np
from numpy.typing import ArrayLike, NDArray


def cushion(low: ArrayLike, high: ArrayLike, color: Color, radius: float = 0.04,
            crown: float = 0.0) -> Mesh:
    """Return a box with rounded edges between two opposite corners, its top swollen by crown."""
    bounds = np.sort([low, high], axis=0).astype(np.float64)
    center, size = bounds.mean(axis=0), np.ptp(bounds, axis=0)
    radius = min(radius, 0.45 * float(size.min()))
    bends = np.array([0.0, 0.5, 1.0]) * math.pi / 2
    inset = radius * (1 - np.sin(bends))
    rise = radius * (1 - np.cos(bends))
    levels = [*zip(inset, bounds[0, 2] + rise, strict=True),
              *zip(inset[::-1], bounds[1, 2] - rise[::-1], strict=True)]
    loops = [np.column_stack([_rounded_rectangle(size[0] - 2 * i, size[1] - 2 * i,
                                                 radius - 0.9 * i) + center[:2],
                              np.full(12, z)]) for i, z in levels]
    swollen = loops[-1].copy()
    swollen[:, :2] = center[:2] + 0.5 * (swollen[:, :2] - center[:2])
    swollen[:, 2] += crown
    return loft([*loops, swollen], color)


def wall(path: ArrayLike, low: float, tops: ArrayLike, thickness: float, color: Color,
         flare: float = 0.0) -> Mesh:
    """
    Return a wall that follows a path in plan, (N, 2), its top (N or one) rounded off.

    It leans to the right of the path's direction by flare, metres per metre of height.
    """
    points = np.asarray(path, np.float64)
    heights = np.broadcast_to(np.asarray(tops, np.float64), len(points))
    along = np.gradient(points, axis=0)
    right = np.column_stack([along[:, 1], -along[:, 0]])
    right /= np.linalg.norm(right, axis=1, keepdims=True)
    edge = min(0.3 * thickness, 0.05)
    loops = []
    for point, side, top in zip(points, right, heights, strict=True):
        section = np.array([[-thickness / 2, low], [thickness / 2, low],
                            [thickness / 2, top - edge], [thickness / 2 - edge, top],
                            [edge - thickness / 2, top], [-thickness / 2, top - edge]])
        offset = section[:, :1] + flare * (section[:, 1:] - low)
        loops.append(np.column_stack([point + offset * side, section[:, 1]]))
    return loft(loops, color)


def shell(profile: ArrayLike, half_widths: ArrayLike, dish: ArrayLike, thickness: float,
          color: Color) -> Mesh:
    """
    Return a moulded seat: a profile of (x, z) from the front edge to the back's top, (N, 2).

    At each point it is half_widths wide to each side, and its edges rise by dish towards the
    sitter (each N or one).
    """
    points = np.asarray(profile, np.float64)
    count = len(points)
    along = np.gradient(points, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    sitter = np.column_stack([along[:, 1], -along[:, 0]])
    across = np.linspace(-1, 1, 9)
    loops = []
    for point, normal, half, rise in zip(
            points, sitter, np.broadcast_to(np.asarray(half_widths, np.float64), count),
            np.broadcast_to(np.asarray(dish, np.float64), count), strict=True):
        face = point + (rise * across**2)[:, None] * normal
        both = np.vstack([face, face[::-1] - thickness * normal])
        y = half * np.concatenate([across, across[::-1]])
        loops.append(np.column_stack([both[:, 0], y, both[:, 1]]))
    return loft(loops, color)


def smoothed(path: ArrayLike, rounds: int = 2) -> NDArray[np.float64]:
    """Return an open path with its corners cut round after round; its ends stay."""
    points = np.asarray(path, np.float64)
    for _ in range(rounds):
        cut = np.stack([0.75 * points[:-1] + 0.25 * points[1:],
                        0.25 * points[:-1] + 0.75 * points[1:]], axis=1)
        points = np.vstack([points[:1], cut.reshape(-1, points.shape[1])[1:-1], points[-1:]])
    return points


def filleted(path: ArrayLike, radius: float) -> NDArray[np.float64]:
    """Return an open path whose corners are rounded off from radius before to radius after."""
    points = np.asarray(path, np.float64)
    rounded = [points[0]]
    for before, corner, after in zip(points[:-2], points[1:-1], points[2:], strict=True):
        enter, leave = (corner + (end - corner) * min(0.49, radius / np.linalg.norm(end - corner))
                        for end in (before, after))
        rounded += [enter, (enter + 2 * corner + leave) / 4, leave]
    return np.vstack([*rounded, points[-1]])


def tilted(mesh: Mesh, pivot: ArrayLike, angle: float) -> Mesh:
    """Return the part leaned backwards, towards -x, about the axis along y through pivot."""
    turned = assemble([mesh])  # much cheaper than copy, which also finds vertex colours
    relative = turned.vertices - np.asarray(pivot, np.float64)
    cosine, sine = math.cos(angle), math.sin(angle)
    rotation = np.array([[cosine, 0, -sine], [0, 1, 0], [sine, 0, cosine]])
    turned.vertices = relative @ rotation.T + pivot
    return turned


def _rounded_rectangle(width: float, height: float, radius: float) -> NDArray[np.float64]:
    corners = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) * (
        np.array([width, height]) / 2 - radius)
    angles = np.arange(4)[:, None] * math.pi / 2 + np.linspace(0, math.pi / 2, 3)
    arcs = radius * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    outline: NDArray[np.float64] = (corners[:, None] + arcs).reshape(-1, 2)
    return outline
