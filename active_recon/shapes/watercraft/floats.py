"""Craft that float on hoses or logs: inflatables and rafts."""


from active_recon.shapes.common.parts import (
    beam,
    box,
    Color,
    loft,
    Mesh,
    mirrored,
    prism,
    rod,
    superellipse,
)
from active_recon.shapes.common.soft_parts import cushion, smoothed
from active_recon.shapes.watercraft import rig
from active_recon.shapes.watercraft.house import outboard
from active_recon.shapes.watercraft.hull import Livery
import numpy as np
from numpy.typing import ArrayLike


def _hose(path: ArrayLike, radii: ArrayLike, color: Color) -> Mesh:
    """Return a round tube swept along a path, (N, 3), with a radius at each point."""
    points = np.asarray(path, np.float64)
    along = np.gradient(points, axis=0)
    across = np.cross(along, (0, 0, 1.0))
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    circle = superellipse(2, 2, 2, 10)
    return loft([p + r * (circle[:, :1] * side + circle[:, 1:] * (0, 0, 1.0))
                 for p, side, r in zip(points, across, np.broadcast_to(radii, len(points)),
                                       strict=True)], color)


def inflatable(rng: np.random.Generator, livery: Livery) -> list[Mesh]:
    """Return an inflatable: a dinghy, an oval raft, or a rigid one with a console."""
    length = rng.uniform(2.5, 7)
    half, radius = length * rng.uniform(0.19, 0.26), length * rng.uniform(0.05, 0.075)
    side, bow, stern = half - radius, length / 2 - radius, -length / 2
    lift = rng.uniform(0.2, 1.6) * radius
    oval = rng.random() < 0.25
    z = radius * 1.3
    back = stern + 2 * side if oval else stern
    front = [(back, side, z), (0.1 * length, side, z), (bow - side * 0.5, side, z + lift * 0.4),
             (bow, side * 0.55, z + lift), (bow, 0, z + lift)]
    port = smoothed(front, 2)
    ends = np.linspace(0.6 if not oval else 1, 1, 3)
    sizes = radius * np.concatenate([ends, np.ones(len(port) - 3)])
    parts = [mirrored(_hose(port, sizes, livery.hull))]
    if oval:
        parts.append(mirrored(_hose(smoothed([(back, side, z), (stern + radius, side, z),
                                             (stern + radius, 0, z)], 2), radius, livery.hull)))
    stripe = rng.random() < 0.6
    if stripe:
        for x in np.linspace(-0.25, 0.15, int(rng.integers(1, 4))) * length:
            parts.append(mirrored(rod((x, side, z), (x + 0.06 * length, side, z), radius * 1.04,
                                      livery.accent, sections=10)))
    floor = [(stern + 0.08 * length, side), (0.15 * length, side), (bow - 0.6 * side, 0.5 * side)]
    keel = np.array([*floor, *[(x, -y) for x, y in floor[::-1]]])
    parts.append(prism(keel, z - radius * rng.uniform(0.75, 1.1), z - radius * 0.25, 'z',
                       livery.deck))
    if not oval:
        parts.append(box((stern + 0.08 * length, -side, z - radius),
                         (stern + 0.12 * length, side, z + radius), livery.trim))
        if rng.random() < 0.75:
            parts.append(outboard(stern + 0.08 * length, 0, z + radius, length * 0.11,
                                  livery.trim))
    if not oval and rng.random() < 0.5:
        x, wide = rng.uniform(-0.1, 0.08) * length, side * 0.45
        top = z + length * rng.uniform(0.1, 0.16)
        parts.append(cushion((x, -wide, z - radius * 0.5), (x + 0.09 * length, wide, top),
                             livery.house))
        parts.append(box((x + 0.06 * length, -wide, top - 0.02 * length),
                         (x + 0.085 * length, wide, top + 0.06 * length), livery.glass))
        parts.append(cushion((x - 0.22 * length, -wide, z - radius * 0.5),
                             (x - 0.09 * length, wide, z + radius * 1.3), livery.accent))
    else:
        for x in np.linspace(-0.18, 0.16, int(rng.integers(1, 4))) * length:
            parts.append(rod((x, -side, z), (x, side, z), radius * 0.8, livery.accent,
                             sections=10))
    return parts


def raft(rng: np.random.Generator, livery: Livery) -> list[Mesh]:
    """Return a raft of logs or planks with a sail, a hut or a paddle."""
    length = rng.uniform(2, 5)
    half, count = length * rng.uniform(0.28, 0.5), int(rng.integers(5, 10))
    radius = half / count * 1.08
    parts: list[Mesh] = []
    for y in np.linspace(-half + radius, half - radius, count):
        back, front = length / 2 * rng.uniform(0.88, 1.0, 2)
        shade = np.asarray(livery.wood) * rng.uniform(0.75, 1.15)
        parts.append(rod((-back, y, radius), (front, y, radius), radius, shade, sections=8))
    for x in np.linspace(-0.35, 0.35, int(rng.integers(2, 4))) * length:
        parts.append(beam((x, -half, radius * 2), (x, half, radius * 2), radius * 1.2, livery.wood,
                          radius * 0.9))
    deck, thick = radius * 2, length / 26
    if rng.random() < 0.65:
        height = length * rng.uniform(0.7, 1.1)
        parts.append(rig.squares(rng, livery, 0.05 * length, deck, height, half * 1.7, 1, thick,
                                 False))
    if rng.random() < 0.5:
        top = deck + length * rng.uniform(0.18, 0.26)
        hut, wide = (-0.36 * length, -0.05 * length), half * 0.7
        parts.append(box((hut[0], -wide, radius), (hut[1], wide, top), livery.house))
        parts.append(prism([(-wide * 1.2, top - 0.02 * length), (wide * 1.2, top - 0.02 * length),
                            (0, top + 0.14 * length)], hut[0] - 0.04 * length,
                           hut[1] + 0.04 * length, 'x', livery.accent))
    else:
        parts.append(beam((-0.2 * length, 0, deck), (-0.58 * length, 0, radius), thick,
                          livery.wood))
    return parts
