"""What is hung on a road bike: lights, fairings, windscreens, cases."""

from active_recon.shapes.common.parts import (
    assemble,
    beam,
    box,
    Color,
    ellipsoid,
    Mesh,
    mirrored,
    rod,
)
from active_recon.shapes.common.soft_parts import cushion
from active_recon.shapes.motorbike.parts import Chassis, hull, Livery
import numpy as np


def headlight(rng: np.random.Generator, chassis: Chassis, livery: Livery) -> list[Mesh]:
    """Return a headlight, now and then with indicators or a windscreen."""
    x, z = chassis.on_fork(0.92)
    radius = rng.uniform(0.08, 0.11)
    parts = [rod((x - 0.02, 0, z), (x + 0.12, 0, z), 0.7 * radius, livery.chrome,
                 end_radius=radius, sections=14),
             ellipsoid((x + 0.12, 0, z), (0.03, 0.92 * radius, 0.92 * radius), (245, 240, 215))]
    if rng.random() < 0.4:
        parts.append(mirrored(rod((x, 0.03, z - 0.02), (x + 0.05, 0.19, z - 0.02), 0.03,
                                  (235, 140, 40))))
    if rng.random() < 0.25:
        parts.append(beam((x + 0.06, 0, z), (x - 0.06, 0, z + 0.36), 0.36, livery.glass, 0.04))
    return parts


def fairing(rng: np.random.Generator, chassis: Chassis, livery: Livery,
             full: bool) -> list[Mesh]:
    """Return a sport bike's nose and windscreen; full: closed down to the belly."""
    (x, z), low = chassis.head, chassis.clearance
    nose = x + rng.uniform(0.28, 0.4)
    half = rng.uniform(0.17, 0.23)
    chin = z - rng.uniform(0.26, 0.34)
    parts = [hull([(nose, 0.05, z - 0.13, z - 0.08), (nose - 0.1, 0.7 * half, chin + 0.08, z),
                   (x + 0.08, half, chin, z + 0.07), (x - 0.15, half, chin - 0.12, z - 0.03),
                   (x - 0.3, 0.85 * half, chin - 0.15, z - 0.15)], livery.paint),
             mirrored(ellipsoid((nose - 0.06, 0.08, z - 0.07), (0.06, 0.045, 0.035),
                                (245, 240, 215), 1)),
             hull([(nose - 0.1, 0.06, z - 0.04, z + 0.02), (x + 0.1, 0.13, z, z + 0.14),
                   (x + 0.02, 0.1, z + 0.05, z + 0.2)], livery.glass)]
    if full:
        parts.append(hull([(x + 0.02, 0.75 * half, chin - 0.1, chin + 0.1),
                           (x - 0.12, half, low + 0.1, chin),
                           (x - 0.35, 0.95 * half, low, chin - 0.08),
                           (chassis.pivot[0] + 0.05, 0.6 * half, low, low + 0.15)],
                          livery.second, 3))
    return parts


def touring(rng: np.random.Generator, chassis: Chassis, livery: Livery) -> list[Mesh]:
    """Return a tourer's fairing, windscreen, cases and leg guards."""
    x, z = chassis.on_fork(1.0)
    half = rng.uniform(0.26, 0.38)
    parts = [hull([(x + 0.22, 0.5 * half, z - 0.16, z + 0.02),
                   (x + 0.12, half, z - 0.2, z + 0.12), (x - 0.02, half, z - 0.1, z + 0.16)],
                  livery.paint, 2.8),
             ellipsoid((x + 0.2, 0, z - 0.06), (0.06, 0.1, 0.09), (245, 240, 215)),
             beam((x + 0.1, 0, z + 0.08), (x - 0.08, 0, z + rng.uniform(0.3, 0.5)), 1.5 * half,
                  livery.glass, 0.04, end_scale=0.75)]
    if rng.random() < 0.5:  # leg guards
        parts.append(mirrored(beam((x - 0.2, 0.1, chassis.clearance + 0.3),
                                   (x - 0.2, 0.34, chassis.clearance + 0.3), 0.1, livery.paint,
                                   0.36)))
    parts += panniers(rng, chassis, livery.paint)
    if rng.random() < 0.6:
        seat_x, seat_z = chassis.seat
        parts.append(cushion((seat_x - 0.68, -0.24, seat_z + 0.02),
                             (seat_x - 0.32, 0.24, seat_z + rng.uniform(0.25, 0.4)),
                             livery.paint, 0.07))
        parts.append(box((seat_x - 0.6, -0.1, seat_z - 0.08), (seat_x - 0.2, 0.1, seat_z + 0.04),
                         livery.frame))
    return parts


def panniers(rng: np.random.Generator, chassis: Chassis, color: Color) -> list[Mesh]:
    """Return a case on each side of the rear wheel and what carries them."""
    x, z = chassis.rear
    inner = chassis.widths[1] / 2 + 0.05
    top = z + rng.uniform(0.27, 0.36)
    long = rng.uniform(0.22, 0.3)
    case = cushion((x - long, inner, z + 0.02), (x + long * 0.8, inner + rng.uniform(0.14, 0.22),
                                                 top), color, 0.07)
    return [mirrored(case), box((x, -inner - 0.05, top - 0.1), (x + 0.1, inner + 0.05, top - 0.05),
                                np.asarray(color) * 0.6)]


def sissy_bar(rng: np.random.Generator, chassis: Chassis, livery: Livery) -> Mesh:
    """Return a passenger's back rest above the rear wheel."""
    x, z = chassis.rear
    start = np.array([x + 0.02, chassis.widths[1] / 2 + 0.04, z + 0.0])
    top = np.array([x - 0.12, 0.09, chassis.seat[1] + rng.uniform(0.25, 0.6)])
    bar = rod(start, top, 0.02, livery.chrome)
    pad = box(top + [-0.02, -0.2, -0.18], top + [0.03, 0.02, -0.02], livery.seat)
    return assemble([mirrored(bar), rod(top * [1, -1, 1], top, 0.02, livery.chrome), pad])
