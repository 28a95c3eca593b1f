"""Bodies by their signed distances: melted together, cut out of each other, then meshed."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from active_recon.shapes.common.parts import Color, Mesh
from active_recon.shapes.things.solids import painted
import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import label
from skimage.measure import marching_cubes
import trimesh

Points = NDArray[np.float32]
Distance = Callable[[Points], NDArray[np.float32]]
_FAR = np.float32(1e3)
_HIGHEST_BUMP = 0.4  # of `waves`, in the bodies' own unit


@dataclass(frozen=True)
class Body:
    """A signed distance of points, (N, 3) to (N,), negative inside; its box, (2, 3); a colour."""

    distance: Distance
    bounds: NDArray[np.float64]
    color: Color


def _about(center: ArrayLike, reach: ArrayLike) -> NDArray[np.float64]:
    middle, size = np.asarray(center, np.float64), np.asarray(reach, np.float64)
    return np.array([middle - size, middle + size])


def ball(center: ArrayLike, radii: ArrayLike, color: Color,
         turn: ArrayLike | None = None) -> Body:
    """Return an ellipsoid, its axes turned by a rotation, (3, 3), if told."""
    middle, size = np.asarray(center, np.float32), np.asarray(radii, np.float32) * np.ones(3, 'f4')
    rotation = np.asarray(np.eye(3) if turn is None else turn, np.float32)

    def distance(points: Points) -> Points:
        local = (points - middle) @ rotation
        near = np.linalg.norm(local / size, axis=1)
        far: Points = near * (near - 1) / np.maximum(np.linalg.norm(local / size**2, axis=1), 1e-6)
        return far

    reach = size if turn is None else size.max()
    return Body(distance, _about(center, reach), color)


def limb(start: ArrayLike, end: ArrayLike, radius: float, color: Color,
         end_radius: float | None = None) -> Body:
    """Return a round bar with round ends, its radius changing from end to end."""
    a, b = np.asarray(start, np.float32), np.asarray(end, np.float32)
    last = radius if end_radius is None else end_radius

    def distance(points: Points) -> Points:
        along = b - a
        share = np.clip((points - a) @ along / (along @ along), 0, 1)
        off: Points = np.linalg.norm(points - a - share[:, None] * along, axis=1)
        return off - (radius + (last - radius) * share).astype(np.float32)

    reach = max(radius, last)
    return Body(distance, np.array([np.minimum(a, b) - reach, np.maximum(a, b) + reach]), color)


def block(low: ArrayLike, high: ArrayLike, color: Color, rounding: float = 0.0) -> Body:
    """Return a box between two corners, its edges rounded."""
    bounds = np.sort([low, high], axis=0).astype(np.float64)
    middle = bounds.mean(axis=0).astype(np.float32)
    half = (np.ptp(bounds, axis=0) / 2 - rounding).astype(np.float32)

    def distance(points: Points) -> Points:
        over = np.abs(points - middle) - half
        inside: Points = np.minimum(over.max(axis=1), 0)
        outside: Points = np.linalg.norm(np.maximum(over, 0), axis=1)
        return inside + outside - np.float32(rounding)

    return Body(distance, bounds, color)


def column(start: ArrayLike, end: ArrayLike, radius: float, color: Color,
           end_radius: float | None = None) -> Body:
    """Return a round bar with flat ends, or a cone's frustum."""
    a, b = np.asarray(start, np.float32), np.asarray(end, np.float32)
    last = radius if end_radius is None else end_radius
    length = float(np.linalg.norm(b - a))
    axis = (b - a) / length

    def distance(points: Points) -> Points:
        along = (points - a) @ axis
        off = np.linalg.norm(points - a - along[:, None] * axis, axis=1)
        side = off - (radius + (last - radius) * np.clip(along / length, 0, 1))
        far: Points = np.maximum(side, np.maximum(-along, along - length))
        return far

    reach = max(radius, last)
    return Body(distance, np.array([np.minimum(a, b) - reach, np.maximum(a, b) + reach]), color)


def half_space(point: ArrayLike, outward: ArrayLike, color: Color) -> Body:
    """Return all that lies behind a plane; it has no box of its own, so it only cuts."""
    normal = np.asarray(outward, np.float32) / np.float32(np.linalg.norm(outward))
    origin = np.asarray(point, np.float32)
    return Body(lambda points: (points - origin) @ normal, np.zeros((2, 3)), color)


def molten(bodies: Sequence[Body], blend: float = 0.0, cuts: Sequence[Body] = (),
           cells: int = 56, bumps: Distance | None = None) -> Mesh:
    """
    Return the surface of bodies melted together over a length, less the cuts.

    It is meshed with so many cells along its longest side. A face has the colour of the body that
    is nearest, or of the cut that made it. `bumps` is added to the distance. Of what the cuts
    leave, the largest piece stays.
    """
    low = np.min([body.bounds[0] for body in bodies], axis=0)
    high = np.max([body.bounds[1] for body in bodies], axis=0)
    swell = 0.6 * blend + (_HIGHEST_BUMP if bumps else 0)
    low, high = low - swell, high + swell
    pitch = float((high - low).max()) / cells
    counts = np.ceil((high - low) / pitch).astype(int) + 5
    low = low - 2 * pitch
    axes = [low[i] + pitch * np.arange(counts[i]) for i in range(3)]
    points = np.stack(np.meshgrid(*axes, indexing='ij'), axis=-1).astype(np.float32)
    grid = np.full(counts, _FAR)
    # A body moves the surface no farther than the blend, so the cells about it are enough
    reach = blend + 2 * pitch + (_HIGHEST_BUMP if bumps else 0)
    for body in bodies:
        first = np.maximum(np.floor((body.bounds[0] - reach - low) / pitch), 0).astype(int)
        last = np.ceil((body.bounds[1] + reach - low) / pitch).astype(int) + 1
        near = tuple(slice(*ends) for ends in zip(first, last, strict=True))
        distance = body.distance(points[near].reshape(-1, 3)).reshape(grid[near].shape)
        grid[near] = _joined(grid[near], distance, blend)
    points = points.reshape(-1, 3)
    field = grid.ravel() if bumps is None else grid.ravel() + bumps(points)
    for cut in cuts:
        field = np.maximum(field, -cut.distance(points))
    grid = field.reshape(counts)
    pieces, _ = label(grid < 0)
    largest = np.bincount(pieces.ravel())[1:].argmax() + 1
    grid = np.where(pieces == largest, grid, np.maximum(grid, np.float32(1e-3 * pitch)))
    vertices, faces, _, _ = marching_cubes(  # type: ignore[no-untyped-call]
        grid, 0.0, spacing=(pitch,) * 3)
    mesh = trimesh.Trimesh(vertices.astype(np.float64) + low, faces, process=False)
    centers = np.asarray(mesh.triangles_center, np.float32)
    distances = np.stack([body.distance(centers) for body in bodies])
    nearest = distances.argmin(axis=0)
    if cuts:
        inward = np.stack([-cut.distance(centers) for cut in cuts])
        uncut = _melted(bodies, blend, bumps, centers)
        nearest = np.where(inward.max(axis=0) > uncut, len(bodies) + inward.argmax(axis=0),
                           nearest)
    colors = np.array([body.color for body in (*bodies, *cuts)], np.float64)
    return painted(mesh, colors[nearest])


def _melted(bodies: Sequence[Body], blend: float, bumps: Distance | None,
            points: Points) -> Points:
    """Return the signed distance of bodies melted together at points, (N, 3) to (N,)."""
    field = bodies[0].distance(points)
    for body in bodies[1:]:
        field = _joined(field, body.distance(points), blend)
    return field if bumps is None else field + bumps(points)


def _joined(a: Points, b: Points, blend: float) -> Points:
    nearer: Points = np.minimum(a, b)
    if blend > 0:
        both = np.maximum(blend - np.abs(a - b), 0)
        nearer = nearer - both * both / np.float32(4 * blend)
    return nearer


def waves(rng: np.random.Generator, size: float, height: float, count: int = 6) -> Distance:
    """Return soft random bumps of some height, their lengths about size."""
    directions = rng.normal(size=(count, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    numbers = (directions * 2 * np.pi / (size * rng.uniform(0.6, 1.6, (count, 1)))).astype('f4')
    phases = rng.uniform(0, 2 * np.pi, count).astype('f4')

    def bumps(points: Points) -> Points:
        field: Points = np.sin(points @ numbers.T + phases).sum(axis=1)
        return field * np.float32(height / count**0.5)

    return bumps
