"""Jets that carry people and goods: airliners and high-wing transports."""

from active_recon.shapes.airplane.parts import (
    fin,
    Fuselage,
    fuselage,
    Livery,
    nacelle,
    propeller,
    pylon,
    tricycle,
    wing,
)
from active_recon.shapes.airplane.tails import tail
from active_recon.shapes.common.parts import assemble, box, ellipsoid, Mesh, mirrored
import numpy as np


def airliner(rng: np.random.Generator, livery: Livery) -> list[Mesh]:
    """Return a low-wing jet with engines under the wings, at the tail, or both."""
    length = rng.uniform(16, 60)
    width = length * rng.uniform(0.075, 0.15)
    height = width * rng.uniform(0.95, 1.15)
    body = fuselage(rng, length, width, height, rng.uniform(0.08, 0.2), rng.uniform(0.25, 0.42),
                    rng.uniform(0.1, 0.4), rng.uniform(0.4, 0.65))
    split = rng.uniform(-0.5, 0.1)
    parts = [body.skin(livery, split, split + rng.uniform(0, 0.3), _windscreen(body, width))]
    span = length * rng.uniform(0.4, 0.58)
    root, sweep = length * rng.uniform(0.14, 0.21), span * rng.uniform(0.3, 0.75)
    x, z = length * rng.uniform(0.02, 0.16), -height * rng.uniform(0.2, 0.4)
    tip, lift = root * rng.uniform(0.2, 0.4), span * rng.uniform(0.02, 0.14)
    parts.append(wing(x, z, span, root, tip, sweep, lift, root * 0.12, livery.wing,
                      rng.uniform(0, 1)))
    if rng.random() < 0.4:
        parts.append(_winglets(rng, x - sweep, span, z + lift, tip, length, livery))
    engines = rng.choice(['2', '4', 'tail', 'trijet'], p=[0.5, 0.2, 0.24, 0.06])
    radius = width * rng.uniform(0.2, 0.34)
    shares = {'2': [rng.uniform(0.28, 0.38)], '4': [rng.uniform(0.25, 0.33),
              rng.uniform(0.5, 0.65)], 'trijet': [rng.uniform(0.28, 0.38)]}.get(str(engines), [])
    for share in shares:
        parts.append(mirrored(_underwing(rng, x - sweep * share, span * share, z + lift * share,
                                         root + (tip - root) * share, radius *
                                         (1.15 - 0.4 * (share > 0.45)), livery)))
    kind = rng.choice(['conventional', 'cruciform', 'T'], p=[0.85, 0.1, 0.05])
    if engines == 'tail':
        kind = rng.choice(['T', 'cruciform', 'conventional'], p=[0.8, 0.15, 0.05])
        parts += _rear_engines(rng, body, radius, livery)
    size = length * rng.uniform(0.12, 0.18)
    if engines == 'trijet':
        at = -length * 0.36
        level = body.at(at)[0] + height * 0.45
        parts.append(nacelle((at, 0, level), length * 0.14, radius, livery))
    parts += tail(rng, str(kind), body, livery, size, rng.uniform(0.4, 0.85))
    if rng.random() < 0.12:  # the hump of a second deck
        parts.append(ellipsoid((length * 0.3, 0, height * 0.35), (length * 0.17, width * 0.38,
                               height * 0.4), livery.top))
    if rng.random() < 0.45:
        wheel = width * rng.uniform(0.1, 0.17)
        parts += tricycle(body, x - root * 0.65, width * rng.uniform(0.5, 0.9), z,
                           -height * rng.uniform(0.8, 1.05), wheel, 2, livery)
    return parts


def transport(rng: np.random.Generator, livery: Livery) -> list[Mesh]:
    """Return a fat high-wing military transport with four propellers or jets."""
    length = rng.uniform(20, 45)
    width = length * rng.uniform(0.12, 0.18)
    body = fuselage(rng, length, width, width, rng.uniform(0.1, 0.18), rng.uniform(0.35, 0.45),
                    rng.uniform(0.25, 0.45), rng.uniform(0.4, 0.6), rng.uniform(2, 3.5))
    span, root = length * rng.uniform(0.48, 0.65), length * rng.uniform(0.13, 0.18)
    jets = rng.random() < 0.5
    sweep = span * (rng.uniform(0.25, 0.55) if jets else rng.uniform(0, 0.08))
    x, z = length * rng.uniform(0.08, 0.16), width * 0.46
    tip, lift = root * rng.uniform(0.35, 0.6), span * rng.uniform(-0.1, 0.03)
    parts = [body.skin(livery, -0.4, -0.3, _windscreen(body, width)),
             wing(x, z, span, root, tip, sweep, lift, root * 0.13, livery.wing),
             box((x - root * 1.1, -width * 0.3, z - width * 0.2), (x + root * 0.1, width * 0.3,
                 z + width * 0.07), livery.top)]
    for share in [(0.3, 0.6), (0.35,)][rng.integers(2)]:
        edge = (x - sweep * share, span * share, z + lift * share)
        chord, radius = root + (tip - root) * share, width * rng.uniform(0.13, 0.18)
        if jets:
            parts.append(mirrored(_underwing(rng, *edge, chord, radius, livery)))
        else:
            hub = np.array(edge) + (chord * 0.35, 0, -radius * 0.4)
            parts.append(mirrored(nacelle(hub, chord * 1.2, radius, livery)))
            parts.append(mirrored(propeller(rng, hub, width * rng.uniform(0.45, 0.6),
                                            int(rng.integers(3, 7)), radius * 0.5, livery)))
    kind = 'T' if jets or rng.random() < 0.2 else 'conventional'
    parts += tail(rng, kind, body, livery, length * rng.uniform(0.16, 0.22),
                  rng.uniform(0.15, 0.6))
    parts.append(mirrored(ellipsoid((x - root * 0.7, width * 0.45, -width * 0.35),
                                    (length * 0.12, width * 0.16, width * 0.17), livery.belly)))
    if rng.random() < 0.5:
        parts += tricycle(body, x - root * 0.7, width * 0.48, -width * 0.3, -width * 0.68,
                           width * 0.13, 1, livery)
    return parts


def _windscreen(body: Fuselage, width: float) -> tuple[float, float]:
    """Return the x, rear and front, of the pane where the nose is about half as wide."""
    half = float(np.interp(0.6 * width, body.width[:6], body.x[:6]))
    return half - width * 0.18, half + width * 0.1


def _winglets(rng: np.random.Generator, x: float, y: float, z: float, chord: float,
              length: float, livery: Livery) -> Mesh:
    tall = length * rng.uniform(0.03, 0.06)
    return mirrored(fin(x, y * 0.99, z - chord * 0.05, tall, chord * 0.9, chord * 0.4,
                        tall * rng.uniform(0.5, 1), max(chord * 0.12, length * 0.006),
                        livery.tail, tall * rng.uniform(0, 0.5)))


def _underwing(rng: np.random.Generator, x: float, y: float, z: float, chord: float,
               radius: float, livery: Livery) -> Mesh:
    size = radius * rng.uniform(2.8, 4.2)
    front = x + size * rng.uniform(0.4, 0.65)
    below = z - radius * rng.uniform(1.1, 1.5)
    hanger = pylon(x + radius * 0.3, y, below, z, min(chord * 0.7, size * 0.8), radius * 0.35,
                   livery.wing)
    return assemble([nacelle((front, y, below), size, radius, livery), hanger])


def _rear_engines(rng: np.random.Generator, body: Fuselage, radius: float,
                  livery: Livery) -> list[Mesh]:
    length = float(body.x[0] - body.x[-1])
    x = -length * rng.uniform(0.2, 0.27)
    size = radius * rng.uniform(3.2, 4.8)
    z, width, height = body.at(x - size / 2)
    y, level = width / 2 + radius * rng.uniform(0.9, 1.3), z + height * rng.uniform(0.1, 0.3)
    return [mirrored(nacelle((x, y, level), size, radius, livery)),
            mirrored(box((x - size * 0.8, 0, level - radius * 0.2), (x - size * 0.25, y, level +
                         radius * 0.2), livery.top))]
