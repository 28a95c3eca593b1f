"""What beds share: head and foot boards, bases, and all that lies on them."""

from dataclasses import dataclass
import math

from active_recon.shapes.common.parts import (
    assemble,
    beam,
    box,
    Color,
    ellipsoid,
    lathe,
    Mesh,
    mirrored,
)
from active_recon.shapes.common.soft_parts import cushion, tilted, wall
import numpy as np


@dataclass(frozen=True)
class Plan:
    """A bed's measures in metres: its head at -length / 2, its foot at +length / 2."""

    length: float
    width: float
    deck: float  # what the mattress lies on
    thick: float  # of the mattress

    @property
    def top(self) -> float:
        """The height of the mattress's upper side."""
        return self.deck + self.thick


@dataclass(frozen=True)
class Livery:
    """A bed's colours."""

    frame: Color
    panel: Color
    metal: Color
    mattress: Color
    pillow: Color
    blanket: Color
    throw: Color


def post(rng: np.random.Generator, x: float, y: float, height: float, thick: float,
         turned: bool, color: Color) -> Mesh:
    """Return a post standing on z = 0: square, or turned, with a ball on it."""
    if not turned:
        return box((x - thick / 2, y - thick / 2, 0), (x + thick / 2, y + thick / 2, height),
                   color)
    levels = np.linspace(0, height, 9)
    swell = thick * np.where(np.arange(9) % 2 == int(rng.integers(2)), 0.5, 0.7)
    shaft = lathe(np.column_stack([swell, levels]), color, (x, y, 0), 10)
    return assemble([shaft, ellipsoid((x, y, height + 0.5 * thick), (0.85 * thick,) * 3, color,
                                      1)])


def board(rng: np.random.Generator, kind: str, x: float, half: float, low: float, high: float,
          livery: Livery) -> Mesh:
    """
    Return a head or foot board between x - 0.04 and x + 0.04, half wide to each side.

    Kinds: panel, framed, slats, rails, arched, spindles, padded, tufted, winged.
    """
    thick = 0.08
    near, far = x - thick / 2, x + thick / 2
    color, panel = livery.frame, livery.panel
    if kind == 'arched':
        y = np.linspace(-half, half, 13)
        rise = (high - low) * rng.uniform(0.2, 0.4)
        shape = (1 - (y / half) ** 2 if rng.random() < 0.6
                 else 0.5 - 0.5 * np.cos(2 * math.pi * (y + half) / (2 * half)))
        path = np.column_stack([np.full(13, x), y])
        return wall(path, low, high - rise + rise * shape, thick, panel)
    if kind in ('padded', 'winged', 'tufted'):
        parts = [cushion((near - 0.01, -half, low), (far + 0.02, half, high), panel, 0.04)]
        if kind == 'winged':
            parts.append(mirrored(cushion((near, half - 0.09, low), (far + 0.22, half, high),
                                          panel, 0.03)))
        if kind == 'tufted':
            across, up = int(rng.integers(2, 8)), int(rng.integers(1, 4))
            y, z = np.linspace(-half, half, across + 1), np.linspace(low, high, up + 1)
            shade = np.asarray(panel) * rng.uniform(0.85, 1.1)
            parts += [cushion((x, a + 0.01, c + 0.01), (far + 0.045, b - 0.01, d - 0.01), shade,
                              0.03) for a, b in zip(y[:-1], y[1:], strict=True)
                      for c, d in zip(z[:-1], z[1:], strict=True)]
        return assemble(parts)
    if kind == 'panel':
        return box((near, -half, low), (far, half, high), panel)
    rim = rng.uniform(0.06, 0.11)
    parts = [box((near, -half, high - rim), (far, half, high), color),
             box((near, -half, low), (far, half, low + rim), color),
             mirrored(box((near, half - rim, low), (far, half, high), color))]
    if kind == 'framed':
        parts.append(box((x - 0.02, -half, low), (x + 0.02, half, high), panel))
        if half > 0.6 and rng.random() < 0.6:
            parts.append(box((near, -rim / 2, low), (far, rim / 2, high), color))
    elif kind == 'rails':
        count = max(2, round((high - low) / 0.17))
        for z in np.linspace(low, high - rim, count + 1)[1:-1]:
            parts.append(box((x - 0.025, -half, z), (x + 0.025, half, z + rim), panel))
    else:
        wide = 0.045 if kind == 'spindles' else rng.uniform(0.07, 0.12)
        count = max(3, round(2 * half / (wide * rng.uniform(1.8, 2.6))))
        for y in np.linspace(-half + rim / 2, half - rim / 2, count + 1)[1:-1]:
            parts.append(box((x - 0.025, y - wide / 2, low), (x + 0.025, y + wide / 2, high),
                             panel))
    return assemble(parts)


def base(rng: np.random.Generator, kind: str, plan: Plan, livery: Livery) -> list[Mesh]:
    """Return what carries the mattress: 'legs', 'rails', 'box', 'drawers', or 'platform'."""
    x, y, deck = plan.length / 2, plan.width / 2, plan.deck
    color = livery.frame
    if kind in ('box', 'drawers'):
        plinth = rng.choice([0.0, 0.05])
        parts = [box((-x, -y, plinth), (x, y, deck), livery.panel if kind == 'box' else color)]
        if plinth:
            parts.append(box((-x + 0.06, -y + 0.06, 0), (x - 0.06, y - 0.06, plinth + 0.02),
                             livery.metal))
        if kind == 'drawers':
            edges = np.linspace(-x + 0.05, x - 0.05, int(rng.integers(2, 4)) + 1)
            for a, b in zip(edges[:-1], edges[1:], strict=True):
                middle, z = (a + b) / 2, (plinth + deck) / 2
                parts.append(mirrored(assemble([
                    box((a + 0.03, y - 0.02, plinth + 0.03), (b - 0.03, y + 0.03, deck - 0.04),
                        livery.panel),
                    box((middle - 0.08, y + 0.02, z - 0.015), (middle + 0.08, y + 0.055,
                                                               z + 0.02), livery.metal)])))
        return parts
    rail = rng.uniform(0.1, 0.2) if kind == 'rails' else 0.09
    rail = min(rail, 0.6 * deck)
    parts = [box((-x, -y + 0.02, deck - 0.06), (x, y - 0.02, deck), livery.panel),
             mirrored(box((-x, y - 0.05, deck - rail), (x, y, deck + 0.03), color)),
             box((-x, -y, deck - rail), (-x + 0.05, y, deck + 0.03), color),
             box((x - 0.05, -y, deck - rail), (x, y, deck + 0.03), color)]
    inset = 0.05
    if kind == 'platform':
        inset = rng.uniform(0.15, 0.35)
        parts.append(box((-x - 0.05, -y - 0.06, deck - rail), (x + 0.08, y + 0.06, deck), color))
    thick = rng.uniform(0.06, 0.1)
    slant = rng.choice([0.0, 0.08])
    places = [-x + inset, x - inset]
    if plan.length > 1.9 and rng.random() < 0.3:
        places.insert(1, 0.0)
    for at in places:
        out = np.array([np.sign(at) * slant * 0.4, slant * 0.4, 0])
        parts.append(mirrored(beam((at, y - inset, deck - 0.05),
                                   np.array([at, y - inset, 0]) + out, thick,
                                   livery.metal if kind == 'legs' else color,
                                   end_scale=rng.choice([1, 0.6]))))
    return parts


def bedding(rng: np.random.Generator, plan: Plan, livery: Livery) -> list[Mesh]:
    """Return the mattress and, often, pillows, a blanket, a throw across the foot."""
    x, y, top, deck = plan.length / 2 - 0.03, plan.width / 2 - 0.03, plan.top, plan.deck
    parts = [cushion((-x, -y, deck - 0.02), (x, y, top), livery.mattress, 0.05)]
    if rng.random() < 0.9:
        parts += _pillows(rng, -x, y, top, livery)
    if rng.random() < 0.8:
        start = -x + rng.uniform(0.4, 0.75) if rng.random() < 0.8 else -x + 0.02
        drop = rng.uniform(0.1, plan.thick) if rng.random() < 0.75 else 0.05
        low = max(top - drop, deck - 0.05)
        rise = rng.uniform(0.025, 0.07)
        parts.append(cushion((start, -y - 0.035, low), (x + 0.03, y + 0.035, top + rise),
                             livery.blanket, 0.04))
        if start > -x + 0.1 and rng.random() < 0.5:  # its edge turned back
            parts.append(cushion((start - 0.03, -y - 0.045, low),
                                 (start + 0.22, y + 0.045, top + rise + 0.03), livery.pillow,
                                 0.03))
    if rng.random() < 0.35:
        low = top - rng.uniform(0.1, plan.thick + 0.1)
        end = x - rng.uniform(0.1, 0.3)
        parts.append(cushion((end - rng.uniform(0.35, 0.6), -y - 0.055, low),
                             (end, y + 0.055, top + 0.09), livery.throw, 0.03))
    return parts


def _pillows(rng: np.random.Generator, head: float, half: float, top: float,
             livery: Livery) -> list[Mesh]:
    count = 1 if half < 0.6 else 2
    room = 2 * half / count
    wide = room * rng.uniform(0.7, 0.92)
    steep = rng.choice([0.1, 0.5, 1.0], p=[0.6, 0.2, 0.2])
    parts = []
    for layer in range(1 + int(rng.random() < 0.3)):
        color = livery.pillow if layer == 0 else livery.throw
        size = 0.42 - 0.1 * layer
        for index in range(count):
            y = -half + room * (index + 0.5)
            start = head + 0.02 + 0.12 * layer
            pillow = cushion((start, y - wide / 2, top - 0.03),
                             (start + size, y + wide / 2, top + 0.1 + 0.03 * layer), color, 0.06,
                             0.03)
            parts.append(tilted(pillow, (start + 0.5 * size, y, top), steep)
                         if steep < 0.2 else
                         tilted(pillow, (start + 0.15, y, top + 0.05), steep))
    return parts
