"""Skins over rings of points: revolutions, sweeps, extrusions and superquadrics, coloured."""

from collections.abc import Sequence
import math

from active_recon.shapes.common.parts import Color, Mesh
from active_recon.shapes.things.polygons import area, triangulated
import numpy as np
from numpy.typing import ArrayLike, NDArray
import trimesh

Points = NDArray[np.float64]


def painted(mesh: Mesh, colors: ArrayLike) -> Mesh:
    """Give a mesh one colour, (3,), or one for each face, (F, 3)."""
    rgb = np.broadcast_to(np.clip(np.rint(np.asarray(colors, np.float64)), 0, 255),
                          (len(mesh.faces), 3))
    rgba = np.column_stack([rgb, np.full(len(rgb), 255)]).astype(np.uint8)
    mesh.visual = trimesh.visual.ColorVisuals(mesh, face_colors=rgba)
    return mesh


def skin(rings: ArrayLike, colors: ArrayLike, closed: bool = False) -> Mesh:
    """
    Return the surface through R rings of M points, (R, M, 3), the last joined to the first or not.

    Where it is not closed, fans cap its ends. The colours are one, (3,), or one for each band
    between two rings, (R - 1, 3) or closed (R, 3).
    """
    points = np.asarray(rings, np.float64)
    count, size, _ = points.shape
    index = np.arange(count * size).reshape(count, size)
    a, b = (index, np.roll(index, -1, axis=0)) if closed else (index[:-1], index[1:])
    a_next, b_next = np.roll(a, -1, axis=1), np.roll(b, -1, axis=1)
    faces = np.stack([a, a_next, b_next, a, b_next, b], axis=-1).reshape(-1, 3)
    bands = np.broadcast_to(np.asarray(colors, np.float64), (len(a), 3))
    painting = np.repeat(bands, 2 * size, axis=0)
    vertices = points.reshape(-1, 3)
    if not closed:
        first, last = len(vertices), len(vertices) + 1
        start, end = index[0], index[-1]
        faces = np.vstack([
            faces, np.column_stack([np.full(size, first), np.roll(start, -1), start]),
            np.column_stack([np.full(size, last), end, np.roll(end, -1)])])
        vertices = np.vstack([vertices, points[0].mean(axis=0), points[-1].mean(axis=0)])
        painting = np.vstack([painting, np.repeat(bands[[0, -1]], size, axis=0)])
    return painted(trimesh.Trimesh(vertices, faces, process=False), painting)


def circle(points: int = 40, radius: float = 1.0) -> Points:
    """Return a regular polygon about 0, (points, 2)."""
    angles = (np.arange(points) + 0.5) * 2 * math.pi / points
    return radius * np.column_stack([np.cos(angles), np.sin(angles)])


def revolved(profile: ArrayLike, colors: ArrayLike, section: Points | None = None,
             closed: bool = False, twist: float = 0.0) -> Mesh:
    """
    Carry a section of unit size, (M, 2), a circle unless told, along a profile of (radius, z).

    The section turns by twist, radians, from the profile's lowest to its highest point.
    """
    outline = np.asarray(profile, np.float64)
    flat = circle() if section is None else section
    level = (outline[:, 1] - outline[:, 1].min()) / max(float(np.ptp(outline[:, 1])), 1e-9)
    cosine, sine = np.cos(twist * level)[:, None], np.sin(twist * level)[:, None]
    x = outline[:, :1] * (cosine * flat[:, 0] - sine * flat[:, 1])
    y = outline[:, :1] * (sine * flat[:, 0] + cosine * flat[:, 1])
    z = np.broadcast_to(outline[:, 1:], x.shape)
    return skin(np.stack([x, y, z], axis=-1), colors, closed)


def hollow(outer: ArrayLike, wall: float) -> Points:
    """Return a profile of (radius, z) that runs up outside and comes back inside, a wall away."""
    points = np.asarray(outer, np.float64)
    along = np.gradient(points, axis=0)
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-12)
    inner = points + wall * np.column_stack([-along[:, 1], along[:, 0]])
    inner[:, 0] = np.maximum(inner[:, 0], 0)
    inner[-1, 1] = points[-1, 1]
    return np.vstack([points, inner[::-1]])


def extruded(outline: ArrayLike, low: float, high: float, color: Color,
             holes: Sequence[ArrayLike] = (), side: Color | None = None, twist: float = 0.0,
             taper: float = 1.0) -> Mesh:
    """
    Return a polygon with holes made solid along z, its sides in a colour of their own if told.

    Towards the top it turns by twist, radians, and shrinks or grows to taper.
    """
    flat, cap = triangulated(outline, holes)
    layers = 2 if twist == 0 else 2 + math.ceil(abs(twist) / 0.15)
    share = np.linspace(0, 1, layers)[:, None]
    scale = 1 + (taper - 1) * share
    cosine, sine = scale * np.cos(twist * share), scale * np.sin(twist * share)
    x = cosine * flat[:, 0] - sine * flat[:, 1]
    y = sine * flat[:, 0] + cosine * flat[:, 1]
    z = np.broadcast_to(low + (high - low) * share, x.shape)
    count = len(flat)
    faces = [cap[:, ::-1], cap + (layers - 1) * count]
    start = 0
    for number, loop in enumerate((outline, *holes)):
        size = len(np.asarray(loop))
        around = start + np.arange(size)
        if (area(loop) > 0) != (number == 0):  # the solid lies to the left of every edge
            around = around[::-1]
        a = around + count * np.arange(layers - 1)[:, None]
        a_next = np.roll(around, -1) + count * np.arange(layers - 1)[:, None]
        faces.append(np.stack([a, a_next, a_next + count, a, a_next + count, a + count],
                              axis=-1).reshape(-1, 3))
        start += size
    mesh = trimesh.Trimesh(np.stack([x, y, z], axis=-1).reshape(-1, 3), np.vstack(faces),
                           process=False)
    colors = np.tile(np.asarray(color, np.float64), (len(mesh.faces), 1))
    colors[2 * len(cap):] = color if side is None else side
    return painted(mesh, colors)


def swept(path: ArrayLike, section: ArrayLike, color: ArrayLike, closed: bool = False,
          scales: ArrayLike = 1.0, up: ArrayLike | None = None) -> Mesh:
    """
    Carry a flat section, (M, 2), along a path, (N, 3), with mitred corners, scaled on the way.

    The section's first axis points away from `up` x path; the frame turns as little as it can.
    """
    return skin(_rings(path, section, closed, scales, up), color, closed)


def pipe(path: ArrayLike, section: ArrayLike, wall: float, color: ArrayLike,
         up: ArrayLike | None = None) -> Mesh:
    """
    Carry a section about 0, (M, 2), of radius 1 or so along a path as a tube open at the ends.

    The wall is a share of the section's size.
    """
    outer = _rings(path, section, False, 1.0, up)
    inner = _rings(path, np.asarray(section) * (1 - wall), False, 1.0, up)
    return skin(np.concatenate([outer, inner[::-1]]), color, closed=True)


def _rings(path: ArrayLike, section: ArrayLike, closed: bool, scales: ArrayLike,
           up: ArrayLike | None) -> Points:
    points, flat = np.asarray(path, np.float64), np.asarray(section, np.float64)
    ends = np.roll(points, -1, axis=0) if closed else points[1:]
    steps = ends - points[:len(ends)]
    steps /= np.maximum(np.linalg.norm(steps, axis=1, keepdims=True), 1e-12)
    into = np.roll(steps, 1, axis=0) if closed else np.vstack([steps[:1], steps])
    out = steps if closed else np.vstack([steps, steps[-1:]])
    start = np.array([0, 0, 1.0]) if up is None else np.asarray(up, np.float64)
    if abs(into[0] @ start) > 0.95:
        start = np.array([1.0, 0, 0])
    normal = start - (start @ into[0]) * into[0]
    normal /= np.linalg.norm(normal)
    rings, normals = [], []
    for point, before, after, scale in zip(
            points, into, out, np.broadcast_to(scales, len(points)), strict=True):
        across = np.cross(normal, before)
        offset = scale * (flat[:, :1] * across + flat[:, 1:] * normal)
        middle = before + after
        middle /= max(float(np.linalg.norm(middle)), 1e-9)
        lean = max(float(before @ middle), 0.35)
        rings.append(point + offset - before * (offset @ middle / lean)[:, None])
        normals.append(normal)
        axis = np.cross(before, after)  # turn the frame as the path turns
        normal = (normal * (before @ after) + np.cross(axis, normal)
                  + axis * (axis @ normal) / max(1 + float(before @ after), 1e-6))
        normal -= (normal @ after) * after
        normal /= np.linalg.norm(normal)
    if closed:  # bring the frame home by turning every ring a little
        before = into[0]
        turn = math.atan2(float(np.cross(normals[0], normal) @ before), float(normals[0] @ normal))
        return _untwisted(points, np.array(rings), out, -turn)
    return np.array(rings)


def _untwisted(points: Points, rings: Points, axes: Points, total: float) -> Points:
    angles = total * np.arange(len(rings)) / len(rings)
    offset = rings - points[:, None]
    axis = axes[:, None]
    cosine, sine = np.cos(angles)[:, None, None], np.sin(angles)[:, None, None]
    turned: Points = (offset * cosine + np.cross(axis, offset) * sine
                      + axis * (offset * axis).sum(axis=-1, keepdims=True) * (1 - cosine))
    return points[:, None] + turned


def superquadric(radii: ArrayLike, powers: tuple[float, float], color: Color) -> Mesh:
    """Return a superquadric about 0: powers 1 a ball, towards 0 a box, above 1 pinched."""
    up = np.linspace(-math.pi / 2, math.pi / 2, 21)
    around = circle(32)
    around = np.sign(around) * np.abs(around) ** powers[1]
    radius = np.abs(np.cos(up)) ** powers[0]
    level = np.sign(np.sin(up)) * np.abs(np.sin(up)) ** powers[0]
    mesh = revolved(np.column_stack([radius, level]), color, around)
    mesh.apply_transform(np.diag([*np.asarray(radii, np.float64), 1.0]))
    return mesh


def torus(radius: float, tube: float, color: Color, section: Points | None = None) -> Mesh:
    """Return a ring about the z axis, its section round or as told (of unit size)."""
    flat = tube * (circle(14) if section is None else section)
    return revolved(flat + [radius, 0], color, closed=True)


def moved(mesh: Mesh, offset: ArrayLike = (0, 0, 0), axis: ArrayLike = (0, 0, 1),
          angle: float = 0.0) -> Mesh:
    """Turn a mesh about an axis through 0, radians, then move it; the mesh itself."""
    transform = np.eye(4)
    if angle:
        transform = trimesh.transformations.rotation_matrix(  # type: ignore[no-untyped-call]
            angle, np.asarray(axis, np.float64))
    transform[:3, 3] = np.asarray(offset, np.float64)
    mesh.apply_transform(transform)
    return mesh
