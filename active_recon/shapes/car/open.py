"""Cars without a roof: what sits in a roadster, and the open-wheel racing car."""

from active_recon.shapes.car.bodies import Livery, Stance
from active_recon.shapes.car.fittings import wheel, wheels
from active_recon.shapes.common import materials
from active_recon.shapes.common.parts import (
    assemble,
    beam,
    box,
    ellipsoid,
    loft,
    Mesh,
    mirrored,
    prism,
    rod,
    superellipse,
    tube,
)
import numpy as np


def roadster_fittings(rng: np.random.Generator, stance: Stance, livery: Livery, floor: float,
                      cage: bool) -> list[Mesh]:
    """Return windscreen, seats and steering wheel, and a roll cage or bars behind the seats."""
    y = stance.width / 2 * 0.85
    head = np.array([stance.roof_front, y * 0.9, stance.roof])
    foot = np.array([stance.cowl - 0.08, y, stance.belt - 0.08])
    flip = np.array([1, -1, 1])
    pane = [foot, head, head * flip, foot * flip]
    parts = [loft([pane, np.array(pane) + (0.07, 0, 0.0)], livery.glass),
             mirrored(beam(foot, head, 0.09, livery.trim)),
             beam(head, head * flip, 0.09, livery.trim)]
    rows = 2 if stance.cowl - stance.back > 2.0 and rng.random() < 0.7 else 1
    depth = (stance.cowl - stance.back) / (rows + 0.6)
    for row in range(rows):
        x = stance.back + 0.12 + row * depth
        reach = min(0.55, depth * 0.6)
        seat = stance.width * 0.17
        for side in (-1, 1):
            centre = side * stance.width * 0.2
            parts += [box((x, centre - seat, floor - 0.05), (x + reach, centre + seat,
                          floor + 0.2), livery.seat),
                      box((x - 0.02, centre - seat, floor), (x + 0.16, centre + seat,
                          stance.belt + rng.uniform(0.05, 0.2)), livery.seat)]
    parts.append(box((stance.cowl - 0.3, -y * 0.95, stance.belt - 0.25),
                     (stance.cowl, y * 0.95, stance.belt - 0.02), livery.trim))
    parts.append(rod((stance.cowl - 0.4, 0.2 * stance.width, stance.belt - 0.05),
                     (stance.cowl - 0.1, 0.2 * stance.width, stance.belt - 0.15), 0.16,
                     livery.trim, end_radius=0.05))
    if cage:
        rear = np.array([stance.back + 0.1, y, stance.belt - 0.1])
        above = np.array([stance.roof_rear + 0.2, y * 0.9, stance.roof])
        if rng.random() < 0.5:
            parts.append(box((stance.roof_rear, -y * 0.97, stance.roof - 0.05),
                             (stance.roof_front, y * 0.97, stance.roof + 0.06), livery.roof))
        parts += [mirrored(tube([rear, above, head], 0.05, livery.trim, 6)),
                  beam(above, above * flip, 0.09, livery.trim)]
    elif rng.random() < 0.4:
        parts.append(ellipsoid((stance.back - 0.1, 0, stance.belt - 0.02), (0.25, y * 0.9, 0.16),
                               livery.seat))  # the folded hood
    return parts


def formula(rng: np.random.Generator, livery: Livery) -> list[Mesh]:
    """Return an open-wheel racing car, of today with wings or a cigar of the past."""
    second = materials.paint(rng)
    length, track = rng.uniform(3.8, 5.2), rng.uniform(0.75, 0.98)
    radius = rng.uniform(0.3, 0.46)
    winged = rng.random() < 0.75
    end, belly, width = length / 2, radius * 0.35, rng.uniform(0.6, 0.95)
    top = belly + rng.uniform(0.42, 0.6)
    power = rng.uniform(2.2, 6)
    points = 16 if rng.random() < 0.5 else 8
    shape = [(end, 0.3, 0.3), (end * 0.75, 0.42, 0.5), (end * 0.25, 0.85, 0.85),
             (0, 1.0, 1.0), (-end * 0.5, 0.95, 1.1), (-end * 0.9, 0.5, 0.6)]
    loops = [np.insert(superellipse(width * w, (top - belly) * h, power, points)
                       + (0, belly + (top - belly) * h / 2 + 0.06 * (1 - h)), 0, x, axis=1)
             for x, w, h in shape]
    parts = [loft(loops, livery.paint),
             ellipsoid((end * 0.05, 0, top), (0.45, width * 0.36, 0.1), livery.trim),
             ellipsoid((-0.05, 0, top + 0.12), (0.17, 0.16, 0.19), second)]
    hump = [np.array([(x, y * s, z) for y, z in ((0.2, top - 0.15), (0.14, high), (-0.14, high),
                                                 (-0.2, top - 0.15))])
            for x, s, high in ((-0.3, 1.0, top + rng.uniform(0.25, 0.5)), (-end * 0.8, 0.4, top))]
    parts.append(loft(hump, livery.paint if rng.random() < 0.6 else second))
    front, rear = end * rng.uniform(0.5, 0.72), -end * rng.uniform(0.62, 0.8)
    tyre = radius * (rng.uniform(0.8, 1.15) if winged else rng.uniform(0.4, 0.6))
    one = wheel(rng, radius, tyre, livery, 16)
    parts.append(wheels(one, [(front, track - tyre / 2, radius), (rear, track - tyre / 2,
                                                                  radius)]))
    for x in (front, rear):
        parts += [beam((x, -track + tyre / 2, radius), (x, track - tyre / 2, radius), 0.1,
                       livery.trim),
                  mirrored(beam((x - 0.35, 0.1, radius), (x, track - tyre, radius), 0.08,
                                livery.trim))]
    if winged:
        reach = track * rng.uniform(0.8, 1)
        parts += [box((end - 0.25, -reach, belly - 0.05), (end + 0.25, reach, belly + 0.06),
                      second),
                  box((end - 0.2, -0.12, belly), (end, 0.12, belly + 0.3), livery.paint),
                  mirrored(box((end - 0.3, reach - 0.06, belly - 0.06),
                               (end + 0.28, reach, belly + 0.24), second))]
        aft, high, wide = -end - 0.05, top + rng.uniform(0.15, 0.45), track * rng.uniform(0.6, 0.9)
        parts += [box((aft - 0.2, -wide, high), (aft + 0.25, wide, high + 0.09), second),
                  mirrored(box((aft - 0.25, wide - 0.07, high - 0.4), (aft + 0.3, wide,
                               high + 0.14), livery.paint)),
                  box((aft - 0.1, -0.1, belly + 0.15), (end * -0.7, 0.1, high + 0.02)
                      if rng.random() < 0.3 else (aft + 0.35, 0.1, high + 0.02), livery.trim)]
    if rng.random() < (0.85 if winged else 0.2):
        pod = np.array([(end * 0.1, width * 0.4), (end * 0.02, track * 0.78),
                        (-end * 0.4, track * 0.72), (-end * 0.75, width * 0.3)])
        parts.append(mirrored(prism(pod, belly, top * rng.uniform(0.75, 0.95), 'z',
                                    (livery.paint, second)[rng.integers(2)])))
        parts.append(box((-end * 0.8, -track * 0.7, belly - 0.05), (end * 0.4, track * 0.7,
                         belly + 0.05), livery.trim))
    return [assemble(parts)]
