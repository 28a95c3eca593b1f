"""Craft that sail: yachts, dinghies, schooners; and catamarans."""

from active_recon.shapes.common.parts import beam, box, Mesh, mirrored, prism, rod
from active_recon.shapes.watercraft import rig
from active_recon.shapes.watercraft.house import house, on_deck
from active_recon.shapes.watercraft.hull import Hull, Livery, Well
import numpy as np


def sailing_yacht(rng: np.random.Generator, livery: Livery) -> list[Mesh]:
    """Return a sloop, a ketch, a schooner or an open dinghy with its fore-and-aft rig."""
    kind = rng.choice(['sloop', 'two masts', 'dinghy', 'cat'], p=[0.6, 0.16, 0.14, 0.1])
    small = kind in ('dinghy', 'cat')
    length = rng.uniform(3, 5.5) if small else rng.uniform(8, 24)
    hull = Hull(
        length, length * rng.uniform(0.22, 0.32) * (1.2 if small else 1),
        length * rng.uniform(0.1, 0.15), parallel=rng.uniform(0.35, 0.5),
        entry=(1.2, rng.uniform(1.6, 2.1)), run=rng.uniform(0.3, 0.55),
        stern=rng.uniform(0.3, 0.9), tuck=rng.uniform(0.15, 0.6), rake=rng.uniform(0, 0.2),
        stem=rng.uniform(0.8, 1.6), counter=rng.uniform(-0.03, 0.16),
        sheer=(rng.uniform(0.05, 0.45), rng.uniform(0, 0.2)),
        rocker=(rng.uniform(0.1, 0.5), rng.uniform(0.1, 0.6)))
    aft, fore = (0.06, rng.uniform(0.5, 0.9)) if small else (rng.choice([0.01, 0.08]), 0.33)
    parts = [hull.skin(livery, Well(aft, fore, 0.25 if small else 0.55, length * 0.022),
                       rng.uniform(0, 0.45), rng.choice([0.82, 0.9]))]
    height = length * rng.uniform(0.95, 1.4)
    thick = max(length, height) / 38
    masts = [(rng.uniform(0.02, 0.12), 1.0)]
    if kind == 'cat':
        masts = [(0.32, 1.0)]
    elif kind == 'two masts':
        masts = [(0.18, 1.0), (-0.2, rng.uniform(0.65, 1.0))]
    roof = hull.depth
    if not small:
        cabin, roof = on_deck(hull, livery, (-0.16 * length, rng.uniform(0.1, 0.24) * length),
                              length * rng.uniform(0.03, 0.06), 0.62, 1, int(rng.integers(2, 5)),
                              (0, 0.05 * length), 0.3)
        parts.append(cabin)
    for share, tall in masts:
        x = share * length
        boom = (masts[0][0] - masts[-1][0] - 0.04 if (share, tall) != masts[-1] else
                min(share + 0.47, rng.uniform(0.38, 0.46))) * length
        parts.append(rig.bermuda(rng, livery, x, roof * 0.95, (height - roof) * tall, boom,
                                 thick))
    x = masts[0][0] * length
    if kind != 'cat' and rng.random() < 0.8:
        tack = np.array([length * 0.485, 0, hull.deck(0.485 * length)])
        reach = rng.uniform(0.75, 1.0)
        head = np.array([x, 0, roof * 0.95 + (height - roof) * reach * 0.99])
        overlap = rng.uniform(-0.1, 0.12) * length
        clew = (x - overlap if overlap < 0 else x - min(overlap, 0.3 * length), thick * 1.1,
                hull.depth + thick * 1.5)
        if rng.random() < 0.2:  # a bowsprit
            tip = tack + (0.13 * length, 0, 0.02 * length)
            parts.append(rod(tack - (0.06 * length, 0, 0), tip + (thick * 0.5, 0, 0), thick * 0.5,
                             livery.wood, sections=8))
            tack = tip
        if rng.random() < 0.8:
            parts.append(rig.headsail(rng, livery, tack, head, clew, thick))
        else:
            parts.append(rod(tack, head, thick * 0.5, livery.accent, sections=8))
    if rng.random() < 0.7:
        parts += _keel(rng, hull, livery)
    return parts


def _keel(rng: np.random.Generator, hull: Hull, livery: Livery) -> list[Mesh]:
    length, deep = hull.length, hull.length * rng.uniform(0.05, 0.16)
    top, thick = hull.depth * 0.25, length * 0.014
    wide, chord = rng.uniform(0.07, 0.2) * length, rng.uniform(0.05, 0.14) * length
    x = rng.uniform(-0.05, 0.05) * length
    parts = [prism([(x - wide / 2, top), (x - chord / 2, -deep), (x + chord * 0.4, -deep),
                    (x + wide / 2, top)], -thick, thick, 'y', livery.boot)]
    back = -0.43 * length
    foot = back + 0.01 * length
    parts.append(prism([(back - 0.01 * length, hull.depth * 0.7), (foot, -deep * 0.6),
                        (foot + 0.05 * length, -deep * 0.6), (back + 0.06 * length,
                                                             hull.depth * 0.7)],
                       -thick * 0.8, thick * 0.8, 'y', livery.trim))
    return parts


def catamaran(rng: np.random.Generator, livery: Livery) -> list[Mesh]:
    """Return two slim hulls joined by a trampoline, a cabin or a fast ferry's saloon."""
    kind = rng.choice(['beach', 'cruising', 'motor', 'ferry'], p=[0.25, 0.4, 0.15, 0.2])
    length = {'beach': 5.0, 'cruising': 13.0, 'motor': 14.0, 'ferry': 35.0}[kind]
    length *= rng.uniform(0.85, 1.2)
    hull = Hull(length, length * rng.uniform(0.09, 0.13), length * rng.uniform(0.1, 0.14),
                parallel=rng.uniform(0.35, 0.55), entry=(1.3, 2.0), run=0.4,
                stern=rng.uniform(0.5, 0.9), rake=rng.uniform(-0.03, 0.08),
                counter=rng.uniform(-0.06, 0.06), sheer=(rng.uniform(0, 0.2), 0),
                rocker=(rng.uniform(0.1, 0.4), rng.uniform(0, 0.4)))
    y = length * rng.uniform(0.19, 0.25)
    side = hull.skin(livery, None, rng.uniform(0.15, 0.35), 0.85)
    side.apply_translation((0, y, 0))
    parts = [mirrored(side)]
    inner, deck = y - hull.beam * 0.2, hull.depth
    roof = deck
    if kind == 'beach':
        low, high = deck * 0.85, deck * 1.05
        for x in (-0.25, 0.12):
            parts.append(beam((x * length, -y, high), (x * length, y, high), length / 36,
                              livery.trim))
        parts.append(box((-0.25 * length, -inner, low + 0.1 * deck), (0.12 * length, inner, high),
                         livery.accent))
    else:
        rows = 1 if kind != 'ferry' else int(rng.integers(1, 3))
        front = length * rng.uniform(0.12, 0.25) * (1.4 if kind == 'ferry' else 1)
        rear = length * rng.uniform(-0.46, -0.4)
        parts.append(box((rear, -inner, deck * 0.55), (front, inner, deck), livery.hull))
        roof = deck + length * rng.uniform(0.08, 0.11) * (1 if rows == 1 else 1.6)
        cabin = (rear + length * rng.uniform(0.02, 0.16), front - length * 0.02)
        wide = y + hull.beam * rng.uniform(-0.1, 0.35)
        parts.append(house(livery, cabin, (wide, wide * 0.92), (deck * 0.85, roof), rows,
                           int(rng.integers(1, 8)), (0, rng.uniform(0.04, 0.12) * length), 0.12,
                           rng.uniform(0.1, 0.4)))
        if kind != 'cruising' or rng.random() < 0.3:
            x = rng.uniform(-0.15, 0.05) * length
            parts.append(house(livery, (x - 0.1 * length, x + 0.08 * length), (y * 0.6, y * 0.5),
                               (roof - 0.01 * length, roof + 0.06 * length), 1, 2,
                               (0, 0.03 * length)))
        if kind == 'cruising':
            net = deck * 0.8
            parts.append(box((front - 0.02 * length, -inner, net), (0.32 * length, inner,
                             net + length * 0.016), livery.trim))
    if kind in ('beach', 'cruising'):
        height = length * rng.uniform(1.1, 1.45)
        thick, x = max(length, height) / 38, rng.uniform(0.02, 0.1) * length
        parts.append(rig.bermuda(rng, livery, x, roof * 0.95, height - roof, 0.4 * length, thick))
        tack = np.array([0.34 * length, 0, deck])
        parts.append(beam((0.34 * length, -y, deck), (0.34 * length, y, deck), length / 38,
                          livery.trim))
        if rng.random() < 0.8:
            parts.append(rig.headsail(rng, livery, tack, (x, 0, height * rng.uniform(0.75, 0.97)),
                                      (x + 0.03 * length, 0, roof + thick), thick))
    return parts
