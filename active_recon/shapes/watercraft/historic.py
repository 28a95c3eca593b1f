"""Sailing ships of old: galleons, ships of the line, longships."""

from active_recon.shapes.common.parts import beam, box, Mesh, mirrored, rod
from active_recon.shapes.watercraft import rig
from active_recon.shapes.watercraft.house import tier
from active_recon.shapes.watercraft.hull import Hull, Livery, Well
import numpy as np


def galleon(rng: np.random.Generator, livery: Livery) -> list[Mesh]:
    """Return a square-rigged ship of wood with castles, gun ports and one to three masts."""
    length = rng.uniform(25, 55)
    hull = Hull(
        length, length * rng.uniform(0.22, 0.3), length * rng.uniform(0.14, 0.2),
        'tumblehome' if rng.random() < 0.6 else 'round', parallel=rng.uniform(0.55, 0.68),
        entry=(rng.uniform(1.3, 1.8), rng.uniform(2.2, 3.0)), run=0.4,
        stern=rng.uniform(0.6, 0.8), tuck=rng.uniform(0.1, 0.4), rake=rng.uniform(0.06, 0.15),
        stem=rng.uniform(1.2, 2.2), counter=rng.uniform(0, 0.05),
        sheer=(rng.uniform(0.1, 0.4), rng.uniform(0.1, 0.6)), rocker=(0.05, rng.uniform(0, 0.2)))
    ports = (0.62, 0.72, int(rng.integers(4, 9))) if rng.random() < 0.7 else None
    parts = [hull.skin(livery, Well(0.04, 0.94, 0.86, length * 0.014), rng.uniform(0.1, 0.35),
                       rng.uniform(0.74, 0.9), ports)]
    castle = hull.depth * rng.uniform(0.15, 0.4)
    poop = 0.0
    if rng.random() < 0.85:
        poop = rng.uniform(0.2, 0.36)
        parts.append(tier(hull, livery, (0.0, poop), 0.6, castle, livery.hull, 0.3 * castle))
        if rng.random() < 0.6:
            parts.append(tier(hull, livery, (0.0, poop * 0.55), 0.6, castle * 2, livery.stripe,
                              0.4 * castle))
        stern = float(hull.half_beam(0, 1)) * 0.8
        x, z = float(hull.x(0, 1)), float(hull.z(0, 1))
        parts.append(box((x - 0.008 * length, -stern, z - 0.1 * hull.depth),
                         (x + 0.02 * length, stern, z + castle * 0.5), livery.accent))
        for y in np.linspace(-0.66, 0.66, 4) * stern:
            parts.append(box((x - 0.012 * length, y - 0.12 * stern, z), (
                x, y + 0.12 * stern, z + castle * 0.38), livery.glass))
    if rng.random() < 0.7:
        parts.append(tier(hull, livery, (rng.uniform(0.76, 0.84), 0.97), 0.6,
                          castle * rng.uniform(0.5, 1), livery.hull))
    count = int(rng.choice([1, 2, 3], p=[0.15, 0.3, 0.55]))
    furled = rng.random() < 0.22
    height = length * rng.uniform(0.55, 0.85)
    thick = length * rng.uniform(0.024, 0.03)
    deck = hull.depth * 0.9
    places = {1: [0.06], 2: [0.2, -0.12], 3: [0.27, 0.02, -0.26]}[count]
    for i, place in enumerate(places):
        tall = height * (1.0 if i == count // 2 else rng.uniform(0.78, 0.92))
        if i == 2 and rng.random() < 0.6:
            parts.append(rig.lateen(rng, livery, place * length, deck, tall * 0.8, 0.24 * length,
                                    thick))
            continue
        parts.append(rig.squares(rng, livery, place * length, deck, tall,
                                 length * rng.uniform(0.38, 0.52) / max(1, count ** 0.4),
                                 int(rng.integers(2, 5)), thick, furled))
    sprit = np.array([0.47 * length, 0, hull.deck(0.47 * length)])
    tip = sprit + length * np.array([rng.uniform(0.14, 0.24), 0, rng.uniform(0.05, 0.12)])
    parts.append(rod(sprit - (tip - sprit) * 0.3, tip, thick * 0.55, livery.wood,
                     end_radius=thick * 0.35, sections=8))
    if rng.random() < 0.65 and not furled:
        x = places[0] * length
        parts.append(rig.headsail(rng, livery, sprit + (tip - sprit) * 0.95,
                                  (x, 0, deck + height * 0.7),
                                  (x + 0.1 * length, 0, deck + 0.1 * height), thick))
    parts.append(hull.rudder(livery.wood))
    return parts


def longship(rng: np.random.Generator, livery: Livery) -> list[Mesh]:
    """Return a longship: high ends, shields along the sides, one square sail, perhaps oars."""
    length = rng.uniform(12, 24)
    rise = rng.uniform(0.8, 2.2)
    hull = Hull(length, length * rng.uniform(0.17, 0.26), length * rng.uniform(0.07, 0.1),
                parallel=0.5, entry=(1.3, 2.0), run=0.5, stern=0.05, tuck=0.9,
                rake=0.05, stem=1.6, counter=0.04, sheer=(rise, rise * rng.uniform(0.7, 1)),
                rocker=(0.4, 0.4))
    parts = [hull.skin(livery, Well(0.08, 0.92, 0.4, length * 0.016), 0.0, 0.85)]
    thick = length / 36
    for end in (-1, 1):
        x = end * length * 0.485
        z = hull.deck(x)
        neck = np.array([x + end * 0.02 * length, 0, z + rng.uniform(0.06, 0.14) * length])
        parts.append(beam((x, 0, z - 0.1 * length), neck, thick, livery.hull, thick * 1.3))
        parts.append(beam(neck - (end * thick * 0.6, 0, thick * 0.2), neck + (end * thick * 1.8, 0,
                          -thick * 0.3), thick, livery.accent, thick, 0.6))
    count = int(rng.integers(5, 10))
    shields, oars = rng.random() < 0.75, rng.random() < 0.5
    for i, x in enumerate(np.linspace(-0.28, 0.28, count) * length):
        y, z = hull.half_deck(x), hull.deck(x) - 0.15 * hull.depth
        if shields:
            color = livery.accent if i % 2 else livery.sail
            parts.append(mirrored(rod((x, y - thick * 0.3, z), (x, y + thick * 0.4, z),
                                      length * 0.025, color, sections=10)))
        if oars and i % 2 == 0:
            out = length * rng.uniform(0.16, 0.2)
            parts.append(mirrored(beam((x, y * 0.8, z + thick * 0.6),
                                       (x - 0.3 * out, y + out, -0.02 * length), thick * 0.55,
                                       livery.wood)))
    furled = rng.random() < 0.15
    sail = rig.squares(rng, livery, 0.0, hull.depth * 0.4, length * rng.uniform(0.5, 0.7),
                       length * rng.uniform(0.35, 0.5), 1, thick, furled)
    parts.append(sail)
    return parts
