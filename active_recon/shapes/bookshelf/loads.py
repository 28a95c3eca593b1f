"""What stands on shelves: rows and piles of books, boxes, vases."""

from typing import NamedTuple

from active_recon.shapes.cabinet.bays import Bay
from active_recon.shapes.common.drawing import choose
from active_recon.shapes.common.materials import fabric, paint, plastic, wood
from active_recon.shapes.common.parts import box, Color, lathe, Mesh
import numpy as np
from numpy.typing import ArrayLike, NDArray
import trimesh

_CUBE = trimesh.creation.box(bounds=[[0, 0, 0], [1, 1, 1]])


class Load(NamedTuple):
    """How a bookshelf is filled: each bay draws one of its kinds."""

    kinds: tuple[str, ...]  # of books, pile, crate, vase, empty
    palette: NDArray[np.float64]  # colours of the spines, (N, 3)
    share: tuple[float, float]  # range of how much of a shelf its books fill


def draw_load(rng: np.random.Generator) -> Load:
    """Return an empty bookshelf more often than not, else sparse, mixed or crammed ones."""
    kinds: dict[tuple[str, ...], float] = {
        ('empty',): 0.52, ('books', 'books', 'empty', 'pile', 'vase'): 0.16,
        ('books', 'books', 'pile'): 0.08, ('books',): 0.12, ('crate', 'crate', 'empty'): 0.05,
        ('vase', 'empty', 'empty', 'pile'): 0.07}
    kind = choose(rng, kinds)
    draw = [fabric, paint][rng.integers(2)]
    palette = np.array([draw(rng) for _ in range(int(rng.integers(1, 7)))])
    low = rng.uniform(0.25, 0.9)
    return Load(kind, palette, (low, min(1.0, low + 0.35)))


def blocks(lows: ArrayLike, highs: ArrayLike, colors: ArrayLike) -> Mesh:
    """Return many axis-aligned boxes, corners and colours (N, 3) each, as one mesh."""
    low, high = (np.asarray(corners, np.float64)[:, None] for corners in (lows, highs))
    count = len(low)
    vertices = (low + np.asarray(_CUBE.vertices) * (high - low)).reshape(-1, 3)
    faces = (_CUBE.faces + 8 * np.arange(count)[:, None, None]).reshape(-1, 3)
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    rgba = np.column_stack([np.clip(colors, 0, 255), np.full(count, 255)]).round()
    mesh.visual = trimesh.visual.ColorVisuals(
        mesh, face_colors=np.repeat(rgba.astype(np.uint8), len(_CUBE.faces), axis=0))
    return mesh


def fill(rng: np.random.Generator, load: Load, bay: Bay, rear: float, front: float,
         board: float) -> list[Mesh]:
    """Return what stands in a bay between x = rear and x = front, sunk a little into boards."""
    kind = rng.choice(load.kinds)
    half = 0.4 * board
    left, right = bay.left + half, bay.right - half
    floor, room = bay.low + half, bay.height - 2 * half
    deep = front - rear
    if kind == 'books':
        return [_row(rng, load, (left, right), (floor, room), (rear, deep))]
    if kind == 'pile':
        return [_pile(rng, load, (left, right), (floor, room), (rear, deep))]
    if kind == 'crate':
        color = [wood, plastic, fabric][rng.integers(3)](rng)
        slack, high = (right - left) * rng.uniform(0.03, 0.15), room * rng.uniform(0.5, 0.9)
        return [box([rear, left + slack, floor], [front - 0.06 * deep, right - slack,
                                                  floor + high], color)]
    if kind == 'vase':
        radius = min(0.3 * deep, 0.3 * (right - left), 0.4 * room)
        tall = min(room * rng.uniform(0.5, 0.9), radius * rng.uniform(2, 5))
        profile = np.array([[rng.uniform(0.5, 0.9), 0], [rng.uniform(0.6, 1), 0.3],
                            [rng.uniform(0.5, 1), 0.65], [rng.uniform(0.25, 0.8), 1]])
        spot = [rear + deep / 2, rng.uniform(left + radius, right - radius), floor]
        return [lathe(profile * [radius, tall], _any(rng, load), spot, 12)]
    return []


def _any(rng: np.random.Generator, load: Load) -> Color:
    color: NDArray[np.float64] = load.palette[rng.integers(len(load.palette))]
    return color


def _row(rng: np.random.Generator, load: Load, across: tuple[float, float],
         upright: tuple[float, float], inwards: tuple[float, float]) -> Mesh:
    """Return books upright, from one end of the shelf or in two groups."""
    (left, right), (floor, room), (rear, deep) = across, upright, inwards
    width = (right - left) * rng.uniform(*load.share)
    thick = max(rng.uniform(0.03, 0.05), width / 16)
    edges = np.append(0, np.cumsum(thick * rng.uniform(0.6, 1.5, max(1, int(width / thick)))))
    edges = edges * width / edges[-1]
    count = len(edges) - 1
    starts = edges[:-1] + left
    if rng.random() < 0.4:  # a gap in the middle, or all at the right
        starts = starts + (right - left - width) * (np.arange(count) >= rng.integers(count))
    tall = room * np.clip(rng.uniform(0.55, 0.85) + rng.uniform(-0.12, 0.12, count), 0.3, 0.95)
    out = rear + deep * np.clip(rng.uniform(0.55, 0.9) + rng.uniform(-0.08, 0.05, count), 0, 1)
    lows = np.column_stack([np.full(count, rear), starts, np.full(count, floor)])
    highs = np.column_stack([out, starts + 1.02 * np.diff(edges), floor + tall])
    colors = load.palette[rng.integers(len(load.palette), size=count)]
    return blocks(lows, highs, colors * rng.uniform(0.8, 1.1, (count, 1)))


def _pile(rng: np.random.Generator, load: Load, across: tuple[float, float],
          upright: tuple[float, float], inwards: tuple[float, float]) -> Mesh:
    """Return books that lie on each other."""
    (left, right), (floor, room), (rear, deep) = across, upright, inwards
    long = min(0.9 * (right - left), rng.uniform(0.2, 0.3))
    count = int(rng.integers(2, 6))
    high = min(0.8 * room, count * rng.uniform(0.03, 0.06))
    middle = rng.uniform(left + long / 2, right - long / 2)
    half = long / 2 * rng.uniform(0.75, 1, count)
    levels = np.linspace(floor, floor + high, count + 1)
    lows = np.column_stack([np.full(count, rear), middle - half, levels[:-1]])
    highs = np.column_stack([rear + deep * rng.uniform(0.6, 0.9, count), middle + half,
                             levels[1:]])
    return blocks(lows, highs, load.palette[rng.integers(len(load.palette), size=count)])
