"""Benches: park and garden ones, planks, stone slabs, storage, piano and indoor benches."""

from collections.abc import Callable
import math

from active_recon.shapes.bench.parts import arms, back, Seat, seat, supports
from active_recon.shapes.common.materials import fabric, metal, paint, plastic, wood
from active_recon.shapes.common.parts import assemble, beam, box, Color, Mesh, mirrored, prism, rod
from active_recon.shapes.common.soft_parts import cushion, wall
import numpy as np


def bench(rng: np.random.Generator) -> Mesh:
    """Return a random bench; who sits on it looks towards +x, its back is at -x."""
    kinds: list[tuple[float, Callable[[np.random.Generator], Mesh]]] = [
        (0.42, _with_back), (0.22, _backless), (0.08, _stone), (0.08, _storage),
        (0.08, _upholstered), (0.05, _curved), (0.04, _two_sided), (0.03, _log)]
    chances, makers = zip(*kinds, strict=True)
    mesh: Mesh = makers[rng.choice(len(makers), p=chances)](rng)
    return mesh


def _measures(rng: np.random.Generator) -> Seat:
    length = rng.uniform(0.9, 2.2)
    return Seat(rng.uniform(0.36, 0.55), length, rng.uniform(0.38, 0.5),
                max(length, 1.0) * rng.uniform(0.028, 0.05))


def _coats(rng: np.random.Generator) -> tuple[Color, Color]:
    """Return the colours of what is sat on and of what carries it."""
    first = [wood, wood, wood, paint, plastic, metal][rng.integers(6)](rng)
    second = first if rng.random() < 0.35 else [metal, metal, paint, wood][rng.integers(4)](rng)
    return first, second


def _with_back(rng: np.random.Generator) -> Mesh:
    """Return a park, garden or church bench."""
    place, (color, frame) = _measures(rng), _coats(rng)
    parts = [seat(rng, place, color), supports(rng, place, frame), back(rng, place, color, frame)]
    if rng.random() < 0.6:
        parts.append(arms(rng, place, frame))
    return assemble(parts)


def _backless(rng: np.random.Generator) -> Mesh:
    """Return a seat on its supports, now and then with arms."""
    place, (color, frame) = _measures(rng), _coats(rng)
    parts = [seat(rng, place, color), supports(rng, place, frame)]
    if rng.random() < 0.12:
        parts.append(arms(rng, place, frame))
    return assemble(parts)


def _stone(rng: np.random.Generator) -> Mesh:
    """Return a slab on blocks, or one solid block."""
    place = _measures(rng)
    grey = np.full(3, rng.uniform(90, 220)) * rng.uniform(0.95, 1.05, 3)
    x, y, z = place.depth / 2, place.length / 2, place.height
    thick = rng.uniform(0.07, 0.14)
    slab = box([-x, -y, z - thick], [x, y, z], grey)
    if rng.random() < 0.25:
        return assemble([slab, box([-x * 0.8, -y * 0.9, 0], [x * 0.8, y * 0.9, z - thick / 2],
                                   grey * 0.9)])
    inset, wide = y * rng.uniform(0.6, 0.9), rng.uniform(0.1, 0.25)
    block = box([-x * 0.85, inset - wide, 0], [x * 0.85, inset, z - thick / 2], grey * 0.9)
    parts = [slab, mirrored(block)]
    if rng.random() < 0.25:
        parts.append(box([-x, -y, z - 0.02], [-x + 0.1, y, z + rng.uniform(0.25, 0.45)], grey))
    return assemble(parts)


def _storage(rng: np.random.Generator) -> Mesh:
    """Return a chest that is sat on, with a back and arms or without."""
    place, (color, other) = _measures(rng), _coats(rng)
    x, y, z = place.depth / 2, place.length / 2, place.height
    chest = box([-x, -y, 0], [x, y, z - 0.03], color)
    lid = box([-x, -y * 1.01, z - 0.04], [x + 0.02, y * 1.01, z], other)
    parts = [chest, lid]
    edges = np.linspace(-y, y, int(rng.integers(1, 5)) + 1)
    parts += [box([x - 0.02, a + 0.05, 0.1], [x + 0.012, b - 0.05, z - 0.1], other)
              for a, b in zip(edges[:-1], edges[1:], strict=True)]
    if rng.random() < 0.2:
        parts += [mirrored(box([side * x * 0.9 - 0.04, y * 0.9 - 0.04, -0.08],
                               [side * x * 0.9 + 0.04, y * 0.9 + 0.04, 0.06], other))
                  for side in (-1, 1)]
    if rng.random() < 0.55:
        parts.append(back(rng, place, color, other))
    if rng.random() < 0.4:
        rise = rng.uniform(0.15, 0.28)
        parts.append(mirrored(box([-x, y - 0.05, z - 0.05], [x, y, z + rise], color)))
    return assemble(parts)


def _upholstered(rng: np.random.Generator) -> Mesh:
    """Return a padded bench: at a bed's end, a piano, or in a hall."""
    place, (_, frame) = _measures(rng), _coats(rng)
    cloth = fabric(rng)
    x, y, z = place.depth / 2, place.length / 2, place.height
    pad = cushion([-x, -y, z - rng.uniform(0.1, 0.18)], [x, y, z], cloth, 0.04,
                  rng.uniform(0, 0.04))
    board = box([-x * 0.96, -y * 0.97, z - 0.22], [x * 0.96, y * 0.97, z - 0.08], frame)
    parts = [pad, board, supports(rng, place._replace(height=z - 0.1), frame)]
    if rng.random() < 0.4:  # rolled ends
        rise = rng.uniform(0.12, 0.3)
        parts.append(mirrored(box([-x, y - 0.07, z - 0.2], [x, y + 0.02, z + rise], cloth)))
        parts.append(mirrored(rod([-x, y, z + rise], [x, y, z + rise], 0.06, cloth)))
    elif rng.random() < 0.3:
        parts.append(box([-x, -y, z - 0.15], [-x + 0.1, y, z + rng.uniform(0.3, 0.5)], cloth))
    return assemble(parts)


def _curved(rng: np.random.Generator) -> Mesh:
    """Return a bench along an arc, its ends coming forward, on posts."""
    color, frame = _coats(rng)
    radius, half = rng.uniform(0.9, 2.0), rng.uniform(0.4, 0.9)
    angles = np.linspace(-half, half, 13)
    path = np.column_stack([radius - radius * np.cos(angles), radius * np.sin(angles)])
    deep, z = rng.uniform(0.35, 0.5), rng.uniform(0.4, 0.5)
    parts = [wall(path, z - 0.06, z, deep, color)]
    posts = path[[1, 4, 8, 11]] if rng.random() < 0.5 else path[[1, 6, 11]]
    thick = rng.uniform(0.05, 0.14)
    parts += [box([px - thick, py - thick, 0], [px + thick, py + thick, z - 0.04], frame)
              for px, py in posts]
    if rng.random() < 0.45:
        outer = path + (path - [radius, 0]) / radius * deep * 0.42
        parts += [wall(outer, z + 0.2, z + 0.42, 0.06, color),
                  *(beam([px, py, z - 0.04], [px, py, z + 0.3], 0.06, frame)
                    for px, py in outer[[1, 6, 11]])]
    return assemble(parts)


def _two_sided(rng: np.random.Generator) -> Mesh:
    """Return seats on both sides of one back."""
    place, (color, frame) = _measures(rng), _coats(rng)
    one = seat(rng, place, color)
    one.apply_translation([place.depth / 2, 0, 0])
    other = one.copy()
    other.apply_transform(np.diag([-1.0, 1.0, 1.0, 1.0]))
    z, y = place.height, place.length / 2
    rise = rng.uniform(0.3, 0.5)
    middle = box([-0.04, -y, z - 0.04], [0.04, y, z + rise], color)
    ends = mirrored(box([-place.depth * 0.9, y * 0.85 - 0.04, 0],
                        [place.depth * 0.9, y * 0.85 + 0.04, z - place.thick / 2], frame))
    return assemble([one, other, middle, ends])


def _log(rng: np.random.Generator) -> Mesh:
    """Return half a trunk, flat side up, on two short logs."""
    length, radius = rng.uniform(1.0, 1.8), rng.uniform(0.18, 0.26)
    angles = np.linspace(math.pi, 2 * math.pi, 11)
    color, z = wood(rng), rng.uniform(0.36, 0.46)
    flat = np.column_stack([radius * np.cos(angles), z + radius * 0.75 * np.sin(angles)])
    trunk = prism(flat, -length / 2, length / 2, 'y', color)
    stump = rod([-radius * 1.1, length * 0.3, radius * 0.6],
                [radius * 1.1, length * 0.3, radius * 0.6], radius * 0.62, wood(rng))
    foot = box([-radius * 0.8, length * 0.3 - 0.1, 0],
               [radius * 0.8, length * 0.3 + 0.1, z - radius * 0.3], color)
    return assemble([trunk, mirrored(stump), mirrored(foot)])
