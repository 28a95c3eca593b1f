"""
The parts that the parametric categories are built from: closed meshes with a colour.

Metres, z up, front +x. A colour is three numbers in [0, 255]. Every part is a plain
`trimesh.Trimesh` with face colours, so parts can be moved with trimesh's own methods and are put
together by `assemble`.
"""

from collections.abc import Iterable, Sequence
import math

import numpy as np
from numpy.typing import ArrayLike, NDArray
import trimesh

Color = Sequence[float] | NDArray[np.float64]
Mesh = trimesh.Trimesh


def _colored(mesh: Mesh, color: Color) -> Mesh:
    rgba = np.append(np.clip(np.rint(color), 0, 255), 255).astype(np.uint8)
    colors = np.tile(rgba, (len(mesh.faces), 1))
    mesh.visual = trimesh.visual.ColorVisuals(mesh, face_colors=colors)
    return mesh


def box(low: ArrayLike, high: ArrayLike, color: Color) -> Mesh:
    """Return an axis-aligned box between two opposite corners, (3,) each."""
    return _colored(trimesh.creation.box(bounds=np.sort([low, high], axis=0)), color)


def beam(start: ArrayLike, end: ArrayLike, width: float, color: Color,
         height: float | None = None, end_scale: float = 1.0) -> Mesh:
    """Return a straight bar of rectangular section between two points, tapered to end_scale."""
    half = np.array([width, width if height is None else height]) / 2
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * half
    return _swept(corners, start, end, end_scale, color)


def rod(start: ArrayLike, end: ArrayLike, radius: float, color: Color,
        end_radius: float | None = None, sections: int = 12) -> Mesh:
    """Return a straight round bar between two points; a cone where end_radius is 0."""
    angles = np.arange(sections) * 2 * math.pi / sections
    circle = radius * np.column_stack([np.cos(angles), np.sin(angles)])
    return _swept(circle, start, end, 1 if end_radius is None else end_radius / radius, color)


def tube(path: ArrayLike, radius: float, color: Color, sections: int = 10) -> Mesh:
    """Return a bent round bar through the points of a path, (N, 3), joined by spheres' rings."""
    points = np.asarray(path, np.float64)
    pieces = [rod(a, b, radius, color, sections=sections)
              for a, b in zip(points[:-1], points[1:], strict=True)]
    joints = [ellipsoid(p, (radius,) * 3, color, subdivisions=1) for p in points[1:-1]]
    return assemble([*pieces, *joints])


def ellipsoid(center: ArrayLike, radii: ArrayLike, color: Color, subdivisions: int = 2) -> Mesh:
    """Return an ellipsoid with axes along x, y, z."""
    mesh = trimesh.creation.icosphere(subdivisions=subdivisions)
    mesh.apply_scale(np.asarray(radii, np.float64))
    mesh.apply_translation(np.asarray(center, np.float64))
    return _colored(mesh, color)


def lathe(profile: ArrayLike, color: Color, center: ArrayLike = (0, 0, 0),
          sections: int = 24) -> Mesh:
    """Revolve a profile of (radius, z) points, (N, 2), about the vertical axis through center."""
    outline = np.asarray(profile, np.float64)
    angles = np.arange(sections) * 2 * math.pi / sections
    loops = [np.column_stack([r * np.cos(angles), r * np.sin(angles), np.full(sections, z)])
             for r, z in outline]
    mesh = loft(loops, color)
    mesh.apply_translation(np.asarray(center, np.float64))
    return mesh


def prism(outline: ArrayLike, low: float, high: float, axis: str, color: Color) -> Mesh:
    """
    Return a flat outline, (N, 2), made solid along an axis from low to high.

    The outline's two coordinates are, by axis: x: (y, z); y: (x, z); z: (x, y). It must be
    star-shaped about its centroid.
    """
    flat = np.asarray(outline, np.float64)
    loops = [np.insert(flat, 'xyz'.index(axis), along, axis=1) for along in (low, high)]
    return loft(loops, color)


def loft(loops: Sequence[ArrayLike], color: Color) -> Mesh:
    """
    Return the skin over cross-sections, closed loops of N points, (N, 3), capped at the ends.

    All loops have the same number of points, in matching order; each end must be star-shaped
    about its centroid. Fuselages, car bodies, wings and cushions are made with it.
    """
    rings = np.array(loops, np.float64)  # (loops, N, 3)
    count, size, _ = rings.shape
    index = np.arange(count * size).reshape(count, size)
    a, b = index[:-1], index[1:]
    a_next, b_next = np.roll(a, -1, axis=1), np.roll(b, -1, axis=1)
    sides = np.stack([np.stack([a, a_next, b_next], -1), np.stack([a, b_next, b], -1)])
    first, last = count * size, count * size + 1  # the caps' centres
    start, end = index[0], index[-1]
    caps = [np.column_stack([np.full(size, first), np.roll(start, -1), start]),
            np.column_stack([np.full(size, last), end, np.roll(end, -1)])]
    vertices = np.vstack([rings.reshape(-1, 3), rings[0].mean(axis=0), rings[-1].mean(axis=0)])
    mesh = trimesh.Trimesh(vertices, np.vstack([sides.reshape(-1, 3), *caps]), process=False)
    if mesh.volume < 0:
        mesh.invert()
    return _colored(mesh, color)


def superellipse(width: float, height: float, power: float = 2.0,
                 points: int = 20) -> NDArray[np.float64]:
    """Return an outline about 0, (points, 2): round at power 2, a rounded rectangle above."""
    angles = np.arange(points) * 2 * math.pi / points
    round_outline = np.column_stack([np.cos(angles), np.sin(angles)])
    bent = np.sign(round_outline) * np.abs(round_outline) ** (2 / power)
    outline: NDArray[np.float64] = bent * [width / 2, height / 2]
    return outline


def mirrored(mesh: Mesh) -> Mesh:
    """Return the part with its twin on the other side of the object's plane y = 0."""
    twin = mesh.copy()
    twin.apply_transform(np.diag([1.0, -1.0, 1.0, 1.0]))
    return assemble([mesh, twin])


def assemble(parts: Iterable[Mesh]) -> Mesh:
    """Put parts together into one mesh; they may overlap."""
    pieces = list(parts)
    mesh = trimesh.Trimesh(
        np.vstack([piece.vertices for piece in pieces]),
        np.vstack([piece.faces + offset for piece, offset in zip(
            pieces, np.cumsum([0] + [len(p.vertices) for p in pieces[:-1]]), strict=True)]),
        process=False)
    colors = np.vstack([_face_colors(piece) for piece in pieces])
    mesh.visual = trimesh.visual.ColorVisuals(mesh, face_colors=colors)
    return mesh


def _face_colors(mesh: Mesh) -> NDArray[np.uint8]:
    colors = mesh.visual.face_colors  # type: ignore[union-attr]  # every part has them
    return np.asarray(colors, np.uint8)


def _swept(section: NDArray[np.float64], start: ArrayLike, end: ArrayLike, end_scale: float,
           color: Color) -> Mesh:
    """Return a flat section, (N, 2), carried from start to end; upright where it can be."""
    start, end = np.asarray(start, np.float64), np.asarray(end, np.float64)
    along = (end - start) / np.linalg.norm(end - start)
    up = np.array([1.0, 0, 0]) if abs(along[2]) > 0.99 else np.array([0, 0, 1.0])
    across = np.cross(up, along)
    across /= np.linalg.norm(across)
    above = np.cross(along, across)
    flat = section[:, :1] * across + section[:, 1:] * above
    return loft([start + flat, end + flat * max(end_scale, 1e-3)], color)
