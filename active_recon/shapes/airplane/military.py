"""Fighters and flying wings."""

from active_recon.shapes.airplane.parts import fin, Fuselage, Livery, pylon, tricycle, wing
from active_recon.shapes.airplane.tails import tail
from active_recon.shapes.common.parts import assemble, box, ellipsoid, loft, Mesh, mirrored, rod
import numpy as np


def fighter(rng: np.random.Generator, livery: Livery) -> list[Mesh]:
    """Return a fighter: delta, swept or trapezoid wings, with or without canards and intakes."""
    length = rng.uniform(11, 20)
    twin = rng.random() < 0.5  # engines side by side make a broad flat body
    width = length * (rng.uniform(0.1, 0.17) if twin else rng.uniform(0.075, 0.11))
    height = length * rng.uniform(0.075, 0.11)
    shape = np.array([(0.5, 0.02, 0.03), (0.42, 0.3, 0.45), (0.3, 0.5, 0.8), (0.18, 0.6, 1.0),
                      (0.05, 0.95, 1.05), (-0.2, 1.0, 0.95), (-0.42, 0.9, 0.8),
                      (-0.5, 0.75, 0.6)])
    body = Fuselage(shape[:, 0] * length, height * (0.1 * shape[:, 2] - 0.1),
                    np.maximum(shape[:, 1] * width, shape[:, 2] * height * 0.5
                               if twin else 0), shape[:, 2] * height, rng.uniform(1.9, 3.5))
    parts = [body.skin(livery, rng.uniform(-0.6, 0.2), -2)]
    seats = length * rng.uniform(0.07, 0.13)
    cockpit = length * rng.uniform(0.2, 0.28)
    z, across, tall = body.at(cockpit)
    parts.append(ellipsoid((cockpit, 0, z + tall * 0.38), (seats, across * 0.38, height *
                           rng.uniform(0.25, 0.42)), livery.glass))
    parts += _exhausts(length, height, width, twin, livery)
    style = rng.choice(['delta', 'swept', 'trapezoid'], p=[0.4, 0.35, 0.25])
    span = length * rng.uniform(0.27, 0.42)
    root = length * {'delta': rng.uniform(0.4, 0.58), 'swept': rng.uniform(0.2, 0.3),
                     'trapezoid': rng.uniform(0.24, 0.36)}[str(style)]
    sweep = {'delta': root * rng.uniform(0.8, 1.0), 'swept': span * rng.uniform(0.6, 1.1),
             'trapezoid': root * rng.uniform(0.4, 0.65)}[str(style)]
    tip = root * (rng.uniform(0.06, 0.2) if style == 'delta' else rng.uniform(0.25, 0.5))
    aft = -length * (rng.uniform(0.36, 0.45) if style == 'delta' else rng.uniform(0.1, 0.25))
    x, level = aft + root, rng.uniform(-0.25, 0.25) * height
    thick = max(root * 0.05, length * 0.02)
    droop = span * rng.uniform(-0.08, 0.06)
    parts.append(wing(x, level, span, root, tip, sweep, droop, thick, livery.wing))
    fins = rng.choice(['twin', 'single', 'V'], p=[0.5, 0.42, 0.08] if twin else [0.15, 0.8, 0.05])
    size = length * rng.uniform(0.12, 0.19)
    if style == 'delta':
        parts += _delta_fins(rng, str(fins), body, livery, size, thick)
    else:
        kind = {'twin': 'twin', 'single': 'conventional', 'V': 'V'}[str(fins)]
        parts += tail(rng, kind, body, livery, size, rng.uniform(0.5, 0.9))
    if rng.random() < (0.5 if style == 'delta' else 0.1):
        at, chord = x + length * rng.uniform(0.04, 0.1), length * rng.uniform(0.07, 0.11)
        parts.append(wing(at, height * 0.2, span * rng.uniform(0.45, 0.6), chord, chord * 0.4,
                          chord * rng.uniform(0.5, 1), 0, thick, livery.wing))
    if rng.random() < 0.65:  # intakes beside the cockpit
        y, z = width * 0.42, -height * 0.15
        front = length * rng.uniform(0.06, 0.17)
        loops = [[(at, y + a * width * s, z + b * height * s) for a, b in (
                     (-0.2, -0.35), (0.25, -0.35), (0.25, 0.3), (-0.2, 0.3))]
                 for at, s in ((front, 1.0), (-length * 0.2, 1.0), (-length * 0.4, 0.5))]
        parts.append(mirrored(loft(loops, livery.top)))
        parts.append(mirrored(box((front - 0.1, y - width * 0.16, z - height * 0.3),
                                  (front + 0.03, y + width * 0.21, z + height * 0.25),
                                  (25, 25, 30))))
    if rng.random() < 0.5:  # missiles or tanks, hung from the wings
        for share in np.linspace(0.45, 0.9, int(rng.integers(1, 4))):
            parts.append(mirrored(_store(rng, x - sweep * share, span * share, level + droop *
                                         share, length, livery)))
    if rng.random() < 0.3:
        parts += tricycle(body, -length * 0.1, width * 0.5, -height * 0.2, -height * 1.05,
                           length * 0.025, 1, livery)
    return parts


def flying_wing(rng: np.random.Generator, livery: Livery) -> list[Mesh]:
    """Return a tailless bomber, or a faceted stealth body blended into its wings."""
    span = rng.uniform(8, 13)
    root, sweep = span * rng.uniform(0.6, 1.1), span * rng.uniform(0.45, 0.9)
    thick = root * rng.uniform(0.1, 0.16)
    parts = [wing(root / 2, 0, span, root, root * rng.uniform(0.12, 0.3), sweep,
                  span * rng.uniform(-0.02, 0.05), thick, livery.wing, rng.uniform(0, 0.5)),
             ellipsoid((root * 0.05, 0, thick * 0.25), (root * 0.45, span *
                       rng.uniform(0.08, 0.13), thick * 0.75), livery.top),
             ellipsoid((root * 0.3, 0, thick * 0.6), (root * 0.1, span * 0.05, thick * 0.35),
                       livery.glass),
             mirrored(ellipsoid((0, span * 0.2, thick * 0.35), (root * 0.25, span * 0.06,
                                thick * 0.4), livery.engine))]
    if rng.random() < 0.5:
        size = span * rng.uniform(0.2, 0.35)
        parts.append(mirrored(fin(-root * 0.2, span * 0.1, 0, size, root * 0.3, root * 0.15,
                                  size * 0.7, thick * 0.3, livery.tail, size *
                                  rng.uniform(0.3, 0.7))))
    return parts


def _exhausts(length: float, height: float, width: float, twin: bool,
              livery: Livery) -> list[Mesh]:
    radius = height * 0.3
    return [rod((-length * 0.45, y, -height * 0.04), (-length * 0.535, y, -height * 0.04), radius,
                livery.metal, end_radius=radius * 0.8)
            for y in ((-width * 0.22, width * 0.22) if twin else (0.0,))]


def _delta_fins(rng: np.random.Generator, kind: str, body: Fuselage, livery: Livery, size: float,
                thick: float) -> list[Mesh]:
    root = size * rng.uniform(0.9, 1.4)
    x = float(body.x[-1]) + root * 1.05
    z, width, height = body.at(x - root / 2)
    tip, back = root * rng.uniform(0.25, 0.5), root * rng.uniform(0.5, 0.8)
    if kind == 'single':
        return [fin(x, 0, z + height * 0.25, size, root, tip, back, thick, livery.tail)]
    cant = size * (rng.uniform(0.6, 0.9) if kind == 'V' else rng.uniform(0, 0.35))
    return [mirrored(fin(x, width * 0.35, z, size, root, tip, back, thick, livery.tail, cant))]


def _store(rng: np.random.Generator, x: float, y: float, z: float, length: float,
           livery: Livery) -> Mesh:
    radius = length * rng.uniform(0.011, 0.022)
    reach = radius * rng.uniform(6, 11)
    below = z - radius * 2
    return assemble([ellipsoid((x - length * 0.04, y, below), (reach, radius, radius),
                               livery.stripe),
                     pylon(x, y, below, z, length * 0.07, radius * 0.7, livery.wing)])
