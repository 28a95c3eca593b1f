"""What a flat screen stands on: plates, discs, V feet, arms, rings, frames and twin feet."""

import math
from typing import NamedTuple

from active_recon.shapes.common.materials import metal, plastic
from active_recon.shapes.common.parts import (
    assemble,
    beam,
    box,
    Color,
    lathe,
    Mesh,
    mirrored,
    prism,
    rod,
    superellipse,
    tube,
)
import numpy as np


class Screen(NamedTuple):
    """A flat panel about the origin: metres along y, along z and along x."""

    width: float
    height: float
    depth: float


def stand(rng: np.random.Generator, screen: Screen, case: Color, tall: bool = False) -> Mesh:
    """Return a random stand for a panel, with its foot below it."""
    color = [case, case, metal(rng), plastic(rng)][rng.integers(4)]
    if rng.random() < (0.12 if tall else 0.4):
        return _twin_feet(rng, screen, color)
    clear = screen.height / 2 + rng.uniform(0.04, 0.24 if tall else 0.12)
    reach = min(screen.width, 0.9) * rng.uniform(0.22, 0.42)
    deep = reach * rng.uniform(0.55, 0.95)
    foot = [_plate, _disc, _vee, _ring, _frame][rng.choice(5, p=[0.38, 0.24, 0.16, 0.08, 0.14])]
    return assemble([foot(rng, -clear, deep, reach, color), _neck(rng, screen, -clear, color)])


def _neck(rng: np.random.Generator, screen: Screen, floor: float, color: Color) -> Mesh:
    """Return what carries the panel: from its back down to the foot at the z axis."""
    kind = rng.choice(['post', 'flat', 'bent', 'column', 'two'], p=[0.25, 0.35, 0.15, 0.15, 0.1])
    back = -screen.depth / 2
    top = -screen.height / 2 * rng.uniform(-0.1, 0.8)
    thick = rng.uniform(0.025, 0.05)
    if kind == 'flat':
        wide = rng.uniform(0.08, 0.3)
        return prism([[-wide / 2, top], [wide / 2, top],
                      [wide / 2 * rng.uniform(0.7, 1.4), floor + 0.01],
                      [-wide / 2 * rng.uniform(0.7, 1.4), floor + 0.01]],
                     back - thick, back + 0.01, 'x', color)
    if kind == 'bent':
        away = rng.uniform(0.05, 0.14)
        return tube([[back + 0.01, 0, top], [back - away, 0, top - 0.02],
                     [back - away, 0, (top + floor) / 2], [0, 0, floor + 0.01]], thick, color)
    if kind == 'column':
        return assemble([rod([back - thick * 0.6, 0, top], [back - thick * 0.6, 0, floor + 0.005],
                             thick * 1.2, color),
                         box([back - thick, -0.06, top - 0.05], [back + 0.01, 0.06, top + 0.05],
                             color)])
    if kind == 'two':
        apart = rng.uniform(0.06, 0.2)
        return mirrored(beam([back - thick / 2 + 0.005, apart, top],
                             [back - thick / 2 + 0.005, apart * rng.uniform(0.5, 1), floor + 0.01],
                             thick, color))
    return beam([back - thick / 2 + 0.008, 0, top], [back - thick / 2 + 0.008, 0, floor + 0.008],
                thick * rng.uniform(1.5, 3), color, thick)


def _plate(rng: np.random.Generator, floor: float, deep: float, reach: float,
           color: Color) -> Mesh:
    thick = rng.uniform(0.02, 0.05)
    if rng.random() < 0.5:
        return box([-deep * 0.5, -reach, floor - thick], [deep * 0.5, reach, floor + 0.01], color)
    flat = superellipse(deep, reach * 2, rng.uniform(2.5, 8), 24)
    return prism(flat, floor - thick, floor + 0.01, 'z', color)


def _disc(rng: np.random.Generator, floor: float, deep: float, reach: float,
          color: Color) -> Mesh:
    radius = reach * rng.uniform(0.6, 0.9)
    rise = rng.uniform(0.02, 0.05)
    return lathe([[radius * rng.uniform(0.2, 0.8), floor + 0.012], [radius, floor - rise * 0.4],
                  [radius, floor - rise]], color, sections=24)


def _vee(rng: np.random.Generator, floor: float, deep: float, reach: float,
         color: Color) -> Mesh:
    thick = rng.uniform(0.025, 0.045)
    ahead = deep * rng.uniform(0.5, 0.9)
    legs = [mirrored(beam([-0.04, 0, floor], [ahead, reach, floor], thick, color))]
    if rng.random() < 0.6:
        legs.append(mirrored(beam([-0.02, 0, floor], [-ahead * 0.6, reach * 0.6, floor], thick,
                                  color)))
    legs.append(box([-0.08, -0.05, floor - thick / 2], [0.05, 0.05, floor + thick / 2], color))
    return assemble(legs)


def _ring(rng: np.random.Generator, floor: float, deep: float, reach: float,
          color: Color) -> Mesh:
    angles = np.linspace(0, 2 * math.pi, 21)
    radius = reach * 0.7
    path = np.column_stack([deep * 0.6 * np.cos(angles), radius * np.sin(angles),
                            np.full(len(angles), floor)])
    spoke = beam([-deep * 0.6, 0, floor], [deep * 0.6, 0, floor], 0.04, color)
    return assemble([tube(path, rng.uniform(0.014, 0.022), color, 8), spoke])


def _frame(rng: np.random.Generator, floor: float, deep: float, reach: float,
           color: Color) -> Mesh:
    thick = rng.uniform(0.025, 0.04)
    back = -deep * 0.4
    bar = beam([back, -reach, floor], [back, reach, floor], thick, color)
    side = beam([back, reach, floor], [deep * 0.6, reach, floor], thick, color)
    middle = beam([back, 0, floor], [0.02, 0, floor], thick * 2, color, thick)
    return assemble([bar, mirrored(side), middle])


def _twin_feet(rng: np.random.Generator, screen: Screen, color: Color) -> Mesh:
    """Return a foot near each end of the panel, as televisions have."""
    out = screen.width / 2 * rng.uniform(0.5, 0.92)
    under = -screen.height / 2
    drop = rng.uniform(0.03, 0.1)
    deep = rng.uniform(0.09, 0.2)
    thick = rng.uniform(0.022, 0.04)
    if rng.random() < 0.5:  # an inverted V
        foot = assemble([beam([0, out, under + 0.02], [side * deep, out, under - drop], thick,
                              color) for side in (-1, 1)])
    else:
        foot = assemble([
            beam([0, out, under + 0.02], [0, out * rng.uniform(0.9, 1.05), under - drop], thick,
                 color),
            box([-deep, out * 0.9 - thick, under - drop - thick / 2],
                [deep, out + thick, under - drop + thick / 2], color)])
    return mirrored(foot)
