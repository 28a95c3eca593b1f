"""Patterns over finished things: halves, stripes, checks, segments and spots, cut exactly."""

from collections.abc import Callable
import math

from active_recon.shapes.common.parts import Mesh
from active_recon.shapes.things.colors import Palette
from active_recon.shapes.things.solids import painted
import numpy as np
from numpy.typing import NDArray
import trimesh

Points = NDArray[np.float64]
Field = Callable[[Points], NDArray[np.float64]]
_MOST_FACES = 40_000


def decorated(rng: np.random.Generator, mesh: Mesh, palette: Palette) -> Mesh:
    """
    Return a mesh with a pattern over all of it or over its commonest colour alone.

    A pattern sorts the surface into classes; the first keeps its colours, others take the
    palette's.
    """
    patterns = (_halves, _stripes, _stripes, _checks, _segments, _spots)
    cuts, classes = patterns[rng.choice(len(patterns))](rng, mesh)
    colors = _rgb(mesh)
    kinds, counts = np.unique(colors, axis=0, return_counts=True)
    commonest = kinds[counts.argmax()] if rng.random() < 0.6 else None
    fine = mesh
    for field in cuts:
        if len(fine.faces) < _MOST_FACES:
            fine = split(fine, field)
    colors = _rgb(fine)
    found = classes(fine.triangles_center)
    kept = found == 0
    if commonest is not None:
        kept |= (colors != commonest).any(axis=1)
    inks = palette[np.array([0, *rng.integers(1, 4, 2)])]
    return painted(fine, np.where(kept[:, None], colors, inks[np.minimum(found, 2)]))


def split(mesh: Mesh, field: Field) -> Mesh:
    """Return a mesh whose triangles are cut where a field of points, (N, 3) to (N,), is 0."""
    vertices, faces, colors = mesh.vertices, mesh.faces, _rgb(mesh)
    values = field(vertices)
    values = np.where(np.abs(values) < 1e-9, 1e-9, values)
    above = values[faces] > 0
    mixed = np.flatnonzero(above.any(axis=1) & ~above.all(axis=1))
    if len(mixed) == 0:
        return mesh
    lone_above = above[mixed].sum(axis=1) == 1
    lone = np.where(lone_above, above[mixed].argmax(axis=1), above[mixed].argmin(axis=1))
    order = (lone[:, None] + np.arange(3)) % 3
    a, b, c = np.take_along_axis(faces[mixed], order, axis=1).T
    rise_b = (values[a] / (values[a] - values[b]))[:, None]
    rise_c = (values[a] / (values[a] - values[c]))[:, None]
    on_b = vertices[a] + rise_b * (vertices[b] - vertices[a])
    on_c = vertices[a] + rise_c * (vertices[c] - vertices[a])
    p = len(vertices) + np.arange(len(mixed))
    q = p + len(mixed)
    pieces = np.vstack([np.column_stack([a, p, q]), np.column_stack([p, b, c]),
                        np.column_stack([p, c, q])])
    whole = np.setdiff1d(np.arange(len(faces)), mixed)
    cut = trimesh.Trimesh(np.vstack([vertices, on_b, on_c]), np.vstack([faces[whole], pieces]),
                          process=False)
    return painted(cut, np.vstack([colors[whole], np.tile(colors[mixed], (3, 1))]))


def _rgb(mesh: Mesh) -> NDArray[np.float64]:
    return np.asarray(mesh.visual.face_colors, np.float64)[:, :3]  # type: ignore[union-attr]


Pattern = tuple[list[Field], Callable[[Points], NDArray[np.int64]]]


def _direction(rng: np.random.Generator) -> Points:
    if rng.random() < 0.75:
        return np.asarray(np.eye(3)[rng.choice(3, p=[0.2, 0.2, 0.6])])
    direction = rng.normal(size=3)
    return np.asarray(direction / np.linalg.norm(direction))


def _halves(rng: np.random.Generator, mesh: Mesh) -> Pattern:
    """Two tones, or three, one over the other or side by side."""
    along = _direction(rng)
    spread = mesh.vertices @ along
    levels = np.sort(rng.uniform(0.2, 0.8, rng.integers(1, 3)))
    levels = spread.min() + levels * np.ptp(spread)
    return ([_plane(along, level) for level in levels],
            lambda points: np.searchsorted(levels, points @ along))


def _plane(along: Points, level: float) -> Field:
    return lambda points: np.asarray(points @ along - level)


def _banding(rng: np.random.Generator, mesh: Mesh, most: int) -> Pattern:
    along = _direction(rng)
    spread = mesh.vertices @ along
    count = int(rng.integers(3, most))
    share = rng.uniform(0.25, 0.65)
    start, step = float(spread.min()), float(np.ptp(spread)) / count
    levels = start + step * (np.arange(2 * count) // 2 + np.tile([0, share], count))
    return ([_plane(along, level) for level in levels],
            lambda points: ((points @ along - start) % step < share * step).astype(np.int64))


def _stripes(rng: np.random.Generator, mesh: Mesh) -> Pattern:
    """Bands of two widths along one direction, wide or fine."""
    return _banding(rng, mesh, int(rng.choice([5, 12])))


def _checks(rng: np.random.Generator, mesh: Mesh) -> Pattern:
    """Two bandings over each other: squares, or a tartan of three tones."""
    first_cuts, first = _banding(rng, mesh, 7)
    second_cuts, second = _banding(rng, mesh, 7)
    tartan = rng.random() < 0.5

    def classes(points: Points) -> NDArray[np.int64]:
        a, b = first(points), second(points)
        return a + b if tartan else a ^ b

    return [*first_cuts, *second_cuts], classes


def _segments(rng: np.random.Generator, mesh: Mesh) -> Pattern:
    """Slices about the vertical axis, as on a beach ball."""
    middle = mesh.bounds.mean(axis=0)
    count = 2 * int(rng.integers(2, 8))
    start = rng.uniform(0, math.pi)
    angles = start + 2 * math.pi * np.arange(count // 2) / count

    def plane(angle: float) -> Field:
        normal = np.array([-math.sin(angle), math.cos(angle), 0])
        return _plane(normal, float(normal @ middle))

    def classes(points: Points) -> NDArray[np.int64]:
        x, y, _ = (points - middle).T
        turn = (np.arctan2(y, x) - start) / (2 * math.pi) * count
        return np.asarray(np.floor(turn).astype(np.int64) % 2)

    return [plane(float(angle)) for angle in angles], classes


def _spots(rng: np.random.Generator, mesh: Mesh) -> Pattern:
    """Round spots, or blots like a cow's, on a surface made fine enough for them."""
    size = float(mesh.extents.max())
    edge = max(size / 28, math.sqrt(mesh.area / (0.2 * _MOST_FACES)))
    if len(mesh.faces) < _MOST_FACES / 2:
        vertices, faces, index = trimesh.remesh.subdivide_to_size(  # type: ignore[no-untyped-call]
            mesh.vertices, mesh.faces, edge, max_iter=20, return_index=True)
        if len(faces) < 1.3 * _MOST_FACES:
            colors = _rgb(mesh)[index]
            mesh.vertices, mesh.faces = vertices, faces
            painted(mesh, colors)
    numbers = rng.normal(size=(5, 3)) * 2 * math.pi / size * rng.uniform(0.7, 2.2)
    phases = rng.uniform(0, 2 * math.pi, 5)
    level = rng.uniform(-0.3, 1)
    round_spots = rng.random() < 0.5
    centers = mesh.triangles_center[rng.choice(len(mesh.faces), int(rng.integers(5, 30)))]
    radii = size * rng.uniform(0.03, 0.13, len(centers))

    def field(points: Points) -> NDArray[np.float64]:
        if round_spots:
            apart = np.linalg.norm(points[:, None] - centers, axis=-1) - radii
            return np.asarray(-apart.min(axis=1))
        return np.asarray(np.sin(points @ numbers.T + phases).sum(axis=1) - level)

    return [field], lambda points: (field(points) > 0).astype(np.int64)
