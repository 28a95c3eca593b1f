"""The tails of aeroplanes: conventional, cruciform, T, V, twin fins and fins without a plane."""

from active_recon.shapes.airplane.parts import fin, Fuselage, Livery, panel, wing
from active_recon.shapes.common.parts import Mesh, mirrored
import numpy as np


def tail(rng: np.random.Generator, kind: str, body: Fuselage, livery: Livery, size: float,
         sweep: float) -> list[Mesh]:
    """
    Return fins and tailplane at the rear of a body.

    size is the fin's height in metres; sweep is how far tips go back, of the surface's length.
    """
    end = float(body.x[-1])
    root = size * rng.uniform(0.7, 1.1)
    tip = root * rng.uniform(0.35, 0.75)
    x = end + root * rng.uniform(0.85, 1.1)
    z, width, height = body.at(x - root * 0.6)
    foot = z + height * 0.2
    thick = max(root * 0.1, 0.06 * size)
    span, chord = size * rng.uniform(0.95, 1.5), root * rng.uniform(0.6, 0.85)
    narrow = chord * rng.uniform(0.4, 0.8)
    back = sweep * span
    lift = rng.uniform(-0.02, 0.15) * span
    plane_x = end + chord * rng.uniform(0.95, 1.15)
    if kind == 'V':
        lean, rise = size * rng.uniform(0.7, 1.1), size * rng.uniform(0.6, 0.9)
        return [mirrored(panel([((x, 0, z), root), ((x - sweep * size, lean, z + rise), tip)],
                               thick, (0, rise, -lean), livery.tail))]
    if kind == 'twin':  # fighters: two fins on the body, canted outwards
        y, cant = width * rng.uniform(0.25, 0.45), size * rng.uniform(0, 0.45)
        return [mirrored(fin(x, y, z, size, root, tip, sweep * size, thick, livery.tail, cant)),
                wing(plane_x, z, span * 1.1, chord, narrow, back, 0, thick, livery.wing)]
    if kind == 'H':  # fins at the tailplane's ends
        parts = [wing(plane_x, z, span, chord, chord * 0.9, 0.05 * span, 0, thick, livery.wing)]
        tall = size * rng.uniform(0.5, 0.9)
        for sign in (1, -1):
            parts.append(fin(plane_x, sign * span * 0.97, z - tall * 0.3, tall, chord * 1.05,
                             chord * 0.7, chord * 0.25, thick, livery.tail))
        return parts
    rise = sweep * size * rng.uniform(0.8, 1.2)
    parts = [fin(x, 0, foot, size, root, tip, rise, thick, livery.tail)]
    if rng.random() < 0.4:  # a fillet before the fin
        parts.append(fin(x + root * 0.6, 0, foot, size * 0.3, root, root * 0.2, root * 0.7, thick,
                         livery.tail))
    share = {'T': 0.97, 'cruciform': rng.uniform(0.35, 0.6)}.get(kind)
    if share is None:
        parts.append(wing(plane_x, z, span, chord, narrow, back, lift, thick, livery.wing))
    else:
        edge = x - rise * share + chord * 0.15
        parts.append(wing(edge, foot + size * share, span * 0.9, min(chord, tip * 1.4), narrow,
                          back, 0, thick, livery.wing))
    return parts
