"""Rigs of sailing craft: sails as bellied sheets, masts with yards, fore-and-aft rigs."""

import math

from active_recon.shapes.common.parts import assemble, beam, Color, Mesh, rod
from active_recon.shapes.common.skin import painted_loft
from active_recon.shapes.watercraft.hull import Livery
import numpy as np
from numpy.typing import ArrayLike


def sail(foot: tuple[ArrayLike, ArrayLike], head: tuple[ArrayLike, ArrayLike], belly: ArrayLike,
         thickness: float, colors: tuple[Color, Color], steps: int = 6) -> Mesh:
    """
    Return cloth between a foot and a head, two points each, filled by the wind along belly.

    The colours take turns in stripes from foot to head; the sheet's thickness lies along belly.
    """
    corners = np.array([*foot, *head], np.float64)
    blow = np.asarray(belly, np.float64)
    normal = blow / np.linalg.norm(blow)
    across = np.linspace(0, 1, 6)[:, None]
    loops = []
    for t in np.linspace(0, 1, steps):
        line = ((1 - t) * ((1 - across) * corners[0] + across * corners[1])
                + t * ((1 - across) * corners[2] + across * corners[3]))
        full = line + blow * np.sin(math.pi * across) * (0.35 + 0.65 * math.sin(math.pi * t))
        half = thickness / 2 * normal
        loops.append(np.vstack([full + half, (full - half)[::-1]]))
    stripes = np.array([colors[i % 2] for i in range(steps - 1)], np.float64)
    return painted_loft(loops, np.repeat(stripes[:, None], 12, axis=1), (colors[0], colors[0]))


def _belly(rng: np.random.Generator, depth: float) -> ArrayLike:
    """Return a fore-and-aft sail's fill: to one side, or next to none."""
    return (0, depth * rng.choice([-1, 0.05, 1]), 0)


def bermuda(rng: np.random.Generator, livery: Livery, x: float, low: float, height: float,
            boom: float, thick: float, rake: float = 0.02) -> Mesh:
    """Return a mast at x with its boom and a tall triangular or gaffed mainsail, or it furled."""
    top = (x - rake * height, 0, low + height)
    gooseneck = np.array([x, 0, low + 0.12 * height])
    end = gooseneck - (boom, 0, -0.02 * height)
    parts = [rod((x, 0, low - 0.06 * height), top, thick / 2, livery.trim,
                 end_radius=thick * 0.42, sections=8),
             rod(gooseneck, end, thick * 0.45, livery.trim, sections=8)]
    cloth = thick * 0.45
    kind = rng.choice(['sail', 'gaff', 'furled'], p=[0.68, 0.14, 0.18])
    lift = np.array([0, 0, thick * 0.3])
    if kind == 'furled':
        parts.append(rod(gooseneck + 2 * lift, end + 2 * lift, thick * 0.75, livery.accent,
                         sections=8))
        return assemble(parts)
    belly = _belly(rng, 0.1 * boom)
    second = livery.accent if rng.random() < 0.15 else livery.sail
    if kind == 'gaff':
        throat = np.array([x, 0, low + 0.68 * height])
        peak = throat + (-0.6 * boom, 0, 0.26 * height)
        parts.append(rod(throat, peak, thick * 0.4, livery.wood, sections=8))
        head = (throat, peak)
    else:
        roach = rng.uniform(0.03, 0.16)
        head = (np.array(top), np.array(top) - (roach * boom, 0, 0.01 * height))
    parts.append(sail((gooseneck + lift, end + lift), head, belly, cloth, (livery.sail, second)))
    return assemble(parts)


def headsail(rng: np.random.Generator, livery: Livery, tack: ArrayLike, head: ArrayLike,
             clew: ArrayLike, thick: float) -> Mesh:
    """Return a jib on its stay between the stem and a mast."""
    stay = rod(tack, head, thick * 0.35, livery.trim, sections=6)
    below = np.asarray(head, np.float64) - (0, 0, thick)
    second = livery.accent if rng.random() < 0.12 else livery.sail
    cloth = sail((tack, clew), (below, below - (thick, 0, 0)), _belly(rng, 0.6 * thick),
                 thick * 0.45, (livery.sail, second))
    return assemble([stay, cloth])


def squares(rng: np.random.Generator, livery: Livery, x: float, low: float, height: float,
            width: float, count: int, thick: float, furled: bool) -> Mesh:
    """Return a mast with yards; each pair of them holds a square sail, bellied forward."""
    top = low + height
    parts = [rod((x, 0, low - 0.05 * height), (x, 0, top), thick * 0.6, livery.wood,
                 end_radius=thick * 0.4, sections=8)]
    levels = low + height * np.linspace(0.2, 0.94, count + 1)
    halves = width / 2 * np.linspace(1, rng.uniform(0.5, 0.7), count + 1)
    ahead = np.array([thick * 0.8, 0, 0])
    striped = livery.accent if rng.random() < 0.2 else livery.sail
    lowest = 0 if not furled and rng.random() < 0.6 else 1
    for z, half in zip(levels[lowest:], halves[lowest:], strict=True):
        parts.append(beam((x + ahead[0], -half, z), (x + ahead[0], half, z), thick * 0.8,
                          livery.wood))
        if furled:
            parts.append(rod((x + ahead[0], -half * 0.9, z - thick * 0.4),
                             (x + ahead[0], half * 0.9, z - thick * 0.4), thick * 0.7,
                             livery.sail, sections=8))
    if not furled:
        belly = (0.18 * height / count + thick, 0, 0)
        for i in range(count):
            a, b = halves[i] * 0.93, halves[i + 1] * 0.93
            foot, head = levels[i] + thick * 0.3, levels[i + 1]
            parts.append(sail(
                (ahead + (x, -a, foot), ahead + (x, a, foot)),
                (ahead + (x, -b, head), ahead + (x, b, head)), belly, thick * 0.5,
                (livery.sail, striped)))
            parts.append(beam((x, 0, levels[i + 1] - thick), ahead + (x, 0, levels[i + 1]),
                              thick * 0.8, livery.wood))
    if rng.random() < 0.5:  # the top, a lookout's platform
        z = low + height * 0.52
        parts.append(rod((x, 0, z), (x, 0, z + thick * 1.4), thick, livery.wood,
                         end_radius=thick * 1.5, sections=10))
    return assemble(parts)


def lateen(rng: np.random.Generator, livery: Livery, x: float, low: float, height: float,
           reach: float, thick: float) -> Mesh:
    """Return a mast with a slanting yard and its triangular sail."""
    tip = np.array([x - 0.45 * reach, 0, low + height * 1.05])
    foot = np.array([x + 0.5 * reach, 0, low + height * 0.25])
    clew = np.array([x - 0.5 * reach, 0, low + height * 0.22])
    return assemble([
        rod((x, 0, low - 0.05 * height), (x, 0, low + height * 0.85), thick * 0.55, livery.wood,
            sections=8),
        rod(foot, tip, thick * 0.5, livery.wood, sections=8),
        sail((foot, clew), (tip, tip - (thick, 0, 0)), _belly(rng, 0.1 * reach), thick * 0.45,
             (livery.sail, livery.sail))])
