"""Small ships that work: tugs, fishing boats, patrol boats and lifeboats."""

from active_recon.shapes.common.parts import beam, box, ellipsoid, Mesh, mirrored, rod
from active_recon.shapes.watercraft.house import crane, funnel, house, mast, on_deck, tier
from active_recon.shapes.watercraft.hull import Hull, Livery, Well
import numpy as np


def _workboat(rng: np.random.Generator, length: float, slim: tuple[float, float]) -> Hull:
    return Hull(
        length, length * rng.uniform(*slim), length * rng.uniform(0.14, 0.22),
        parallel=rng.uniform(0.45, 0.6), entry=(1.4, rng.uniform(2.0, 3.0)), run=0.35,
        stern=rng.uniform(0.6, 0.9), tuck=rng.uniform(0.2, 0.6), rake=rng.uniform(0.03, 0.14),
        stem=rng.uniform(0.8, 1.6), counter=rng.uniform(0, 0.08),
        sheer=(rng.uniform(0.25, 0.8), rng.uniform(0, 0.25)), rocker=(0.1, rng.uniform(0, 0.2)))


def tug(rng: np.random.Generator, livery: Livery) -> list[Mesh]:
    """Return a tug: short and deep, its house forward of the middle, its sides fendered."""
    length = rng.uniform(16, 34)
    hull = _workboat(rng, length, (0.3, 0.4))
    parts = [hull.skin(livery, Well(0.03, 0.95, rng.uniform(0.68, 0.8), length * 0.022),
                       rng.uniform(0.2, 0.5), rng.uniform(0.8, 0.92))]
    x = (rng.uniform(-0.26, -0.05) * length, rng.uniform(0.16, 0.28) * length)
    first, roof = on_deck(hull, livery, x, length * rng.uniform(0.06, 0.1),
                          rng.uniform(0.6, 0.75), 1, int(rng.integers(2, 5)), (0, 0), 0.3, 0.36)
    parts.append(first)
    wide = hull.beam * rng.uniform(0.2, 0.3)
    bridge = (x[1] - length * rng.uniform(0.18, 0.26), x[1] - length * rng.uniform(0.01, 0.05))
    for _ in range(int(rng.integers(1, 3))):
        high = roof + length * rng.uniform(0.09, 0.12)
        parts.append(house(livery, bridge, (wide, wide * 0.85), (roof - 0.02 * length, high), 1, 2,
                           (0, rng.uniform(-0.02, 0.02) * length), 0.02, 0.3))
        roof = high
    parts.append(box((bridge[0] - 0.01 * length, -wide * 1.1, roof - 0.012 * length),
                     (bridge[1] + 0.02 * length, wide * 1.1, roof + 0.012 * length), livery.roof))
    parts.append(mast(rng, sum(bridge) / 2, roof, length * rng.uniform(0.15, 0.3), livery,
                      length / 38))
    foot, size = bridge[0] - 0.06 * length, length * rng.uniform(0.08, 0.13)
    low, tall = hull.deck(foot) - 0.2 * hull.depth, length * rng.uniform(0.24, 0.34)
    if rng.random() < 0.4:
        stack = funnel(foot, low, tall, (size * 0.8, size * 0.6), livery.accent, livery.trim, 0.05)
        stack.apply_translation((0, wide * 0.85, 0))
        parts.append(mirrored(stack))
    else:
        parts.append(funnel(foot, low, tall, (size * 1.2, size), livery.accent, livery.trim,
                            rng.uniform(0, 0.15)))
    if rng.random() < 0.75:
        radius = length * rng.uniform(0.025, 0.04)
        for place in np.linspace(-0.36, 0.2, int(rng.integers(3, 7))) * length:
            y, z = hull.half_deck(place), hull.deck(place) - radius * 1.4
            parts.append(mirrored(rod((place, y - radius * 0.4, z), (place, y + radius * 0.6, z),
                                      radius, (28, 28, 30), sections=10)))
        stem = hull.deck(length / 2)
        parts.append(ellipsoid((0.485 * length, 0, stem - 0.06 * length),
                               (0.03 * length, 0.07 * length, 0.05 * length), (28, 28, 30), 1))
    parts.append(box((-0.36 * length, -wide * 0.3, hull.depth * 0.5),
                     (-0.29 * length, wide * 0.3, hull.depth * 1.15), livery.trim))
    return parts


def fishing_boat(rng: np.random.Generator, livery: Livery) -> list[Mesh]:
    """Return a trawler with its wheelhouse fore or aft, masts, booms and a gantry."""
    length = rng.uniform(8, 35)
    hull = _workboat(rng, length, (0.24, 0.36))
    parts = [hull.skin(livery, Well(0.03, 0.95, rng.uniform(0.62, 0.82), length * 0.02),
                       rng.uniform(0.2, 0.5), rng.uniform(0.78, 0.92))]
    aft = rng.random() < 0.45
    middle = rng.uniform(-0.3, -0.2) if aft else rng.uniform(0.02, 0.16)
    span = rng.uniform(0.2, 0.34)
    x = ((middle - span / 2) * length, (middle + span / 2) * length)
    thick, low = length / 38, hull.depth * 0.6
    if not aft and rng.random() < 0.6:
        parts.append(tier(hull, livery, (0.72, 0.97), 0.6, hull.depth * 0.3, livery.stripe))
    wide = hull.beam * rng.uniform(0.28, 0.38)
    roof = hull.depth + length * rng.uniform(0.1, 0.15)
    parts.append(house(livery, x, (wide, wide * 0.9), (low, roof), 1, int(rng.integers(1, 4)),
                       (0, rng.uniform(-0.02, 0.04) * length), 0.03, 0.2))
    if rng.random() < 0.5:
        high = roof + length * rng.uniform(0.07, 0.1)
        bridge = (x[0] + (0.1 if aft else 0.3) * span * length, x[1] - 0.02 * length)
        parts.append(house(livery, bridge, (wide * 0.8, wide * 0.75),
                           (roof - 0.01 * length, high), 1, 2, (0, -0.01 * length), 0.02, 0.2))
        roof = high
    parts.append(box((x[0] - 0.02 * length, -wide * 0.95, roof - 0.012 * length),
                     (x[1] + 0.01 * length, wide * 0.95, roof + 0.012 * length), livery.roof))
    parts.append(mast(rng, sum(x) / 2, roof, length * rng.uniform(0.14, 0.28), livery, thick))
    hold = 0.22 if aft else -0.22
    if rng.random() < 0.7:  # a mast with its boom over the hold
        foot, tall = (x[1] + 0.05 * length if aft else x[0] - 0.04 * length), length * rng.uniform(
            0.35, 0.55)
        parts.append(rod((foot, 0, low), (foot, 0, low + tall), thick / 2, livery.trim,
                         sections=8))
        end = np.array([hold * length * rng.uniform(1, 1.6), 0, low + tall * rng.uniform(0.6, 1)])
        parts.append(rod((foot, 0, low + tall * 0.3), end, thick * 0.42, livery.trim, sections=8))
    if rng.random() < 0.5:  # a gantry over the stern
        back, y = -0.42 * length, hull.half_deck(-0.42 * length) * 0.8
        top = hull.depth + length * rng.uniform(0.15, 0.28)
        parts.append(mirrored(beam((back, y, low), (back, y * 0.8, top), thick, livery.accent)))
        parts.append(beam((back, -y * 0.85, top), (back, y * 0.85, top), thick * 1.2,
                          livery.accent))
        drum = back + 0.1 * length
        parts.append(rod((drum, -y * 0.6, hull.depth), (drum, y * 0.6, hull.depth),
                         hull.depth * 0.3, livery.wood, sections=10))
        parts.append(box((drum - 0.02 * length, -y * 0.5, low * 0.9),
                         (drum + 0.02 * length, y * 0.5, hull.depth), livery.trim))
    parts.append(box(((hold - 0.06) * length, -wide * 0.5, low * 0.9), ((hold + 0.06) * length,
                     wide * 0.5, hull.depth * rng.uniform(0.9, 1.1)), livery.accent))
    if rng.random() < 0.2:  # outriggers, raised
        foot, reach = sum(x) / 2, hull.beam * rng.uniform(0.6, 1.2)
        parts.append(mirrored(rod((foot, wide * 0.7, low),
                                  (foot, reach, hull.depth + 0.4 * length), thick * 0.42,
                                  livery.trim, sections=6)))
    parts.append(hull.rudder(livery.trim))
    return parts


def patrol_boat(rng: np.random.Generator, livery: Livery) -> list[Mesh]:
    """Return a coastguard's cutter, a pilot boat or an enclosed lifeboat."""
    length = rng.uniform(10, 40)
    hull = _workboat(rng, length, (0.2, 0.32))
    parts = [hull.skin(livery, Well(0.02, 0.95, 0.88, length * 0.016), rng.uniform(0.1, 0.4),
                       0.85)]
    x = (rng.uniform(-0.3, -0.15) * length, rng.uniform(0.12, 0.24) * length)
    if rng.random() < 0.25:
        parts.append(ellipsoid((0, 0, hull.depth * 0.9), (0.4 * length, hull.beam * 0.42,
                               hull.depth * 0.7), livery.accent))
        x = (-0.25 * length, -0.08 * length)
    first, roof = on_deck(hull, livery, x, length * rng.uniform(0.07, 0.1), 0.75, 1,
                          int(rng.integers(2, 5)), (0, 0.03 * length), 0.2)
    parts.append(first)
    half = hull.beam * 0.26
    high = roof + length * rng.uniform(0.05, 0.08)
    bridge = (x[0] + 0.3 * (x[1] - x[0]), x[1] - 0.05 * length)
    parts.append(house(livery, bridge, (half, half * 0.9), (roof - 0.01 * length, high), 1, 2,
                       (0, 0.02 * length), 0.1, 0.2))
    parts.append(mast(rng, sum(bridge) / 2, high, length * rng.uniform(0.12, 0.22), livery,
                      length / 38))
    if rng.random() < 0.5:
        gun = (x[1] + 0.5 * length) / 2
        low = hull.deck(gun) - 0.15 * hull.depth
        parts.append(rod((gun, 0, low), (gun, 0, low + 0.06 * length), 0.025 * length,
                         livery.trim))
        parts.append(rod((gun, 0, low + 0.05 * length),
                         (gun + 0.1 * length, 0, low + 0.065 * length), length / 90, livery.trim,
                         sections=8))
    if rng.random() < 0.5:
        parts.append(crane(x[0] - 0.08 * length, hull.depth * 0.8, length * 0.08, -0.1 * length,
                           length / 70, livery.accent))
    return parts
