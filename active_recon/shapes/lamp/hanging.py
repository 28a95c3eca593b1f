"""Lamps that do not stand on furniture: pendants, chandeliers, sconces, street lamps."""

import math

from active_recon.shapes.common.parts import (
    assemble,
    beam,
    box,
    Color,
    ellipsoid,
    lathe,
    Mesh,
    rod,
)
from active_recon.shapes.lamp.shades import GLOW, HANGING, lantern, shade
from active_recon.shapes.lamp.stands import arc, bent, foot
import numpy as np
from numpy.typing import ArrayLike


def _hung(mesh: Mesh, at: ArrayLike, overlap: float) -> Mesh:
    """Move a part so that its top, on the z axis, is a little above a point."""
    mesh.apply_translation(np.asarray(at) + [0, 0, overlap - mesh.bounds[1, 2]])
    return mesh


def _stood(mesh: Mesh, at: ArrayLike, overlap: float) -> Mesh:
    mesh.apply_translation(np.asarray(at) - [0, 0, overlap + mesh.bounds[0, 2]])
    return mesh


def _head(rng: np.random.Generator, radius: float, cover: Color, accent: Color) -> Mesh:
    """Return one hanging shade or lantern."""
    if rng.random() < 0.15:
        return lantern(rng, radius, radius * rng.uniform(1.6, 2.8), accent, cover)
    return shade(rng, radius, radius * rng.uniform(0.5, 2), cover, accent, HANGING)


def pendant(rng: np.random.Generator, cover: Color, stand: Color, accent: Color) -> Mesh:
    """Return a canopy with one shade or several on cords, or a light flush with the ceiling."""
    kind = rng.choice(['one', 'one', 'one', 'many', 'row', 'flush', 'bowl'])
    radius, thin = rng.uniform(0.1, 0.3), rng.uniform(0.009, 0.014)
    plate = rng.uniform(0.05, 0.12)
    if kind == 'flush':
        profile = {'disc': [[1, 0], [1, 0.35]], 'dome': [[0.2, -0.5], [0.75, -0.25], [1, 0]],
                   'steps': [[0.5, -0.6], [0.5, -0.3], [0.8, -0.3], [0.8, 0]]}[
                       str(rng.choice(['disc', 'dome', 'steps']))]
        sections = int(rng.choice([4, 8, 24]))
        return assemble([lathe(np.array(profile) * radius, cover, sections=sections),
                         lathe([[radius * 1.1, -0.02], [radius * 1.1, 0.04]], accent,
                               sections=sections)])
    if kind == 'bowl':
        drop = radius * rng.uniform(1.8, 3.5)
        thin, plate = thin * 0.8, min(plate, radius * 0.35)
        dish = [[0.1, -0.5], [0.6, -0.4], [0.9, -0.18], [1, 0]]
        rods = [rod([0, 0, drop], [radius * 0.9 * math.cos(a), radius * 0.9 * math.sin(a), -0.01],
                    thin, accent, sections=6) for a in np.arange(3) * 2 * math.pi / 3]
        return assemble([lathe(np.array(dish) * radius, cover), *rods,
                         lathe([[plate, drop - 0.02], [plate, drop + 0.02]], stand)])
    if kind == 'one':
        drop = rng.uniform(0.15, 0.8)
        thick = thin * rng.choice([1, 1.6])
        canopy = lathe([[plate, 0.02], [plate, 0], [plate * rng.uniform(0.3, 1), -0.03]], stand)
        return assemble([canopy, rod([0, 0, 0], [0, 0, -drop], thick, stand, sections=8),
                         _hung(_head(rng, radius, cover, accent), [0, 0, -drop], 0.02)])
    count, small = int(rng.integers(2, 6)), radius * rng.uniform(0.3, 0.6)
    spread = max(small * count * 0.45, 0.15)
    turn = rng.uniform(0, math.pi)
    if kind == 'row':
        spots = [np.array([0, y, 0]) for y in np.linspace(-spread, spread, count) * 1.4]
        canopy = box([-0.05, spots[0][1] - 0.06, -0.02], [0.05, spots[-1][1] + 0.06, 0.02], stand)
    else:
        spots = [spread * np.array([math.cos(a), math.sin(a), 0])
                 for a in turn + np.arange(count) * 2 * math.pi / count]
        canopy = lathe([[spread * 1.2, -0.02], [spread * 1.2, 0.02]], stand)
    drops = np.full(count, rng.uniform(0.3, 0.6))
    if rng.random() < 0.6:
        drops = drops * rng.uniform(0.5, 1.5, count)
    parts, head = [canopy], _head(rng, small, cover, accent)
    for spot, drop in zip(spots, drops, strict=True):
        parts += [rod(spot, spot - [0, 0, drop], thin, accent, sections=6),
                  _hung(head.copy(), spot - [0, 0, drop], 0.015)]
    return assemble(parts)


def chandelier(rng: np.random.Generator, cover: Color, stand: Color, accent: Color) -> Mesh:
    """Return arms round a stem or a hoop, each with a candle, a cup or a small shade."""
    count, reach = int(rng.integers(3, 9)), rng.uniform(0.25, 0.45)
    drop, thin = rng.uniform(0.25, 0.6), rng.uniform(0.01, 0.016)
    plate = rng.uniform(0.05, 0.09)
    parts = [lathe([[plate, drop], [plate, drop - 0.03]], stand),
             rod([0, 0, -0.1], [0, 0, drop], thin, stand, sections=8)]
    if rng.random() < 0.6:
        parts.append(ellipsoid([0, 0, -0.02], [0.05, 0.05, rng.uniform(0.05, 0.12)], accent))
    hoop, style = rng.random() < 0.3, rng.choice(['candle', 'cup', 'ball', 'down'])
    small, bend, rise = rng.uniform(0.05, 0.09), rng.uniform(-0.3, 0.15), rng.uniform(-0.1, 0.15)
    head = {'candle': lambda: assemble([rod([0, 0, 0], [0, 0, 0.1], 0.016, GLOW),
                                        lathe([[0.015, 0], [0.035, 0.015]], stand, sections=10),
                                        ellipsoid([0, 0, 0.12], [0.018, 0.018, 0.03], cover, 1)]),
            'cup': lambda: lathe(np.array([[0.4, 0], [0.9, 0.4], [1, 1], [0.8, 1.3]]) * small,
                                 cover, sections=14),
            'ball': lambda: ellipsoid([0, 0, small], [small] * 3, cover),
            'down': lambda: shade(rng, small, small * 1.4, cover, accent, HANGING)}[str(style)]()
    rounds = 2 if rng.random() < 0.2 else 1
    for tier in range(rounds):
        far, level = reach * (1 - 0.4 * tier), rise + 0.25 * tier * drop
        tips = [np.array([far * math.cos(a), far * math.sin(a), level])
                for a in np.arange(count) * 2 * math.pi / count]
        for i, tip in enumerate(tips):
            if hoop:
                parts.append(rod([0, 0, drop * 0.75], tip, thin * 0.8, accent, sections=6))
                parts.append(beam(tips[i - 1], tip, 3 * thin, stand))
            else:
                parts.append(bent(arc([0, 0, 0.2 * tier * drop], tip, bend, 7), thin, stand, 6))
            place = _hung if style == 'down' else _stood
            parts.append(place(head.copy(), tip, 0.012))
    return assemble(parts)


def sconce(rng: np.random.Generator, cover: Color, stand: Color, accent: Color) -> Mesh:
    """Return a plate on the wall at -x with one or two arms that reach to +x."""
    high, wide = rng.uniform(0.06, 0.2), rng.uniform(0.035, 0.09)
    if rng.random() < 0.5:
        plate = box([-0.015, -wide, -high], [0.015, wide, high], stand)
    else:
        plate = ellipsoid([0, 0, 0], [0.03, wide, high], stand)
    radius, far, thin = rng.uniform(0.05, 0.11), rng.uniform(0.1, 0.25), rng.uniform(0.008, 0.014)
    ys = [0.0] if rng.random() < 0.65 else [-radius * 1.3, radius * 1.3]
    start, end = high * rng.uniform(-0.6, 0.5), rng.uniform(-0.1, 0.1)
    bend, up = rng.uniform(-0.12, 0.12), rng.random() < 0.5
    head = (lantern(rng, radius, radius * 2.6, stand, cover) if rng.random() < 0.3 else
            shade(rng, radius, radius * rng.uniform(1, 2.2), cover, accent, HANGING))
    parts = [plate]
    for y in ys:
        tip = np.array([far, y, start + end])
        parts.append(bent(arc([0, 0, start], tip, bend, 7), thin, accent, 8))
        parts.append((_stood if up else _hung)(head.copy(), tip, thin))
    return assemble(parts)


def street_lamp(rng: np.random.Generator, cover: Color, stand: Color, accent: Color) -> Mesh:
    """Return a pole with a lantern on top, or with one, two or four arms."""
    high, thin = rng.uniform(1.6, 3), rng.uniform(0.03, 0.06)
    size = high * rng.uniform(0.06, 0.13)
    base = foot(rng, high * rng.uniform(0.05, 0.09), high * 0.03, stand)
    square = rng.random() < 0.25
    pole = (beam([0, 0, 0], [0, 0, high], 2 * thin, stand) if square else
            rod([0, 0, 0], [0, 0, high], thin, stand, thin * rng.uniform(0.5, 1)))
    parts = [base, pole]
    if rng.random() < 0.5:
        parts += [lathe([[2 * thin, z], [2 * thin, z + high * 0.03]], accent, sections=12)
                  for z in high * rng.uniform(0.1, 0.95, rng.integers(1, 4))]

    def head() -> Mesh:
        if rng.random() < 0.6:
            return lantern(rng, size, size * 2.2, stand, cover)
        return shade(rng, size, size * rng.uniform(0.8, 1.8), cover, accent, HANGING)

    count = int(rng.choice([0, 1, 1, 2, 2, 4]))
    if count == 0:
        return assemble([*parts, _stood(head(), [0, 0, high], thin)])
    far, level, bend = size * rng.uniform(1.5, 4), high * rng.uniform(0.85, 0.98), rng.choice(
        [0, 0, size, 2 * size])
    flat, one = count < 3 and rng.random() < 0.35, head()
    for angle in np.arange(count) * 2 * math.pi / count + (math.pi / 2 if count == 2 else 0):
        tip = np.array([far * math.cos(angle), far * math.sin(angle), level])
        parts.append(bent(arc([0, 0, level], tip, bend, 8), thin * 0.7, stand, 8))
        if flat:
            out = np.array([math.cos(angle), math.sin(angle), 0]) * size
            parts += [beam(tip - 0.3 * out, tip + 1.5 * out, size * 0.7, cover, size * 0.3, 0.6)]
        else:
            link = size * rng.uniform(0.1, 0.6)
            parts += [rod(tip, tip - [0, 0, link], thin * 0.4, stand, sections=6),
                      _hung(one.copy(), tip - [0, 0, link], thin * 0.5)]
    return assemble(parts)
