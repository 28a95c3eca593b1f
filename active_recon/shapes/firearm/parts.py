"""What firearms are made of: barrels, stocks, grips, magazines and sights, thin in y."""

from typing import NamedTuple

from active_recon.shapes.common.materials import metal, paint, plastic, wood
from active_recon.shapes.common.parts import assemble, beam, box, Color, loft, Mesh, prism, rod
import numpy as np
from numpy.typing import ArrayLike


class Coats(NamedTuple):
    """The colours of the body, of steel, and of what hands hold."""

    body: Color
    metal: Color
    furniture: Color


def draw_coats(rng: np.random.Generator) -> Coats:
    """Return colours that go together: steel and wood, black plastic, camouflage tones, bright."""
    steel = metal(rng) * rng.uniform(0.35, 0.9)
    if rng.random() < 0.42:
        return Coats(steel, metal(rng) * 0.5, wood(rng))
    if rng.random() < 0.2:
        return Coats(paint(rng), steel, plastic(rng))
    held = plastic(rng) * rng.uniform(0.2, 0.8)
    return Coats(steel if rng.random() < 0.5 else held, steel, held)


def plate(outline: ArrayLike, width: float, color: Color) -> Mesh:
    """Return an outline in (x, z), star-shaped about its middle, made thick in y."""
    return prism(outline, -width / 2, width / 2, 'y', color)


def barrel(rng: np.random.Generator, z: float, back: float, muzzle: float, radius: float,
           coats: Coats) -> Mesh:
    """Return a tube along x, plain or with a brake or a silencer at its end."""
    parts = [rod([back, 0, z], [muzzle, 0, z], radius, coats.metal)]
    end = rng.choice(['plain', 'brake', 'silencer', 'cone'], p=[0.45, 0.3, 0.15, 0.1])
    if end == 'brake':
        parts.append(rod([muzzle - 0.05, 0, z], [muzzle + 0.01, 0, z], radius * 1.5, coats.metal))
    elif end == 'silencer':
        parts.append(rod([muzzle - 0.03, 0, z], [muzzle + rng.uniform(0.1, 0.2), 0, z],
                         radius * rng.uniform(1.6, 2.2), coats.body))
    elif end == 'cone':
        parts.append(rod([muzzle - 0.03, 0, z], [muzzle + 0.03, 0, z], radius * 1.1, coats.metal,
                         end_radius=radius * 1.9))
    return assemble(parts)


def grip(rng: np.random.Generator, x: float, z: float, width: float, coats: Coats) -> Mesh:
    """Return a pistol grip below (x, z), leaning back."""
    drop, lean, deep = rng.uniform(0.1, 0.14), rng.uniform(0.01, 0.06), rng.uniform(0.045, 0.06)
    return plate([[x - deep / 2, z + 0.01], [x + deep / 2, z + 0.01],
                  [x + deep / 2 - lean, z - drop], [x - deep / 2 - lean, z - drop * 0.95]],
                 width * 0.8, coats.furniture)


def trigger(x: float, z: float, width: float, coats: Coats, size: float = 1.0) -> Mesh:
    """Return a trigger's guard below (x, z), closed by the trigger itself."""
    reach, drop = 0.03 * size, 0.035 * size
    thick = 0.012 * size ** 0.5
    return assemble([
        beam([x - reach, 0, z + 0.01], [x - reach, 0, z - drop], thick, coats.metal, width * 0.4),
        beam([x + reach, 0, z + 0.01], [x + reach, 0, z - drop], thick, coats.metal, width * 0.4),
        box([x - reach - thick / 2, -width * 0.2, z - drop - thick / 2],
            [x + reach + thick / 2, width * 0.2, z - drop + thick / 2], coats.metal),
        box([x - thick * 0.4, -width * 0.15, z - drop * 0.8], [x + thick * 0.4, width * 0.15,
                                                              z + 0.01], coats.metal)])


def magazine(rng: np.random.Generator, x: float, z: float, width: float, coats: Coats) -> Mesh:
    """Return a magazine below (x, z): straight, bent forwards, short, or a drum."""
    kind = rng.choice(['straight', 'bent', 'short', 'drum'], p=[0.32, 0.42, 0.2, 0.06])
    deep, wide = rng.uniform(0.05, 0.075), width * rng.uniform(0.55, 0.8)
    color = coats.metal if rng.random() < 0.6 else coats.furniture
    if kind == 'drum':
        radius = rng.uniform(0.06, 0.085)
        return assemble([rod([x, -wide, z - radius], [x, wide, z - radius], radius, color,
                             sections=18),
                         box([x - 0.025, -wide / 2, z - radius], [x + 0.025, wide / 2, z + 0.01],
                             color)])
    drop = rng.uniform(0.04, 0.07) if kind == 'short' else rng.uniform(0.13, 0.22)
    bend = rng.uniform(0.03, 0.09) if kind == 'bent' else rng.uniform(-0.01, 0.02)
    loops = []
    for share in np.linspace(0, 1, 5):
        middle, low = x + bend * share ** 1.7, z + 0.015 - (drop + 0.015) * share
        tilt = bend * 0.35 * share
        loops.append([[middle - deep / 2, -wide / 2, low - tilt],
                      [middle + deep / 2, -wide / 2, low + tilt],
                      [middle + deep / 2, wide / 2, low + tilt],
                      [middle - deep / 2, wide / 2, low - tilt]])
    return loft(loops, color)


def stock(rng: np.random.Generator, x: float, width: float, coats: Coats,
          solid: float = 0.5) -> Mesh:
    """Return a shoulder stock behind x: solid, on a tube, a skeleton, or folded wires."""
    length, drop = rng.uniform(0.2, 0.3), rng.uniform(0.0, 0.05)
    tall = rng.uniform(0.05, 0.065)
    end = x - length
    if rng.random() < solid:
        outline = [[x + 0.02, -0.035], [x + 0.02, 0.025], [x - length * 0.3, 0.015 - drop * 0.3],
                   [end, 0.035 - drop], [end - 0.01, -tall * 1.6 - drop],
                   [x - length * 0.35, -0.05 - drop * 0.5]]
        return plate(outline, width * rng.uniform(0.7, 0.95), coats.furniture)
    kind = rng.choice(['tube', 'skeleton', 'wire'])
    pad = box([end - 0.015, -width * 0.4, -tall * 1.5 - drop], [end + 0.02, width * 0.4, 0.03],
              coats.furniture)
    if kind == 'tube':
        rear = plate([[end, 0.02], [x - length * 0.4, 0.02], [x - length * 0.45, -0.035],
                      [end, -tall * 1.4 - drop]], width * 0.7, coats.furniture)
        return assemble([rod([x + 0.02, 0, 0.0], [end + 0.02, 0, 0.0], 0.018, coats.metal), rear,
                         pad])
    thick = 0.022 if kind == 'skeleton' else 0.017
    return assemble([beam([x + 0.02, 0, 0.012], [end, 0, 0.01], thick, coats.metal),
                     beam([x + 0.02, 0, -0.025], [end, 0, -tall * 1.3 - drop], thick,
                          coats.metal), pad])


def sight(rng: np.random.Generator, x: float, z: float, width: float, coats: Coats,
          scope: float = 0.4) -> Mesh:
    """Return what one aims through, on top at z: a telescope, a box, or a carrying handle."""
    if rng.random() < scope:
        length, radius = rng.uniform(0.16, 0.3), rng.uniform(0.016, 0.022)
        up = z + radius * 1.6 + 0.012
        bell = radius * rng.uniform(1.2, 1.7)
        mounts = [box([x + s * length * 0.25 - 0.012, -0.014, z - 0.015],
                      [x + s * length * 0.25 + 0.012, 0.014, up], coats.metal) for s in (-1, 1)]
        return assemble([
            rod([x - length / 2, 0, up], [x + length / 2, 0, up], radius, coats.body),
            rod([x + length * 0.3, 0, up], [x + length / 2 + 0.02, 0, up], radius, coats.body,
                end_radius=bell),
            rod([x - length * 0.32, 0, up], [x - length / 2 - 0.01, 0, up], radius, coats.body,
                end_radius=radius * 1.25), *mounts])
    if rng.random() < 0.5:
        return box([x - 0.04, -width * 0.3, z - 0.01], [x + 0.03, width * 0.3,
                                                       z + rng.uniform(0.03, 0.05)], coats.metal)
    rise = rng.uniform(0.04, 0.06)
    return assemble([box([x - 0.08, -0.014, z + rise - 0.018], [x + 0.09, 0.014, z + rise],
                         coats.body),
                     *(box([x + at - 0.015, -0.014, z - 0.012], [x + at + 0.015, 0.014, z + rise],
                           coats.body) for at in (-0.065, 0.075))])
