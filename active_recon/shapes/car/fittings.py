"""What is bolted onto cars: wheels, lights, bumpers, mirrors, spoilers, racks and signs."""

import math

from active_recon.shapes.car.bodies import Livery, Stance
from active_recon.shapes.common.parts import (
    assemble,
    beam,
    box,
    Color,
    ellipsoid,
    Mesh,
    mirrored,
    prism,
    rod,
)
import numpy as np

_RED = (190, 25, 25)


def wheel(rng: np.random.Generator, radius: float, width: float, livery: Livery,
          sections: int) -> Mesh:
    """Return a wheel with its axle along y and its outer side at +y, centred on the origin."""
    rim = radius * rng.uniform(0.5, 0.72)
    face = width / 2 + 0.012
    parts = [rod((0, -width / 2, 0), (0, width / 2, 0), radius, livery.tyre, sections=sections)]
    style = rng.integers(4)
    parts.append(rod((0, 0, 0), (0, face, 0), rim, livery.trim if style == 0 else livery.rim,
                     sections=sections))
    if style == 0:
        for angle in np.arange(5) * 2 * math.pi / 5:
            tip = rim * 0.95 * np.array([math.cos(angle), 0, math.sin(angle)])
            parts.append(beam((0, face, 0), tip + (0, face, 0), rim * 0.3, livery.rim, 0.03))
    elif style == 1:
        parts.append(rod((0, 0, 0), (0, face + 0.015, 0), rim * 0.35, livery.trim, sections=8))
    elif style == 2:
        parts.append(ellipsoid((0, face, 0), (rim * 0.5, 0.04, rim * 0.5), livery.rim, 1))
    return assemble(parts)


def wheels(one: Mesh, places: list[tuple[float, float, float]]) -> Mesh:
    """Return copies of a wheel at each place (x, y, z) and at its mirror image."""
    copies = []
    for place in places:
        copies.append(one.copy())
        copies[-1].apply_translation(place)
    return mirrored(assemble(copies))


def arch(x: float, y: float, z: float, radius: float, depth: float, color: Color) -> Mesh:
    """Return a half-round wheel arch on both sides, from y inwards by depth."""
    angles = np.linspace(math.radians(-12), math.radians(192), 12)
    outline = np.column_stack([x + radius * np.cos(angles), z + radius * np.sin(angles)])
    return mirrored(prism(outline, y - depth, y, 'y', color))


def lights(rng: np.random.Generator, stance: Stance, livery: Livery) -> list[Mesh]:
    """Return head lights, tail lights, and often a grille."""
    end = stance.length / 2
    white = (rng.uniform(225, 255), rng.uniform(215, 250), rng.uniform(120, 240))
    parts = []
    style = rng.integers(3)
    tall, wide = rng.uniform(0.12, 0.24), rng.uniform(0.22, 0.42) * stance.width / 2
    for x, top, color in ((end, stance.nose, white), (-end, stance.deck, _RED)):
        outward = math.copysign(1, x)
        y = stance.half_width(x) * (0.66 if stance.smooth else 0.72)
        z = stance.clearance + (top - stance.clearance) * rng.uniform(0.55, 0.7)
        if style == 0 and x > 0:
            parts.append(mirrored(rod((x - 0.25, y, z), (x + 0.02, y, z), tall * 0.8, color)))
        elif stance.smooth:
            swept = ellipsoid((x - outward * 0.07, y, z), (0.13, wide * 0.55, tall * 0.5), color)
            parts.append(mirrored(swept))
        else:
            parts.append(mirrored(box((x - outward * 0.2, y - wide / 2, z - tall / 2),
                                      (x + outward * 0.02, y + wide / 2, z + tall / 2), color)))
    if rng.random() < 0.65:
        z = stance.clearance + (stance.nose - stance.clearance) * rng.uniform(0.45, 0.62)
        half = stance.width * rng.uniform(0.1, 0.22)
        rise = rng.uniform(0.06, 0.16)
        parts.append(box((end - 0.25, -half, z - rise), (end + 0.015, half, z + rise),
                         livery.trim))
    return parts


def bumpers(rng: np.random.Generator, stance: Stance, color: Color) -> list[Mesh]:
    """Return a bumper at each end."""
    end = stance.length / 2
    z = stance.clearance + rng.uniform(0.08, 0.2)
    tall, reach = rng.uniform(0.12, 0.26), rng.uniform(0.03, 0.14)
    parts = []
    for side in (1, -1):
        y = stance.half_width(end) * rng.uniform(0.85, 1.02)
        outline = np.array([(side * (end - 0.25), y), (side * (end + reach * 0.5), y),
                            (side * (end + reach), y * 0.8), (side * (end + reach), -y * 0.8),
                            (side * (end + reach * 0.5), -y), (side * (end - 0.25), -y)])
        parts.append(prism(outline, z - tall / 2, z + tall / 2, 'z', color))
    return parts


def mirrors(rng: np.random.Generator, stance: Stance, color: Color) -> Mesh:
    """Return the wing mirrors at the feet of the windscreen."""
    x, y = stance.cowl - 0.1 * rng.uniform(1, 4), stance.width / 2
    z = stance.belt + 0.1
    size = rng.uniform(0.8, 1.5)
    return mirrored(box((x - 0.07, y * 0.85, z - 0.06 * size),
                        (x + 0.07, y + 0.17 * size, z + 0.07 * size), color))


def spoiler(rng: np.random.Generator, stance: Stance, color: Color) -> Mesh:
    """Return a wing on posts above the tail."""
    x = -stance.length / 2 + rng.uniform(0.1, 0.3)
    deck = stance.top(x) - 0.06
    z = deck + rng.uniform(0.12, 0.42)
    y, chord = stance.half_width(x) * rng.uniform(0.75, 1), rng.uniform(0.22, 0.4)
    posts = y * rng.uniform(0.5, 0.9)
    return assemble([
        beam((x, -y, z), (x, y, z), chord, color, 0.08),
        mirrored(beam((x, posts, deck - 0.1), (x, posts, z), chord * 0.6, color, 0.08))])


def roof_load(rng: np.random.Generator, stance: Stance, livery: Livery, color: Color) -> Mesh:
    """Return a roof rack: rails, a basket, or one with luggage."""
    rear, front = stance.roof_rear + 0.15, stance.roof_front - 0.15
    y, z = stance.width * rng.uniform(0.28, 0.34), stance.roof
    parts = [mirrored(box((rear, y - 0.06, z - 0.08), (front, y, z + 0.09), livery.trim))]
    for x in np.linspace(rear + 0.1, front - 0.1, int(rng.integers(2, 5))):
        parts.append(box((x - 0.05, -y, z + 0.01), (x + 0.05, y, z + 0.1), livery.trim))
    if rng.random() < 0.5:
        reach = rng.uniform(0.4, 1) * (front - rear)
        parts.append(box((rear, -y * rng.uniform(0.5, 0.95), z), (rear + reach, y * 0.9,
                         z + rng.uniform(0.15, 0.45)), color))
    return assemble(parts)


def light_bar(rng: np.random.Generator, stance: Stance) -> Mesh:
    """Return a police light bar, or a row of two beacons."""
    x = (stance.roof_front + stance.roof_rear) / 2 + rng.uniform(0, 0.3) * (
        stance.roof_front - stance.roof_rear)
    y, z = stance.width * rng.uniform(0.2, 0.36), stance.roof - 0.04
    high, half = rng.uniform(0.13, 0.24), rng.uniform(0.1, 0.2)
    return assemble([box((x - half, 0.1, z), (x + half, y, z + high), (30, 60, 215)),
                     box((x - half, -0.1, z), (x + half, -y, z + high), (215, 30, 30)),
                     box((x - half * 0.8, -0.11, z), (x + half * 0.8, 0.11, z + high * 0.8),
                         (225, 225, 225))])


def roof_sign(rng: np.random.Generator, stance: Stance, color: Color) -> Mesh:
    """Return a taxi's sign."""
    x = stance.roof_front - rng.uniform(0.2, 0.5) * (stance.roof_front - stance.roof_rear)
    y, z = rng.uniform(0.2, 0.5), stance.roof - 0.04
    high = rng.uniform(0.18, 0.34)
    outline = np.array([(x - 0.16, z), (x + 0.16, z), (x + 0.09, z + high), (x - 0.09, z + high)])
    return prism(outline, -y, y, 'y', color)
