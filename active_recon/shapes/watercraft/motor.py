"""Pleasure craft under power: speedboats, motor yachts and hydrofoils."""

import math

from active_recon.shapes.common.parts import beam, box, ellipsoid, Mesh, mirrored, rod
from active_recon.shapes.common.soft_parts import cushion, wall
from active_recon.shapes.watercraft.house import canopy, house, on_deck, outboard
from active_recon.shapes.watercraft.hull import Hull, Livery, Well
import numpy as np


def _planing(rng: np.random.Generator, length: float, slim: tuple[float, float]) -> Hull:
    return Hull(
        length, length * rng.uniform(*slim), length * rng.uniform(0.13, 0.19),
        'vee' if rng.random() < 0.75 else 'round', parallel=rng.uniform(0.32, 0.55),
        entry=(rng.uniform(1.1, 1.5), rng.uniform(1.7, 2.6)), run=0.3,
        stern=rng.uniform(0.8, 0.96), tuck=rng.uniform(0.9, 1), rake=rng.uniform(0.1, 0.24),
        stem=rng.uniform(0.8, 1.5), counter=rng.uniform(-0.03, 0.06),
        sheer=(rng.uniform(-0.05, 0.3), rng.uniform(-0.1, 0.05)), rocker=(0.15, 0))


def speedboat(rng: np.random.Generator, livery: Livery) -> list[Mesh]:
    """Return a runabout, a centre console, a cabin cruiser or a racer."""
    kind = rng.choice(['runabout', 'console', 'cuddy', 'racer'], p=[0.42, 0.2, 0.23, 0.15])
    length = rng.uniform(4.5, 9)
    hull = _planing(rng, length, (0.2, 0.28) if kind == 'racer' else (0.3, 0.4))
    front = {'runabout': rng.uniform(0.52, 0.6), 'console': rng.uniform(0.8, 0.88),
             'cuddy': rng.uniform(0.44, 0.52), 'racer': rng.uniform(0.36, 0.42)}[kind]
    rear = 0.05 if kind != 'racer' else rng.uniform(0.12, 0.24)
    if kind == 'runabout' and rng.random() < 0.4:  # an engine's hatch behind the seats
        rear = rng.uniform(0.15, 0.22)
    floor = rng.uniform(0.4, 0.55)
    parts = [hull.skin(livery, Well(rear, front, floor, length * 0.025), rng.uniform(0, 0.4),
                       rng.uniform(0.7, 0.9))]
    nose = (front - 0.5) * length
    half, deck = hull.half_deck(nose), hull.deck(nose)
    ground = float(hull.z(front, floor))
    tall = length * rng.uniform(0.06, 0.1)
    if kind == 'console':
        x, wide = rng.uniform(-0.06, 0.06) * length, half * rng.uniform(0.25, 0.35)
        parts.append(cushion((x, -wide, ground - 0.02), (x + 0.1 * length, wide, deck + 0.05),
                             livery.house))
        parts.append(box((x + 0.06 * length, -wide, deck), (x + 0.085 * length, wide, deck + tall),
                         livery.glass))
        parts.append(cushion((x - 0.16 * length, -wide * 1.3, ground - 0.02),
                             (x - 0.06 * length, wide * 1.3, deck - 0.02), livery.accent))
        if rng.random() < 0.6:
            parts.append(canopy((x - 0.18 * length, x + 0.14 * length), half * 0.55, ground,
                                deck + length * rng.uniform(0.15, 0.2), length / 40, livery.house,
                                livery.trim))
    else:
        screen = nose - 0.01 * length
        plan = [(screen - 0.16 * length, half * 0.93), (screen, half * 0.8),
                (screen + 0.06 * length, half * 0.35)]
        path = np.array([*plan, *[(x, -y) for x, y in plan[::-1]]])
        shield = wall(path[::-1], deck - 0.02 * length, deck + tall * np.array(
            [0.3, 1, 1, 1, 1, 0.3]), length * 0.018, livery.glass, -0.3)
        parts.append(shield)
        for x in np.linspace(screen - 0.1 * length, (rear - 0.5) * length + 0.12 * length,
                             int(rng.integers(1, 4))):
            for y in (-0.45, 0.45):
                seat = half * y
                parts.append(cushion((x - 0.07 * length, seat - half * 0.33, ground - 0.03),
                                     (x + 0.03 * length, seat + half * 0.33, ground + 0.05
                                      * length), livery.accent))
                parts.append(cushion((x - 0.09 * length, seat - half * 0.33, ground - 0.03),
                                     (x - 0.05 * length, seat + half * 0.33, deck + 0.02
                                      * length), livery.accent))
    if kind == 'cuddy':
        cabin, _ = on_deck(hull, livery, (nose - 0.03 * length, nose + 0.26 * length),
                           tall * 0.75, 0.75, 1, int(rng.integers(1, 3)), (0, 0.16 * length), 0.5)
        parts.append(cabin)
        if rng.random() < 0.5:
            parts.append(canopy((nose - 0.26 * length, nose + 0.06 * length), half * 0.88, ground,
                                deck + tall * 2.2, length / 36, livery.house, livery.house))
    if kind in ('runabout', 'cuddy') and rng.random() < 0.3:  # a tower for the tow
        x, top = rng.uniform(-0.15, -0.02) * length, deck + 0.2 * length
        thick = length / 38
        parts.append(mirrored(rod((x + 0.08 * length, half * 0.9, deck - 0.05 * length),
                                  (x, half * 0.7, top), thick / 2, livery.trim)))
        parts.append(beam((x, -half * 0.75, top), (x, half * 0.75, top), thick, livery.trim))
    back, height = float(hull.x(0, 1)), hull.deck(-length / 2)
    engines = int(rng.choice([0, 1, 2, 3], p=[0.3, 0.45, 0.2, 0.05]))
    for y in (np.arange(engines) - (engines - 1) / 2) * length * 0.09:
        parts.append(outboard(back, y, height, length * rng.uniform(0.1, 0.12), livery.trim))
    if engines == 0:
        parts.append(box((back - 0.06 * length, -half * 0.7, hull.depth * 0.4),
                         (back + 0.03 * length, half * 0.7, hull.depth * 0.55), livery.deck))
    return parts


def motor_yacht(rng: np.random.Generator, livery: Livery) -> list[Mesh]:
    """Return a cruiser or a yacht of one to four storeys, each set back behind the lower."""
    length = rng.uniform(10, 45)
    storeys = int(rng.choice([1, 2, 3], p=[0.35, 0.4, 0.25]))
    hull = _planing(rng, length, (0.2, 0.3))
    well = Well(0.02, 0.95, rng.uniform(0.78, 0.9), length * 0.014)
    cockpit = rng.random() < 0.4
    if cockpit:
        well = Well(0.03, rng.uniform(0.2, 0.3), 0.5, length * 0.016)
    ports = (0.58, 0.7, int(rng.integers(3, 8))) if rng.random() < 0.4 else None
    parts = [hull.skin(livery, well, rng.uniform(0, 0.35), rng.uniform(0.76, 0.92), ports)]
    rear = rng.uniform(-0.34, -0.22) if not cockpit else well.front - 0.5
    front, share = rng.uniform(0.14, 0.32), rng.uniform(0.74, 0.92)
    each = length * rng.uniform(0.05, 0.075)
    slope = rng.uniform(0.5, 2.6)
    panes = int(rng.choice([1, 1, 2, 3, 5]))
    first, roof = on_deck(hull, livery, (rear * length, front * length), each * (
        0.9 if storeys > 1 else 1.1), share, 1, panes, (-0.01 * length, each * slope), 0.4, 0.25)
    parts.append(first)
    back, nose = rear * length, front * length - each * slope
    half = hull.half_deck(0) * share * 0.94
    for _ in range(storeys - 1):
        eave = 0.05 * length * rng.uniform(0.3, 1.3)
        parts.append(box((back - eave, -half, roof - each * 0.08),
                         (nose, half, roof + each * 0.08), livery.roof))
        back += length * rng.uniform(0.03, 0.09)
        nose -= length * rng.uniform(0.0, 0.05)
        half *= rng.uniform(0.84, 0.95)
        high = roof + each * rng.uniform(0.75, 0.95)
        lean = min(each * slope * 0.8, (nose - back) * 0.5)
        parts.append(house(livery, (back, nose), (half, half * 0.9), (roof - each * 0.1, high), 1,
                           panes, (0, lean), 0.08, 0.35))
        nose -= lean
        roof = high
    parts += _topside(rng, livery, length, (back, nose), half, roof, each)
    if rng.random() < 0.5:
        x, y = float(hull.x(0, 0.3)), float(hull.half_beam(0, 0.5)) * 0.9
        parts.append(box((x - 0.05 * length, -y, hull.depth * 0.3), (x + 0.03 * length, y,
                         hull.depth * 0.38), livery.deck))
    return parts


def _topside(rng: np.random.Generator, livery: Livery, length: float, x: tuple[float, float],
             half: float, roof: float, each: float) -> list[Mesh]:
    """Return what stands on a yacht's roof: a flybridge, an arch, domes, a mast."""
    parts: list[Mesh] = []
    thick, back = length / 42, x[0] + 0.25 * (x[1] - x[0])
    if rng.random() < 0.5:
        rim = np.array([(back, half * 0.9), (x[1] - 0.02 * length, half * 0.8),
                        (x[1], half * 0.4)])
        path = np.vstack([rim, rim[::-1] * [1, -1]])[::-1]
        parts.append(wall(path, roof - each * 0.1, roof + each * 0.35, thick * 0.8, livery.house,
                          -0.15))
        seat = (back + x[1]) / 2
        parts.append(cushion((seat - each * 0.6, -half * 0.5, roof - each * 0.1),
                             (seat, half * 0.5, roof + each * 0.4), livery.accent))
        if rng.random() < 0.4:
            parts.append(canopy((back, x[1] - 0.01 * length), half * 0.8, roof - each * 0.1,
                                roof + each * 0.9, thick, livery.roof, livery.trim))
            roof += each * 0.85
    if rng.random() < 0.6:
        top, lean = roof + each * rng.uniform(0.5, 0.8), each * rng.uniform(-0.4, 0.8)
        foot = back + each * 0.3
        parts.append(mirrored(beam((foot, half * 0.75, roof - each * 0.15),
                                   (foot - lean, half * 0.65, top), thick, livery.house,
                                   thick * 1.8)))
        parts.append(box((foot - lean - thick, -half * 0.7, top - thick * 0.5),
                         (foot - lean + thick, half * 0.7, top + thick * 0.5), livery.house))
        parts.append(ellipsoid((foot - lean, 0, top + thick), (thick,) * 3, livery.house, 1))
    elif rng.random() < 0.7:
        foot = back + each * 0.2
        parts.append(beam((foot, 0, roof - each * 0.15), (foot - each * 0.4, 0, roof + each),
                          thick * 1.4, livery.house, thick * 1.4, 0.6))
        parts.append(mirrored(ellipsoid((foot, half * 0.45, roof + thick * 0.7),
                                        (thick * 1.1,) * 3, livery.house, 1)))
    return parts


def hydrofoil(rng: np.random.Generator, livery: Livery) -> list[Mesh]:
    """Return a passenger craft standing on its foils."""
    length = rng.uniform(15, 30)
    hull = _planing(rng, length, (0.18, 0.24))
    parts = [hull.skin(livery, None, 0.3, 0.8)]
    cabin, roof = on_deck(hull, livery, (-0.4 * length, 0.25 * length), length * 0.07, 0.9, 1,
                          int(rng.integers(4, 8)), (0, 0.06 * length), 0.3)
    parts.append(cabin)
    x = rng.uniform(0.0, 0.15) * length
    parts.append(house(livery, (x - 0.12 * length, x + 0.06 * length), (hull.beam * 0.34,
                       hull.beam * 0.3), (roof - 0.01 * length, roof + 0.05 * length), 1, 2,
                       (0, 0.04 * length)))
    down, thick = length * rng.uniform(0.07, 0.12), length / 45
    for place in (-0.36, 0.2):
        at, reach = place * length, hull.beam * rng.uniform(0.5, 0.75)
        parts.append(mirrored(beam((at, hull.beam * 0.3, hull.depth * 0.6),
                                   (at, hull.beam * 0.3, -down), thick, livery.trim, thick * 1.6)))
        tip = reach * math.tan(rng.uniform(0, 0.4)) - down
        parts.append(mirrored(beam((at, -0.02, -down), (at, reach, tip), thick, livery.trim,
                                   thick * 0.6)))
    return parts
