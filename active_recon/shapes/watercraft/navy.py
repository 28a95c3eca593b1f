"""Warships: destroyers, battleships, aircraft carriers and landing craft."""


from active_recon.shapes.common.parts import (
    assemble,
    box,
    Color,
    lathe,
    loft,
    Mesh,
    mirrored,
    prism,
    rod,
)
from active_recon.shapes.watercraft.house import funnel, house, mast, tier
from active_recon.shapes.watercraft.hull import Hull, Livery, Well
import numpy as np


def _warship_hull(rng: np.random.Generator, length: float, slim: tuple[float, float]) -> Hull:
    return Hull(
        length, length * rng.uniform(*slim), length * rng.uniform(0.065, 0.095),
        parallel=rng.uniform(0.4, 0.55), entry=(1.2, rng.uniform(1.6, 2.2)), run=0.45,
        stern=rng.uniform(0.4, 0.85), tuck=rng.uniform(0.4, 0.8), rake=rng.uniform(0.02, 0.1),
        stem=rng.uniform(0.7, 1.4), counter=rng.uniform(0, 0.04),
        sheer=(rng.uniform(0.1, 0.45), rng.uniform(0, 0.1)), rocker=(0.05, 0.25))


def turret(x: float, low: float, size: float, barrels: int, way: int, color: Color,
            smooth: bool) -> Mesh:
    """Return a gun turret on its ring; its barrels point forward at way 1, aft at -1."""
    high, half = low + size * 0.75, size * (0.45 + 0.1 * barrels)
    front, back = x + way * size * 0.8, x - way * size * 0.7
    if smooth:
        shell = lathe([(half, 0), (half, size * 0.4), (half * 0.7, size * 0.8),
                       (half * 0.2, size)], color, (x, 0, low), 12)
    else:
        shell = prism([(back, low), (front, low), (front - way * size * 0.4, high), (back, high)],
                      -half, half, 'y', color)
    parts = [rod((x, 0, low - size * 0.6), (x, 0, low + size * 0.1), half * 0.8, color,
                 sections=12), shell]
    for y in (np.arange(barrels) - (barrels - 1) / 2) * half * 0.62:
        parts.append(rod((x, y, low + size * 0.42), (x + way * size * 2.3, y, low + size * 0.6),
                         size * 0.13, color, sections=8))
    return assemble(parts)


def warship(rng: np.random.Generator, livery: Livery) -> list[Mesh]:
    """Return a frigate or destroyer with one gun, or a battleship with turrets fore and aft."""
    big = rng.random() < 0.38
    length = rng.uniform(60, 160) if not big else rng.uniform(150, 260)
    hull = _warship_hull(rng, length, (0.12, 0.15) if big else (0.1, 0.135))
    parts = [hull.skin(livery, None, rng.uniform(0.3, 0.5), rng.choice([0.9, 1.0]))]
    deck, high = hull.depth, length * rng.uniform(0.05, 0.07)
    if rng.random() < 0.4:
        step = rng.uniform(0.4, 0.6)
        parts.append(tier(hull, livery, (step, 0.99), 0.8, hull.depth * 0.25, livery.hull))
    size = length * (rng.uniform(0.035, 0.05) if big else rng.uniform(0.026, 0.036))
    fore, aft = rng.uniform(0.12, 0.2), rng.uniform(-0.22, -0.14)
    barrels = int(rng.integers(2, 4)) if big else 1
    smooth = rng.random() < 0.35 and not big
    parts.append(turret(0.32 * length, hull.deck(0.32 * length) + hull.depth * 0.15, size,
                        barrels, 1, livery.house, smooth))
    if big:
        for x, up, way in ((fore + 0.04, 1.0, 1), (aft - 0.05, 0.9, -1), (-0.34, 0.1, -1)):
            base = hull.deck(x * length) + size * up
            parts.append(rod((x * length, 0, deck * 0.8), (x * length, 0, base), size * 0.55,
                             livery.house))
            parts.append(turret(x * length, base, size, barrels, way, livery.house, False))
    elif rng.random() < 0.4:
        parts.append(turret(-0.34 * length, hull.depth * 1.05, size, 1, -1, livery.house, smooth))
    parts += _citadel(rng, hull, livery, (aft * length, fore * length), high)
    if not big:
        x = fore * length + 0.06 * length
        parts.append(box((x - 0.02 * length, -hull.beam * 0.2, deck * 0.9), (x + 0.03 * length,
                         hull.beam * 0.2, hull.deck(x) + 0.018 * length), livery.deck))
        if rng.random() < 0.6:  # a hangar and its landing deck
            end = aft * length
            parts.append(box((end - 0.08 * length, -hull.beam * 0.34, deck * 0.9),
                             (end, hull.beam * 0.34, deck + high * 0.7), livery.house))
    if rng.random() < 0.5:
        for x in np.linspace(-0.08, 0.06, int(rng.integers(1, 4))) * length:
            y = hull.beam * 0.36
            tube = rod((x - 0.02 * length, y, deck + size * 0.3),
                       (x + 0.03 * length, y, deck + size * 0.6), size * 0.3, livery.trim,
                       sections=8)
            stand = box((x - size * 0.3, y - size * 0.3, deck * 0.9),
                        (x + size * 0.3, y + size * 0.3, deck + size * 0.45), livery.trim)
            parts.append(mirrored(assemble([tube, stand])))
    parts.append(hull.rudder(livery.boot))
    return parts


def _citadel(rng: np.random.Generator, hull: Hull, livery: Livery, x: tuple[float, float],
             high: float) -> list[Mesh]:
    """Return the superstructure amidships: blocks, bridge, funnels and masts."""
    length, deck = hull.length, hull.depth
    thick, half = length / 55, hull.beam * rng.uniform(0.3, 0.42)
    flush = rng.random() < 0.3  # stealthy: sides that lean in from the hull's edge
    slope = 0.25 if flush else 0.04
    if flush:
        half = hull.beam * 0.47
    base = deck + high * rng.uniform(0.5, 0.8)
    parts = [house(livery, x, (half, half * 0.9), (deck * 0.9, base), 0, 1,
                   (0.2 * high, 0.3 * high), slope, 0.1)]
    bridge = (x[1] - length * rng.uniform(0.1, 0.14), x[1] - length * rng.uniform(0.0, 0.02))
    top = base
    for _ in range(int(rng.integers(1, 4))):
        parts.append(house(livery, bridge, (half * 0.8,) * 2, (top - 0.1 * high, top + high * 0.6),
                           1, 3, (0.1 * high, 0.15 * high), slope, 0.2))
        top += high * 0.6
        half *= 0.85
        bridge = (bridge[0] + 0.01 * length, bridge[1] - 0.015 * length)
    middle = sum(bridge) / 2
    tower = rng.random() < 0.5
    if tower:
        wide = hull.beam * 0.2
        parts.append(house(livery, (middle - 0.03 * length, middle + 0.025 * length), (wide, wide),
                           (top - 0.1 * high, top + high * 0.9), 0, 1, (0.015 * length, 0.015
                                                                        * length), 0.5, 0))
        top += high * 0.85
    parts.append(mast(rng, middle, top - 0.1 * high, high * rng.uniform(0.8, 1.6), livery, thick))
    count = int(rng.choice([1, 2, 3], p=[0.45, 0.45, 0.1]))
    room = bridge[0] - 0.03 * length
    for place in np.linspace(x[0] * 0.35, room, count) if count > 1 else [room - 0.05 * length]:
        parts.append(funnel(place, base - 0.2 * high, high * rng.uniform(0.9, 1.3),
                            (length * 0.045, hull.beam * 0.3), livery.house, livery.trim,
                            rng.uniform(0, 0.3)))
    after = x[0] + 0.06 * length
    if rng.random() < 0.6:
        parts.append(house(livery, (after - 0.04 * length, after + 0.04 * length),
                           (hull.beam * 0.22,) * 2, (base - 0.1 * high, base + 0.5 * high), 0, 1))
        parts.append(mast(rng, after, base + 0.4 * high, high * rng.uniform(0.8, 1.4), livery,
                          thick))
    return parts


def carrier(rng: np.random.Generator, livery: Livery) -> list[Mesh]:
    """Return an aircraft carrier: a flat deck over the hull, an island to starboard, planes."""
    length = rng.uniform(180, 330)
    hull = _warship_hull(rng, length, (0.12, 0.15))
    parts = [hull.skin(livery, None, 0.4, 1.0)]
    half, low, deck = hull.beam * rng.uniform(0.55, 0.8), hull.depth * 0.85, hull.depth * 1.45
    fore, narrow = rng.uniform(0.47, 0.5) * length, half * rng.uniform(0.5, 0.8)
    plan = [(-0.49 * length, -half * 0.8), (-0.3 * length, -half), (0.1 * length, -half),
            (0.25 * length, -narrow), (fore, -narrow), (fore, narrow * 0.8),
            (0.3 * length, narrow), (0.1 * length, half * 1.2), (-0.2 * length, half * 1.2),
            (-0.35 * length, half * 0.8), (-0.49 * length, half * 0.8)]
    parts.append(prism(plan, deck - 0.012 * length, deck, 'z', livery.deck))
    sides = np.array(plan) * [0.97, 0.8]
    loops = [np.insert(sides * [1, wide], 2, z, axis=1) for wide, z in (
        (0.75, low), (0.95, (low + deck) / 2), (1.1, deck - 0.006 * length))]
    parts.append(loft(loops, livery.hull))
    x, y, each = rng.uniform(-0.12, 0.08) * length, -half * 0.78, length * 0.026
    wide, span, top = half * 0.17, length * rng.uniform(0.035, 0.07), deck
    for _ in range(int(rng.integers(2, 4))):
        block = house(livery, (x - span, x + span), (wide, wide),
                      (top - 0.1 * each, top + each), 1, 4, (0, 0), 0, 0.1)
        block.apply_translation((0, y, 0))
        parts.append(block)
        top, span = top + each, span * 0.75
    tower = mast(rng, x, top - each * 0.2, each * rng.uniform(1.5, 2.5), livery, length / 70)
    tower.apply_translation((0, y, 0))
    parts.append(tower)
    small = length * 0.022
    for place in rng.uniform(-0.45, 0.4, int(rng.integers(0, 9))) * length:
        side = rng.uniform(0.1, 0.55) * narrow
        wings = [(place - small * 0.6, side - small), (place + small * 0.5, side),
                 (place - small * 0.6, side + small)]
        parts.append(box((place - small, side - small * 0.2, deck - 0.01),
                         (place + small, side + small * 0.2, deck + small * 0.6), livery.house))
        parts.append(prism(wings, deck - 0.01, deck + small * 0.5, 'z', livery.trim))
    return parts


def landing_craft(rng: np.random.Generator, livery: Livery) -> list[Mesh]:
    """Return a landing craft: an open barge with a ramp for a bow and its bridge aft."""
    length = rng.uniform(12, 40)
    hull = Hull(length, length * rng.uniform(0.24, 0.32), length * rng.uniform(0.13, 0.18), 'box',
                parallel=0.8, entry=(2, 2), blunt=0.85, run=0.2, stern=0.95, tuck=1,
                rake=rng.uniform(0.06, 0.12), counter=0.0, sheer=(0.2, 0), rocker=(0.25, 0.1))
    parts = [hull.skin(livery, Well(0.3, 0.97, 0.3, length * 0.025), 0.3, 1.0)]
    half = hull.beam * rng.uniform(0.25, 0.42)
    parts.append(house(livery, (-0.46 * length, -0.27 * length), (half, half), (hull.depth * 0.9,
                       hull.depth + 0.1 * length), 1, 2, (0, 0), 0.02, 0.1))
    parts.append(mast(rng, -0.36 * length, hull.depth + 0.1 * length, 0.16 * length, livery,
                      length / 38))
    return parts
