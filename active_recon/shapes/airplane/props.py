"""Propeller aeroplanes and gliders, on wheels or on floats."""

from active_recon.shapes.airplane.parts import (
    float_hull,
    Fuselage,
    fuselage,
    leg,
    Livery,
    nacelle,
    propeller,
    strut,
    wing,
)
from active_recon.shapes.airplane.tails import tail
from active_recon.shapes.common.parts import ellipsoid, Mesh, mirrored
import numpy as np


def light(rng: np.random.Generator, livery: Livery) -> list[Mesh]:
    """Return a light single: high wing with struts, or low wing with a canopy."""
    length = rng.uniform(6, 10)
    body, parts, width = _single(rng, length, livery, rng.uniform(0.12, 0.17))
    high = rng.random() < 0.6
    span, root = length * rng.uniform(0.5, 0.75), length * rng.uniform(0.16, 0.24)
    x = length * rng.uniform(0.18, 0.27)
    thick, tip = root * 0.14, root * rng.uniform(0.5, 1.0)
    cabin = x - root * 0.35
    level, _, height = body.at(cabin)
    # High wings lie on the cabin's roof, which low wings share as a canopy.
    roof = level + height * rng.uniform(0.62, 0.75)
    z = roof if high else level - height * rng.uniform(0.25, 0.4)
    lift = span * (rng.uniform(0, 0.05) if high else rng.uniform(0.05, 0.12))
    parts += [wing(x, z, span, root, tip, span * rng.uniform(-0.02, 0.12), lift, thick,
                   livery.wing),
              ellipsoid((cabin, 0, level + height * 0.3), (length * rng.uniform(0.13, 0.2),
                        width * 0.42, roof - level - height * 0.3 + (0 if high else 0.1)),
                        livery.glass)]
    ground = -length * rng.uniform(0.16, 0.2)
    if high and rng.random() < 0.75:
        parts.append(mirrored(strut((cabin, width * 0.3, level - height * 0.35), (
            x - root * 0.4, span * 0.5, z + lift * 0.5), length * 0.014, livery.metal)))
    parts += _tail_and_gear(rng, body, livery, length, x - root * 0.3, width, ground)
    return parts


def warbird(rng: np.random.Generator, livery: Livery) -> list[Mesh]:
    """Return a low-wing fighter or racer of the forties."""
    length = rng.uniform(8, 11)
    body, parts, width = _single(rng, length, livery, rng.uniform(0.1, 0.14))
    span, root = length * rng.uniform(0.5, 0.66), length * rng.uniform(0.22, 0.3)
    x = length * rng.uniform(0.16, 0.24)
    level, _, height = body.at(x - root / 2)
    z = level - height * rng.uniform(0.2, 0.35)
    parts.append(wing(x, z, span, root, root * rng.uniform(0.3, 0.6),
                      span * rng.uniform(0.02, 0.2), span * rng.uniform(0.05, 0.12), root * 0.13,
                      livery.wing))
    seat = rng.uniform(-0.06, 0.06) * length
    at, _, tall = body.at(seat)
    parts.append(ellipsoid((seat, 0, at + tall * 0.4), (length * rng.uniform(0.07, 0.14),
                           width * 0.33, tall * rng.uniform(0.25, 0.4)), livery.glass))
    parts += tail(rng, 'conventional', body, livery, length * rng.uniform(0.13, 0.17),
                  rng.uniform(0.1, 0.4))
    if rng.random() < 0.5:
        radius = length * 0.035
        ground = -length * rng.uniform(0.16, 0.19)
        parts += [mirrored(leg((x - root * 0.25, span * 0.27, z), (x - root * 0.1, span * 0.27,
                               ground + radius), radius, 1, livery)),
                  _tail_wheel(body, length, livery)]
    return parts


def biplane(rng: np.random.Generator, livery: Livery) -> list[Mesh]:
    """Return a biplane, now and then a triplane, with struts between its wings."""
    length = rng.uniform(5.5, 8)
    body, parts, width = _single(rng, length, livery, rng.uniform(0.12, 0.17))
    span, root = length * rng.uniform(0.5, 0.68), length * rng.uniform(0.15, 0.22)
    x = length * rng.uniform(0.2, 0.28)
    level, _, height = body.at(x - root / 2)
    low = level - height * rng.uniform(0.3, 0.45)
    high = level + height * rng.uniform(0.8, 1.15)
    stagger, shorter = length * rng.uniform(-0.01, 0.07), rng.uniform(0.75, 1.0)
    sheets = [(x, low, span * shorter), (x + stagger, high, span)]
    if rng.random() < 0.15:
        sheets.insert(1, (x + stagger / 2, (low + high) / 2, span * (1 + shorter) / 2))
    for edge, z, half in sheets:
        parts.append(wing(edge, z, half, root, root * rng.uniform(0.75, 1), 0, half * 0.02,
                          root * 0.12, livery.wing))
    thin = length * 0.018
    for share in (0.18, 0.75) if rng.random() < 0.7 else (0.18, 0.5, 0.85):
        y = span * shorter * share
        for chord in (0.2, 0.75):
            parts.append(mirrored(strut((x - root * chord, y, low), (x + stagger - root * chord, y,
                                        high), thin, livery.metal)))
    for seat in np.linspace(-0.04, -0.16, int(rng.integers(1, 3))) * length:
        at, across, tall = body.at(float(seat))
        parts.append(ellipsoid((seat, 0, at + tall * 0.45), (length * 0.035, across * 0.3,
                               tall * 0.25), livery.glass))
    parts += _tail_and_gear(rng, body, livery, length, x - root * 0.1, width,
                            low - length * rng.uniform(0.1, 0.14))
    return parts


def twin(rng: np.random.Generator, livery: Livery) -> list[Mesh]:
    """Return an aeroplane with two propellers on its wings, sometimes a flying boat."""
    length = rng.uniform(9, 24)
    width = length * rng.uniform(0.09, 0.14)
    body = fuselage(rng, length, width, width * rng.uniform(1, 1.25), rng.uniform(0.14, 0.28),
                    rng.uniform(0.35, 0.5), rng.uniform(0.1, 0.4), rng.uniform(0.45, 0.8),
                    rng.uniform(2, 3))
    rear = length * rng.uniform(0.27, 0.33)
    split = rng.uniform(-0.5, 0.2)
    parts = [body.skin(livery, split, split + rng.uniform(0, 0.4), (rear, rear + width * 0.4))]
    high = rng.random() < 0.5
    span, root = length * rng.uniform(0.5, 0.7), length * rng.uniform(0.13, 0.19)
    x, z = length * rng.uniform(0.08, 0.18), width * (0.5 if high else -0.35)
    lift = span * (0.01 if high else rng.uniform(0.05, 0.12))
    sweep, tip = span * rng.uniform(0, 0.12), root * rng.uniform(0.35, 0.7)
    parts.append(wing(x, z, span, root, tip, sweep, lift, root * 0.14, livery.wing))
    share, radius = rng.uniform(0.27, 0.36), width * rng.uniform(0.2, 0.28)
    hub = np.array([x - sweep * share + root * rng.uniform(0.3, 0.6), span * share,
                    z + lift * share])
    disc = min(width * rng.uniform(0.6, 0.85), span * share - width * 0.4)
    parts += [mirrored(nacelle(hub, root * rng.uniform(1.2, 1.7), radius, livery)),
              mirrored(propeller(rng, hub, disc, int(rng.integers(2, 7)), radius * 0.5, livery))]
    kind = rng.choice(['conventional', 'T', 'cruciform', 'H'], p=[0.5, 0.25, 0.1, 0.15])
    parts += tail(rng, str(kind), body, livery, length * rng.uniform(0.14, 0.19),
                  rng.uniform(0.15, 0.5))
    style = rng.random()
    if high and style < 0.3:  # a flying boat: a keel, and a float under each wing
        parts.append(float_hull(length * 0.1, 0, -width * 0.1, length * 0.72, width * 0.8,
                                livery.belly))
        y, top = span * 0.75, z + lift * 0.75
        parts += [mirrored(float_hull(x - root * 0.3, y, -width * 0.2, root, width * 0.28,
                                      livery.belly)),
                  mirrored(strut((x - root * 0.35, y, -width * 0.25), (x - root * 0.35, y, top),
                                 width * 0.1, livery.metal))]
    elif style < 0.75:
        wheel, ground = width * rng.uniform(0.16, 0.22), -width * rng.uniform(0.9, 1.2)
        front = length * 0.36
        y, top = (width * 0.45, -width * 0.2) if high else (span * share, z)
        parts += [mirrored(leg((x - root * 0.6, y, top), (x - root * 0.6, y, ground + wheel),
                               wheel, 1, livery)),
                  leg((front, 0, body.at(front)[0]), (front, 0, ground + wheel), wheel, 1, livery)]
    return parts


def glider(rng: np.random.Generator, livery: Livery) -> list[Mesh]:
    """Return a glider with long thin wings, some with a small propeller."""
    length = rng.uniform(6, 9)
    width = length * rng.uniform(0.085, 0.12)
    body = fuselage(rng, length, width, width * 1.2, rng.uniform(0.2, 0.3),
                    rng.uniform(0.55, 0.65), rng.uniform(0.1, 0.3), rng.uniform(0.45, 0.65))
    span, root = length * rng.uniform(0.8, 1.3), length * rng.uniform(0.11, 0.16)
    x = length * rng.uniform(0.08, 0.15)
    level, _, height = body.at(x)
    canopy = length * rng.uniform(0.24, 0.3)
    at = body.at(canopy)[0]
    parts = [body.skin(livery, rng.uniform(-0.8, 0), -2),
             wing(x, level + height * rng.uniform(0.1, 0.4), span, root, root *
                  rng.uniform(0.3, 0.6), root * rng.uniform(0, 0.4),
                  span * rng.uniform(0.02, 0.08), root * 0.16, livery.wing),
             ellipsoid((canopy, 0, at + height * 0.2), (length * 0.13, width * 0.4, height * 0.36),
                       livery.glass),
             leg((x - root * 0.3, 0, level), (x - root * 0.3, 0, level - height * 0.55),
                 length * 0.025, 1, livery)]
    parts += tail(rng, str(rng.choice(['T', 'V', 'conventional', 'cruciform'], p=[
        0.5, 0.15, 0.25, 0.1])), body, livery, length * rng.uniform(0.13, 0.19),
        rng.uniform(0.05, 0.3))
    if rng.random() < 0.2:
        parts.append(propeller(rng, (length / 2 - 0.05, 0, body.at(length * 0.49)[0]),
                               length * 0.11, 2, length * 0.018, livery))
    return parts


def _single(rng: np.random.Generator, length: float, livery: Livery,
            slenderness: float) -> tuple[Fuselage, list[Mesh], float]:
    """Return a body with one engine in its nose, its skin and propeller, and its width."""
    width = length * slenderness
    height = width * rng.uniform(1.0, 1.35)
    cowling, boxy = rng.uniform(0.45, 0.85), rng.uniform(2, 4)
    shape = np.array([(0.5, cowling * 0.85, cowling * 0.8), (0.46, cowling, cowling),
                      (0.28, 0.95, 0.9), (0.15, 1, 1), (-0.05, 0.95, 1), (-0.25, 0.6, 0.65),
                      (-0.5, rng.uniform(0.08, 0.2), rng.uniform(0.15, 0.35))])
    rise = height * np.array([0, 0, 0, 0, 0.02, 0.1, rng.uniform(0.15, 0.3)])
    body = Fuselage(shape[:, 0] * length, rise, shape[:, 1] * width, shape[:, 2] * height, boxy)
    split = rng.uniform(-0.6, 0.3)
    spinner = width * cowling * rng.uniform(0.15, 0.35)
    blades = int(rng.choice([0, 2, 3, 4], p=[0.08, 0.42, 0.35, 0.15]))
    return body, [body.skin(livery, split, split + rng.uniform(0, 0.5)),
                  propeller(rng, (length / 2, 0, 0), length * rng.uniform(0.12, 0.17), blades,
                            spinner, livery)], width


def _tail_and_gear(rng: np.random.Generator, body: Fuselage, livery: Livery, length: float,
                   x: float, width: float, ground: float) -> list[Mesh]:
    """Return the tail, and wheels below x or floats that reach down to the height of ground."""
    kind = rng.choice(['conventional', 'T', 'cruciform', 'V'], p=[0.8, 0.08, 0.08, 0.04])
    parts = tail(rng, str(kind), body, livery, length * rng.uniform(0.13, 0.19),
                 rng.uniform(0.1, 0.5))
    level = body.at(x)[0]
    style = rng.random()
    if style < 0.18:
        y, wide = width * rng.uniform(0.8, 1.2), length * rng.uniform(0.06, 0.09)
        parts.append(mirrored(float_hull(x, y, ground, length * rng.uniform(0.65, 0.85), wide,
                                         livery.belly)))
        for at in (x + length * 0.12, x - length * 0.12):
            parts.append(mirrored(strut((at, width * 0.2, body.at(at)[0]), (at, y, ground - 0.05),
                                        length * 0.02, livery.metal)))
        return parts
    if style < 0.88:
        radius, y = length * rng.uniform(0.025, 0.045), width * rng.uniform(0.7, 1.3)
        forward = rng.random() < 0.5  # a nose wheel rather than a tail wheel
        at = x - length * 0.05 if forward else x + length * 0.04
        spats = rng.random() < 0.4
        parts.append(mirrored(leg((at, width * 0.15, level), (at, y, ground + radius), radius, 1,
                                  livery, spats)))
        front = length * 0.4
        parts.append(leg((front, 0, body.at(front)[0]), (front, 0, ground + radius), radius, 1,
                         livery, spats) if forward else _tail_wheel(body, length, livery))
    return parts


def _tail_wheel(body: Fuselage, length: float, livery: Livery) -> Mesh:
    x = -length * 0.44
    z, _, height = body.at(x)
    radius = length * 0.02
    return leg((x, 0, z), (x - radius, 0, z - height / 2 - radius * 1.2), radius, 1, livery)
