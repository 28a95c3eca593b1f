"""Road bikes: cruisers, choppers, tourers, sport and naked bikes."""

import math

from active_recon.shapes.common.parts import assemble, beam, ellipsoid, Mesh, mirrored, rod, tube
from active_recon.shapes.motorbike.fittings import fairing, headlight, panniers, sissy_bar, touring
from active_recon.shapes.motorbike.parts import (
    Chassis,
    engine,
    fender,
    fork,
    frame,
    handlebars,
    hull,
    Livery,
    rolling,
)
import numpy as np


def road(rng: np.random.Generator, kind: str, chassis: Chassis, livery: Livery) -> list[Mesh]:
    """Return a cruiser, chopper, tourer, sport or naked bike."""
    low_slung = kind in ('cruiser', 'chopper', 'tourer')
    motor = ('twin' if low_slung and rng.random() < 0.8 else
             str(rng.choice(['four', 'single', 'twin', 'boxer'], p=[0.5, 0.2, 0.2, 0.1])))
    rise, half, back = {
        'cruiser': (rng.uniform(0.1, 0.25), 0.4, rng.uniform(0.2, 0.35)),
        'chopper': (rng.uniform(0.12, 0.42), 0.36, rng.uniform(0.15, 0.3)),
        'tourer': (rng.uniform(0.1, 0.2), 0.4, rng.uniform(0.2, 0.3)),
        'sport': (0.02, 0.32, 0.12),
        'naked': (rng.uniform(0.05, 0.15), 0.37, rng.uniform(0.1, 0.2))}[kind]
    parts = [*rolling(rng, chassis, livery, 'wire' if low_slung else 'cast'),
             fork(chassis, livery, 0.028, kind == 'chopper' and rng.random() < 0.5),
             handlebars(chassis, livery, rise, half, back, rng.random() < 0.6),
             frame(chassis, livery, low_slung or rng.random() < 0.4),
             engine(motor, chassis, livery),
             *_tank_and_seat(rng, kind, chassis, livery),
             *_exhausts(rng, chassis, livery, low_slung)]
    parts.append(fender(chassis.front, chassis.widths[0], 0.02,
                        (rng.uniform(0.3, 0.9), rng.uniform(2.3, 3.0)), livery.paint))
    if low_slung:
        parts.append(fender(chassis.rear, chassis.widths[1], 0.03,
                            (rng.uniform(0.6, 1.0), rng.uniform(2.6, 3.3)), livery.paint))
        parts.append(_carrier(chassis, livery))
    if kind == 'sport' or (kind == 'naked' and rng.random() < 0.2):
        parts += fairing(rng, chassis, livery, full=rng.random() < 0.75)
    elif kind == 'tourer':
        parts += touring(rng, chassis, livery)
    else:
        parts += headlight(rng, chassis, livery)
    if kind in ('cruiser', 'chopper') and rng.random() < 0.4:
        parts.append(sissy_bar(rng, chassis, livery))
    if kind == 'cruiser' and rng.random() < 0.35:
        parts += panniers(rng, chassis, livery.seat)
    return parts


def _tank_and_seat(rng: np.random.Generator, kind: str, chassis: Chassis,
                   livery: Livery) -> list[Mesh]:
    (seat_x, seat_z), (head_x, head_z) = chassis.seat, chassis.head
    start = head_x - 0.1
    end = seat_x + rng.uniform(0.2, 0.28)
    top = max(head_z - rng.uniform(0.0, 0.08), seat_z + 0.12)
    half = rng.uniform(0.12, 0.19)
    shares = np.array([0, 0.12, 0.45, 0.8, 1])
    bottom = np.interp(shares, [0, 1], [top - 0.18, seat_z - 0.06])
    bulge = np.array([0.45, 0.8, 1, 0.7, 0.35]) * half
    ridge = np.array([top - 0.08, top - 0.01, top, 0.55 * top + 0.45 * seat_z, seat_z + 0.02])
    parts = [hull(np.column_stack([start + shares * (end - start), bulge, bottom, ridge]),
                  livery.paint, rng.uniform(2.1, 3.2)),
             rod((start - 0.14, 0, top - 0.04), (start - 0.16, 0, top + 0.02), 0.04,
                 livery.chrome)]
    if kind in ('sport', 'naked'):
        tip = chassis.rear[0] - rng.uniform(0.05, 0.22)
        lift = rng.uniform(0.04, 0.14) if kind == 'sport' else rng.uniform(0, 0.08)
        cafe = rng.random() < 0.3
        parts += [hull([(end + 0.06, 0.09, seat_z - 0.14, seat_z - 0.01),
                        (seat_x - 0.1, 0.12, seat_z - 0.1, seat_z + 0.02),
                        (tip, 0.05, seat_z + lift - 0.04, seat_z + lift + 0.05)], livery.second),
                  hull([(end + 0.03, 0.07, seat_z - 0.05, seat_z + 0.03),
                        (seat_x, 0.13, seat_z - 0.04, seat_z + 0.04),
                        (seat_x - 0.12, 0.12, seat_z - 0.02, seat_z + 0.06),
                        (tip + 0.12, 0.07, seat_z + lift * 0.7, seat_z + lift * 0.8 + 0.09)],
                       livery.paint if cafe else livery.seat, 3),
                  ellipsoid((tip, 0, seat_z + lift), (0.03, 0.05, 0.03), (190, 30, 30), 1)]
        return parts
    rear = rng.uniform(0.02, 0.12)
    parts.append(hull([(end + 0.05, 0.07, seat_z - 0.06, seat_z + 0.02),
                       (seat_x + 0.05, 0.16, seat_z - 0.06, seat_z + 0.03),
                       (seat_x - 0.1, 0.17, seat_z - 0.06, seat_z + 0.08)], livery.seat, 3))
    if kind == 'tourer' or rng.random() < 0.6:
        parts.append(hull([(seat_x - 0.05, 0.14, seat_z - 0.05, seat_z + 0.05 + rear),
                           (seat_x - 0.2, 0.15, seat_z - 0.05, seat_z + 0.08 + rear),
                           (seat_x - 0.36, 0.1, seat_z - 0.04, seat_z + 0.05 + rear)],
                          livery.seat, 3))
    return parts


def _carrier(chassis: Chassis, livery: Livery) -> Mesh:
    """Return the struts from the seat's rails to the rear fender, and the tail light on it."""
    x, z = chassis.rear
    top = z * 2 + 0.04
    angle = 2.5
    tail = (x + (z + 0.06) * math.cos(angle), 0.0, z + (z + 0.06) * math.sin(angle))
    return assemble([beam((chassis.seat[0], 0, chassis.seat[1] - 0.05), (x, 0, top), 0.14,
                          livery.frame, 0.08),
                     ellipsoid(tail, (0.05, 0.07, 0.045), (190, 30, 30), 1)])


def _exhausts(rng: np.random.Generator, chassis: Chassis, livery: Livery,
              low_slung: bool) -> list[Mesh]:
    x, z = chassis.pivot
    y = max(0.18, chassis.widths[1] / 2 + 0.1)
    low = chassis.clearance + 0.06
    lift = rng.uniform(0, 0.12) if low_slung else rng.uniform(0.05, 0.35)
    end = np.array([chassis.rear[0] - (rng.uniform(-0.1, 0.2)), y, low + lift])
    bend = np.array([x - 0.05, y, low])
    path = np.array([(x + 0.28, 0.04, z + 0.22), (x + 0.42, 0.1, z + 0.1), (x + 0.3, y, low),
                     bend, 0.6 * bend + 0.4 * end])
    side = [tube(path, 0.026, livery.chrome, 8),
            rod(0.7 * bend + 0.3 * end, end, rng.uniform(0.04, 0.06), livery.chrome,
                end_radius=rng.uniform(0.045, 0.07)),
            rod(bend, bend * [1, 0, 1] + [0, 0, 0.05], 0.025, livery.frame)]
    pipe = assemble(side)
    if rng.random() < 0.5:
        return [mirrored(pipe)]
    pipe.apply_transform(np.diag([1.0, -1.0, 1.0, 1.0]))
    return [pipe]
