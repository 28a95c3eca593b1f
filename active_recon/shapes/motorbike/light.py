"""Light motorbikes: dirt bikes and scooters."""

from active_recon.shapes.common.parts import beam, box, ellipsoid, Mesh, mirrored, rod, tube
from active_recon.shapes.common.soft_parts import cushion
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


def dirt(rng: np.random.Generator, chassis: Chassis, livery: Livery) -> list[Mesh]:
    """Return a dirt bike: a long flat seat, high fenders, a number plate."""
    (x, z), (seat_x, seat_z) = chassis.head, chassis.seat
    plate_x, plate_z = chassis.on_fork(0.95)
    tail = seat_x - rng.uniform(0.32, 0.48)
    beak_x, beak_z = chassis.on_fork(0.72)
    parts = [*rolling(rng, chassis, livery, 'wire'), fork(chassis, livery, 0.03, False),
             handlebars(chassis, livery, 0.11, 0.4, 0.1, False),
             frame(chassis, livery, False), engine('single', chassis, livery),
             hull([(x - 0.04, 0.05, z - 0.22, z - 0.06), (x - 0.15, 0.13, z - 0.36, z - 0.05),
                   (x - 0.32, 0.12, z - 0.36, seat_z + 0.02),
                   (x - 0.45, 0.07, seat_z - 0.15, seat_z)], livery.paint),
             hull([(x - 0.22, 0.06, seat_z - 0.02, seat_z + 0.06),
                   (seat_x + 0.1, 0.09, seat_z - 0.08, seat_z + 0.02),
                   (seat_x - 0.3, 0.09, seat_z - 0.04, seat_z + 0.06)], livery.seat, 4),
             hull([(seat_x + 0.12, 0.1, seat_z - 0.22, seat_z - 0.05),
                   (tail, 0.085, seat_z - 0.02, seat_z + 0.03),
                   (tail - 0.2, 0.06, seat_z + 0.03, seat_z + 0.07)], livery.second, 4),
             hull([(beak_x - 0.15, 0.06, beak_z - 0.04, beak_z + 0.03),
                   (beak_x + 0.1, 0.075, beak_z - 0.02, beak_z + 0.04),
                   (beak_x + rng.uniform(0.35, 0.5), 0.04, beak_z - 0.03, beak_z + 0.02)],
                  livery.second, 4),
             beam((plate_x + 0.05, 0, plate_z - 0.15), (plate_x + 0.02, 0, plate_z + 0.13), 0.2,
                  (235, 235, 230) if rng.random() < 0.5 else livery.paint, 0.06)]
    y = rng.choice([-1, 1]) * 0.13
    pivot_x, pivot_z = chassis.pivot
    parts += [tube([(pivot_x + 0.3, 0, pivot_z + 0.25), (pivot_x + 0.3, y, pivot_z + 0.22),
                    (pivot_x, y, seat_z - 0.2), (seat_x, y, seat_z - 0.13)], 0.03,
                   livery.chrome),
              rod((seat_x + 0.05, y, seat_z - 0.14), (tail, y, seat_z - 0.02), 0.055,
                  livery.engine)]
    if rng.random() < 0.5:
        parts.append(mirrored(beam((x - 0.1, 0.11, z - 0.2), (x - 0.3, 0.16, seat_z - 0.3), 0.04,
                                   livery.second, 0.25)))
    parts.append(rod((seat_x, 0, seat_z - 0.1), (pivot_x - 0.05, 0, pivot_z), 0.045,
                     livery.second))
    return parts


def scooter(rng: np.random.Generator, chassis: Chassis, livery: Livery) -> list[Mesh]:
    """Return a scooter: a leg shield, a floor to step through, all else under the seat."""
    (x, z), (rear_x, rear_z) = chassis.head, chassis.rear
    seat_z, floor = chassis.seat[1], chassis.clearance + 0.06
    wide, back = rng.uniform(0.16, 0.21), rear_x - rng.uniform(0.12, 0.25)
    body = rear_x + rng.uniform(0.42, 0.5)
    round_body = rng.uniform(2.2, 4)
    foot = (x - 0.12, floor)
    parts = [*rolling(rng, chassis, livery, 'disc'), fork(chassis, livery, 0.025, False),
             handlebars(chassis, livery, 0.04, 0.33, 0.12, rng.random() < 0.6),
             fender(chassis.front, chassis.widths[0], 0.02, (0.1, 2.7), livery.second),
             beam((*foot[:1], 0, floor - 0.03), (x - 0.01, 0, z - 0.06), 2 * wide * 1.1,
                  livery.paint, 0.08, end_scale=rng.uniform(0.55, 0.9)),
             beam((x + 0.04, 0, floor + 0.2), (x + 0.05, 0, z - 0.04), 0.16, livery.second, 0.14),
             hull([(foot[0] + 0.04, wide, floor - 0.05, floor + 0.03),
                   (body - 0.1, wide * 0.9, floor - 0.05, floor + 0.03)], livery.frame, 6),
             hull([(body + 0.02, wide * 0.75, floor - 0.03, seat_z - 0.04),
                   (rear_x + 0.15, wide, rear_z, seat_z - 0.03),
                   (rear_x - 0.06, wide * 0.9, rear_z + 0.08, seat_z - 0.02),
                   (back, wide * 0.35, seat_z - 0.22, seat_z - 0.05)], livery.paint, round_body),
             hull([(body + 0.05, 0.08, seat_z - 0.06, seat_z + 0.02),
                   (body - 0.1, 0.14, seat_z - 0.07, seat_z + 0.03),
                   (rear_x + 0.12, 0.14, seat_z - 0.07, seat_z + rng.uniform(0.03, 0.08)),
                   (back + 0.02, 0.08, seat_z - 0.06, seat_z + 0.05)], livery.seat, 3),
             box((rear_x - 0.08, -0.11, rear_z - 0.06), (body - 0.05, -0.03, rear_z + 0.1),
                 livery.engine),
             beam((rear_x + 0.05, 0.1, rear_z - 0.02), (rear_x - 0.22, 0.1, rear_z + 0.04), 0.08,
                  livery.chrome),
             rod((rear_x, -0.1, rear_z), (rear_x, 0.12, rear_z), 0.03, livery.chrome),
             ellipsoid((back + 0.02, 0, seat_z - 0.13), (0.03, 0.07, 0.035), (190, 30, 30), 1),
             ellipsoid((x - 0.01, 0, z + 0.05), (0.11, 0.15, 0.09), livery.paint)]
    lamp = np.array([x + 0.08, 0, z + 0.05] if rng.random() < 0.6 else [x + 0.1, 0, z - 0.15])
    parts.append(ellipsoid(lamp, (0.05, 0.075, 0.06), (245, 240, 215), 1))
    if rng.random() < 0.3:
        parts.append(beam((x + 0.04, 0, z + 0.05), (x - 0.08, 0, z + 0.5), 0.4, livery.glass,
                          0.04))
    if rng.random() < 0.4:
        parts.append(box((back - 0.16, -0.1, seat_z - 0.06), (back + 0.15, 0.1, seat_z - 0.02),
                         livery.chrome))
        if rng.random() < 0.7:
            parts.append(cushion((back - 0.24, -0.18, seat_z - 0.03),
                                 (back + 0.08, 0.18, seat_z + 0.25), livery.second, 0.06))
    return parts
