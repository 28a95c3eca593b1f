"""Merchant ships: container ships, bulk carriers, freighters and tankers."""

from active_recon.shapes.common import materials
from active_recon.shapes.common.parts import beam, box, ellipsoid, Mesh, mirrored, rod
from active_recon.shapes.common.skin import painted_loft
from active_recon.shapes.watercraft.house import crane, funnel, house, lifeboats, mast, tier
from active_recon.shapes.watercraft.hull import Hull, Livery
import numpy as np

LIFEBOAT = (235, 110, 35)


def _freighter(rng: np.random.Generator, length: float, beam_share: tuple[float, float],
               depth: tuple[float, float]) -> Hull:
    return Hull(
        length, length * rng.uniform(*beam_share), length * rng.uniform(*depth), 'box',
        parallel=rng.uniform(0.68, 0.82), entry=(rng.uniform(1.5, 2.2), rng.uniform(2.2, 3.2)),
        run=rng.uniform(0.2, 0.3), stern=rng.uniform(0.6, 0.9), tuck=rng.uniform(0.1, 0.4),
        rake=rng.uniform(0.02, 0.08), stem=rng.uniform(0.8, 1.6), counter=rng.uniform(0.02, 0.06),
        sheer=(rng.uniform(0, 0.3), rng.uniform(0, 0.1)), rocker=(0, rng.uniform(0, 0.3)))


def _bridge(rng: np.random.Generator, hull: Hull, livery: Livery, x: tuple[float, float],
            height: float) -> list[Mesh]:
    """Return the accommodation block with its wings, funnel, mast and boats."""
    length, half = hull.length, hull.half_deck(sum(x) / 2) * rng.uniform(0.72, 0.95)
    low, top = hull.depth * 0.9, hull.depth + height
    each = height / max(2, round(height / (0.03 * length)))
    block = top - each
    rows = int(np.clip(round((block - low) / each), 1, 5))
    parts = [house(livery, x, (half, half), (low, block), rows, int(rng.integers(2, 4)), (0, 0),
                   0.0, 0.0)]
    wing = hull.beam / 2 * rng.uniform(0.85, 1.02)
    deep = (x[1] - x[0]) * rng.uniform(0.4, 0.7)
    if rng.random() < 0.7:
        parts.append(box((x[1] - deep, -wing, block - each * 0.25), (x[1], wing, block + each
                         * 0.25), livery.house))
    parts.append(house(livery, (x[1] - deep, x[1]), (half * 0.9,) * 2,
                       (block - each * 0.1, top), 1, 2, (0, 0), 0, 0.05))
    size = (length * rng.uniform(0.03, 0.05), length * rng.uniform(0.03, 0.045))
    parts.append(funnel(x[0] - size[0] * rng.uniform(-0.6, 0.5), low, (top - low) * rng.uniform(
        0.85, 1.1), size, livery.accent, livery.trim, rng.uniform(0, 0.06)))
    parts.append(mast(rng, x[1] - deep * 0.5, top - each * 0.1, length * rng.uniform(0.05, 0.1),
                      livery, length / 55))
    if rng.random() < 0.6:
        parts.append(lifeboats([sum(x) / 2], half, hull.depth + height * 0.35, length * 0.05,
                               LIFEBOAT))
    return parts


def cargo_ship(rng: np.random.Generator, livery: Livery) -> list[Mesh]:
    """Return a container ship, a bulk carrier or an old freighter with derricks."""
    kind = rng.choice(['container', 'bulk', 'freighter'], p=[0.55, 0.23, 0.22])
    length = rng.uniform(80, 300)
    hull = _freighter(rng, length, (0.12, 0.19), (0.075, 0.12))
    parts = [hull.skin(livery, None, rng.uniform(0.2, 0.55), rng.uniform(0.85, 0.98))]
    if rng.random() < 0.6:
        parts.append(hull.bulb(livery))
    middle = -0.36 if rng.random() < 0.7 else rng.uniform(-0.3, 0.05)
    x = ((middle - 0.045) * length, (middle + 0.045) * length)
    height = length * rng.uniform(0.1, 0.17)
    parts += _bridge(rng, hull, livery, x, height)
    parts.append(tier(hull, livery, (0.88, 0.98), 0.8, hull.depth * rng.uniform(0.1, 0.3),
                      livery.hull))
    holds = [(x[1] + 0.02 * length, 0.36 * length)]
    if middle > -0.3:
        holds.append((-0.46 * length, x[0] - 0.05 * length))
    for rear, front in holds:
        count = max(1, round((front - rear) / length * rng.uniform(10, 16)))
        if kind == 'container':
            parts += _containers(rng, hull, (rear, front), count, height)
            continue
        edges = np.linspace(rear, front, max(1, count // 2) + 1)
        hatch = hull.depth * (1 + rng.uniform(0.12, 0.25))
        for a, b in zip(edges[:-1], edges[1:], strict=True):
            gap, half = 0.1 * (b - a), hull.half_deck(b) * 0.65
            parts.append(box((a + gap, -half, hull.depth * 0.8), (b - gap, half, hatch),
                             livery.trim))
        color, thick = livery.accent, length / 60
        for at in edges[1:-1] if kind == 'freighter' or rng.random() < 0.5 else []:
            if kind == 'bulk':
                parts.append(crane(at, hull.depth * 0.9, 0.09 * length, 0.09 * length, thick * 0.8,
                                   color))
                continue
            post, top = hull.half_deck(at) * 0.45, hull.depth + 0.15 * length
            parts.append(mirrored(rod((at, post, hull.depth * 0.9), (at, post, top), thick * 0.6,
                                      color, sections=8)))
            parts.append(box((at - thick * 0.5, -post, top - thick), (at + thick * 0.5, post, top),
                             color))
            for way in (-1, 1):
                parts.append(beam((at, 0, hull.depth * 1.05), (at + way * 0.07 * length, 0,
                                  top * 0.9), thick * 0.7, color))
                parts.append(beam((at + way * 0.07 * length, 0, top * 0.9 - thick * 0.3),
                                  (at, 0, top - thick * 0.5), thick * 0.5, color))
    return parts


def _containers(rng: np.random.Generator, hull: Hull, x: tuple[float, float], count: int,
                height: float) -> list[Mesh]:
    """Return bays of stacked boxes in a line's few colours, none higher than the bridge."""
    palette = [materials.paint(rng) for _ in range(int(rng.integers(2, 6)))]
    edges = np.linspace(*x, count + 1)
    tall = hull.length * 0.024
    most = int(np.clip(height * 0.85 / tall, 2, 5))
    full = rng.integers(1, most + 1)
    low = min(hull.deck(edge) for edge in edges) - 0.05 * hull.depth
    parts = []
    for a, b in zip(edges[:-1], edges[1:], strict=True):
        half = min(hull.half_deck(a), hull.half_deck(b)) * 0.95
        across = np.linspace(-half, half, int(np.clip(round(half / hull.length * 50), 2, 5)) + 1)
        tiers = int(np.clip(full + rng.integers(-1, 2), 1, most))
        for left, right in zip(across[:-1], across[1:], strict=True):
            here = max(1, tiers - (rng.random() < 0.15))
            rear, front = a + 0.06 * (b - a), b - 0.06 * (b - a)
            corners = [(rear, left), (front, left), (front, right), (rear, right)]
            loops = [[(*corner, low + level * tall) for corner in corners]
                     for level in range(here + 1)]
            stack = np.array(palette)[rng.integers(len(palette), size=here)]
            parts.append(painted_loft(loops, np.repeat(stack[:, None], 4, axis=1),
                                      (stack[0], stack[-1])))
    return parts


def tanker(rng: np.random.Generator, livery: Livery) -> list[Mesh]:
    """Return an oil tanker with its pipes, or a gas carrier with domes or a trunk."""
    length = rng.uniform(100, 330)
    hull = _freighter(rng, length, (0.14, 0.2), (0.08, 0.12))
    parts = [hull.skin(livery, None, rng.uniform(0.3, 0.6), rng.uniform(0.88, 0.98)),
             hull.bulb(livery)]
    parts += _bridge(rng, hull, livery, (-0.43 * length, -0.34 * length),
                     length * rng.uniform(0.09, 0.14))
    deck, y, radius = hull.depth, hull.beam * 0.1, length / 110
    kind = rng.choice(['oil', 'domes', 'trunk'], p=[0.6, 0.25, 0.15])
    if kind == 'domes':
        count = int(rng.integers(3, 6))
        size = min(0.34 * length / count, hull.beam * 0.46)
        for x in np.linspace(-0.33 * length + size * 1.1, 0.38 * length - size, count):
            parts.append(ellipsoid((x, 0, deck), (size, size, size * rng.uniform(0.8, 0.85)),
                                   livery.accent))
        return parts
    if kind == 'trunk':
        parts.append(box((-0.3 * length, -hull.beam * 0.36, deck * 0.8),
                         (0.36 * length, hull.beam * 0.36, deck + 0.04 * length), livery.accent))
        deck += 0.035 * length
    pipes = mirrored(rod((-0.35 * length, y, deck + radius), (0.38 * length, y, deck + radius),
                         radius * 1.4, livery.trim, sections=8))
    parts += [pipes, box((-0.34 * length, -radius, deck - radius), (0.4 * length, radius,
                         deck + radius * 3), livery.accent)]
    for x in (-0.02, 0.03):
        parts.append(beam((x * length, -hull.beam * 0.42, deck + radius), (x * length, hull.beam
                          * 0.42, deck + radius), radius * 2, livery.trim))
    parts.append(mirrored(crane(0.005 * length, deck * 0.95, 0.05 * length, 0.06 * length,
                                radius * 0.9, livery.house)))
    parts.append(rod((0.42 * length, 0, deck * 0.9), (0.42 * length, 0, deck + 0.07 * length),
                     length / 100, livery.house, sections=8))
    return parts
