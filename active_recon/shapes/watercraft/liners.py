"""Ships for passengers: cruise ships, liners, ferries and river steamers."""

from active_recon.shapes.common import materials
from active_recon.shapes.common.parts import box, Mesh, mirrored, rod
from active_recon.shapes.watercraft.cargo import LIFEBOAT
from active_recon.shapes.watercraft.house import funnel, house, lifeboats, mast
from active_recon.shapes.watercraft.hull import Hull, Livery, Well
import numpy as np

_WHITE = (240, 240, 240)


def cruise_liner(rng: np.random.Generator, livery: Livery) -> list[Mesh]:
    """Return a cruise ship of many decks, or an old liner with tall funnels in a row."""
    old = rng.random() < 0.35
    length = rng.uniform(120, 330)
    hull = Hull(
        length, length * rng.uniform(0.11, 0.16), length * rng.uniform(0.075, 0.11),
        'box', parallel=rng.uniform(0.6, 0.72), entry=(1.5, rng.uniform(1.8, 2.4)), run=0.25,
        stern=rng.uniform(0.5, 0.9), tuck=0.2, rake=rng.uniform(0.03, 0.1),
        stem=rng.uniform(0.6, 1.4), counter=rng.uniform(0.02, 0.07),
        sheer=(rng.uniform(0.05, 0.3), rng.uniform(0, 0.12)), rocker=(0, 0.2))
    ports = (0.68, 0.76, int(rng.integers(8, 14)))
    parts = [hull.skin(livery, None, rng.uniform(0.2, 0.4), rng.uniform(0.85, 0.95), ports)]
    if rng.random() < 0.7 and not old:
        parts.append(hull.bulb(livery))
    each = length * rng.uniform(0.02, 0.026)
    low, back, front = hull.depth * 0.92, rng.uniform(-0.46, -0.4), rng.uniform(0.24, 0.34)
    share = rng.uniform(0.84, 0.98)
    top = low
    for rows in [2, 1] if old else [int(rng.integers(2, 4)), 2, 1][:int(rng.integers(2, 4))]:
        ends = (back * length, front * length)
        half = (hull.half_deck(ends[0]) * share,
                max(hull.half_deck(ends[1]), hull.beam * 0.3) * share)
        parts.append(house(livery, ends, half, (top - 0.02 * each, top + rows * each), rows,
                           int(rng.integers(5, 10)), (0.3 * each, rng.uniform(0, 1.5) * each), 0,
                           rng.uniform(0.1, 0.4)))
        top += rows * each
        back += rng.uniform(0.01, 0.08)
        front -= rng.uniform(0.02, 0.06)
        share *= rng.uniform(0.86, 0.99)
    boats = rng.integers(4, 7)
    parts.append(lifeboats(np.linspace(-0.28, 0.16, boats) * length, hull.beam * 0.49,
                           low + each * rng.uniform(1.1, 1.8), 0.34 * length / boats,
                           LIFEBOAT if rng.random() < 0.5 else _WHITE))
    count = int(rng.integers(2, 5)) if old else int(rng.choice([1, 1, 2]))
    size = (length * rng.uniform(0.035, 0.06), hull.beam * rng.uniform(0.22, 0.4))
    places = np.linspace(-0.2, 0.12, count) if count > 1 else [rng.uniform(-0.28, 0.0)]
    for x in places:
        parts.append(funnel(x * length, top - each, length * rng.uniform(0.06, 0.075) + each, size,
                            livery.accent, livery.trim, rng.uniform(0.05, 0.4)))
    parts.append(mast(rng, (front - 0.06) * length, top - each * 0.1, length * rng.uniform(
        0.05, 0.1), livery, length / 55))
    if old:
        for x in (0.4, -0.45):
            parts.append(rod((x * length, 0, low), (x * length, 0, top + length * 0.07),
                             length / 90, livery.wood, sections=8))
    return parts


def ferry(rng: np.random.Generator, livery: Livery) -> list[Mesh]:
    """Return a passenger ferry, an open car ferry with its bridge on legs, or a river steamer."""
    kind = rng.choice(['passenger', 'cars', 'steamer'], p=[0.5, 0.28, 0.22])
    length = rng.uniform(20, 120)
    double = kind == 'cars'
    hull = Hull(
        length, length * rng.uniform(0.2, 0.28), length * rng.uniform(0.06, 0.1), 'box',
        parallel=0.7, entry=(2, 2.6), blunt=0.55 if double else 0.05, run=0.3,
        stern=0.55 if double else 0.85, tuck=0.6, rake=0.06, counter=0.06,
        sheer=(0.1, 0.1), rocker=(0.2, 0.2))
    well = Well(0.0, 1.0, 0.72, length * 0.02) if double else None
    parts = [hull.skin(livery, well, rng.uniform(0.2, 0.5), 0.85)]
    each, half = length * rng.uniform(0.05, 0.065), hull.beam / 2
    roof = hull.depth
    if kind == 'cars':
        roof += each * 1.3
        span, thick = length * rng.uniform(0.08, 0.22), length / 40
        for x in (-span, span):
            parts.append(mirrored(box((x - thick, half - thick * 1.6, hull.depth * 0.5),
                                      (x + thick, half, roof), livery.house)))
        parts.append(house(livery, (-span * 1.2, span * 1.2), (half, half), (roof - 0.1 * each,
                           roof + each), 1, int(rng.integers(3, 8)), (0, 0), 0, 0.05))
        roof += each
        for x in np.linspace(-0.36, 0.3, int(rng.integers(2, 5))) * length:
            for y in rng.choice([-0.45, 0.0, 0.45], 2, replace=False) * half:
                car = box((x, y - 0.13 * half, hull.depth * 0.6), (x + 0.08 * length, y + 0.13
                          * half, hull.depth * 0.75 + 0.03 * length), materials.paint(rng))
                parts.append(car)
    else:
        back, front = rng.uniform(-0.47, -0.4), rng.uniform(0.2, 0.36)
        for _ in range(int(rng.integers(1, 4)) + (kind == 'steamer')):
            ends = (back * length, front * length)
            wide = min(half * 0.96, hull.half_deck(ends[1]) * 1.2)
            parts.append(house(livery, ends, (half * 0.94, wide),
                               (roof - 0.12 * each, roof + each), 1, int(rng.integers(5, 12)),
                               (0, rng.uniform(0, 0.6) * each), 0, 0.15))
            roof += each
            parts.append(box((ends[0] - 0.01 * length, -half * 0.97, roof - 0.1 * each),
                             (ends[1] - 0.02 * length, half * 0.97, roof + 0.08 * each),
                             livery.roof))
            back, front = back + rng.uniform(0, 0.08), front - rng.uniform(0.0, 0.08)
    x = rng.uniform(0.0, 0.12) * length
    parts.append(house(livery, (x - 0.06 * length, x + 0.06 * length), (half * 0.5,) * 2,
                       (roof - 0.1 * each, roof + each * 0.8), 1, 2, (0, 0), 0.04, 0.2))
    stacks = [-0.4, 0.4] if kind == 'steamer' and rng.random() < 0.6 else [0.0]
    for y in stacks:
        stack = funnel(x - 0.13 * length, roof - each * 1.1, each * rng.uniform(2, 3.4),
                       (length * 0.05,) * 2, livery.accent, livery.trim, 0.05)
        stack.apply_translation((0, y * half, 0))
        parts.append(stack)
    if kind == 'steamer':
        radius = hull.depth * rng.uniform(0.9, 1.2)
        at, place = -length * 0.48, hull.depth * 0.9
        if rng.random() < 0.6:
            parts.append(rod((at, -half * 0.7, place), (at, half * 0.7, place), radius,
                             livery.accent, sections=12))
        else:
            parts.append(mirrored(rod((0, half * 0.85, place), (0, half * 1.35, place),
                                      radius * 1.4, livery.accent, sections=14)))
    else:
        parts.append(mast(rng, x, roof, each * rng.uniform(1.6, 3), livery, length / 45))
    return parts
