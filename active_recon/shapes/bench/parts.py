"""What benches are made of: seats of planks, backs, arms, and what carries them."""

from typing import NamedTuple

from active_recon.shapes.common.parts import assemble, beam, box, Color, Mesh, mirrored, rod, tube
from active_recon.shapes.common.soft_parts import tilted
from active_recon.shapes.table.legs import legs, Room
import numpy as np


class Seat(NamedTuple):
    """Where one sits: metres along x and y, the height of its top, a plank's thickness."""

    depth: float
    length: float
    height: float
    thick: float


def seat(rng: np.random.Generator, place: Seat, color: Color) -> Mesh:
    """Return the seat: one board, planks along it, or slats across."""
    x, y, z = place.depth / 2, place.length / 2, place.height
    low = z - place.thick
    kind = rng.choice(['board', 'planks', 'slats', 'thick'], p=[0.25, 0.5, 0.12, 0.13])
    if kind == 'board':
        return box([-x, -y, low], [x, y, z], color)
    if kind == 'thick':
        return box([-x, -y, z - place.thick * rng.uniform(1.6, 3)], [x, y, z], color)
    if kind == 'planks':
        return assemble([*_strips(rng, x, y, low, z, color, int(rng.integers(2, 7)), 0),
                         *(box([-x * 0.95, s * y - 0.04, low - place.thick * 0.7],
                               [x * 0.95, s * y + 0.04, low + 0.01], color)
                           for s in (-0.8, 0.0, 0.8))])
    rails = [box([s * x * 0.75 - 0.035, -y, low - place.thick], [s * x * 0.75 + 0.035, y,
                 low + 0.01], color) for s in (-1, 1)]
    return assemble([*rails, *_strips(rng, x, y, low, z, color, int(rng.integers(8, 18)), 1)])


def _strips(rng: np.random.Generator, x: float, y: float, low: float, high: float, color: Color,
            count: int, axis: int) -> list[Mesh]:
    """Return strips side by side across an axis (0: they run along y), with gaps between."""
    reach = (x, y)[axis]
    edges = np.linspace(-reach, reach, count + 1)
    gap = 2 * reach / count * rng.choice([0.1, 0.2, 0.35])
    strips = []
    for a, b in zip(edges[:-1], edges[1:], strict=True):
        shade = np.asarray(color) * rng.uniform(0.88, 1.08)
        corners = [[a + gap / 2, -y, low], [b - gap / 2, y, high]] if axis == 0 else [
            [-x, a + gap / 2, low], [x, b - gap / 2, high]]
        strips.append(box(corners[0], corners[1], shade))
    return strips


def back(rng: np.random.Generator, place: Seat, color: Color, frame: Color) -> Mesh:
    """Return the back, at -x and leaning: planks, slats, a panel, bars or a crossed lattice."""
    x, y, z = -place.depth / 2, place.length / 2, place.height
    rise, thick = rng.uniform(0.3, 0.55), place.thick * 0.9
    posts = assemble([box([x - thick / 2, s * y - thick, z - place.thick],
                          [x + thick, s * y + thick, z + rise], frame)
                      for s in ((-0.92, 0.92) if y < 0.8 else (-0.92, 0.0, 0.92))])
    kind = rng.choice(['planks', 'slats', 'panel', 'rail', 'cross', 'arched'],
                      p=[0.4, 0.22, 0.15, 0.06, 0.09, 0.08])
    low = z + rng.uniform(0.02, 0.14)
    top = z + rise
    parts = [posts]
    if kind in ('planks', 'rail'):
        count = 1 if kind == 'rail' else int(rng.integers(2, 5))
        edges = np.linspace(top - 0.14 if kind == 'rail' else low, top, count + 1)
        gap = (edges[1] - edges[0]) * (0 if count == 1 else rng.uniform(0.12, 0.4))
        parts += [box([x, -y, a + gap / 2], [x + thick, y, b - gap / 2],
                      np.asarray(color) * rng.uniform(0.9, 1.08))
                  for a, b in zip(edges[:-1], edges[1:], strict=True)]
    elif kind == 'panel':
        parts.append(box([x, -y, low], [x + thick, y, top], color))
    else:
        peak = rng.uniform(0.08, 0.2) if kind == 'arched' else 0.0
        across = np.linspace(-y, y, 9)
        crest = top + peak * (1 - (across / y) ** 2)
        parts += [beam([x + thick / 2, a, ha], [x + thick / 2, b, hb], thick, color, thick * 1.6)
                  for a, b, ha, hb in zip(across[:-1], across[1:], crest[:-1], crest[1:],
                                          strict=True)]
        parts.append(box([x, -y, low - thick], [x + thick, y, low + thick * 0.4], color))
        if kind == 'cross':
            bays = np.linspace(-y, y, int(rng.integers(2, 5)))
            for a, b in zip(bays[:-1], bays[1:], strict=True):
                for ends in ((low, top), (top, low)):
                    parts.append(beam([x + thick / 2, a, ends[0]], [x + thick / 2, b, ends[1]],
                                      thick, color))
        else:
            wide = rng.uniform(0.02, 0.05)
            for at in np.linspace(-y * 0.95, y * 0.95, int(rng.integers(7, 20))):
                height = top + peak * (1 - (at / y) ** 2)
                parts.append(box([x, at - wide / 2, low - thick], [x + thick * 0.8, at + wide / 2,
                                                                  height], color))
    return tilted(assemble(parts), [x, 0, z - place.thick / 2], rng.uniform(0, 0.28))


def arms(rng: np.random.Generator, place: Seat, color: Color) -> Mesh:
    """Return an arm at each end: a rail on a post, a bent tube, or a closed side."""
    x, y, z = place.depth / 2, place.length / 2, place.height
    rise, thick = rng.uniform(0.18, 0.27), place.thick
    kind = rng.choice(['rail', 'tube', 'panel'], p=[0.6, 0.25, 0.15])
    inner = y - thick
    if kind == 'panel':
        return mirrored(box([-x, inner, z - thick], [x * 0.95, y, z + rise], color))
    if kind == 'tube':
        path = [[x * 0.9, inner, z - thick / 2], [x * 0.95, inner, z + rise * 0.8],
                [x * 0.7, inner, z + rise], [-x, inner, z + rise],
                [-x - 0.02, inner, z - thick / 2]]
        return mirrored(tube(path, thick * 0.55, color))
    post = beam([x * 0.85, inner, z - thick / 2], [x * 0.85, inner, z + rise], thick, color)
    rail = box([-x - 0.05, inner - thick * 0.8, z + rise - thick / 2],
               [x * rng.uniform(0.9, 1.1), inner + thick * 0.8, z + rise + thick / 2], color)
    rear = beam([-x, inner, z - thick / 2], [-x, inner, z + rise], thick, color)
    return mirrored(assemble([post, rail, rear]))


def supports(rng: np.random.Generator, place: Seat, color: Color) -> Mesh:
    """Return what carries the seat: legs, end panels, trestles, loops of metal, or a pedestal."""
    x, y, thick = place.depth / 2, place.length / 2, place.thick
    top = place.height - thick * 0.7
    kind = rng.choice(['legs', 'panels', 'trestle', 'loops', 'cast'],
                      p=[0.36, 0.18, 0.14, 0.18, 0.14])
    if kind == 'legs':
        return legs(rng, Room(place.depth * 0.96, place.length * 0.95, top), color, color)
    out = y * rng.uniform(0.7, 0.95)
    if kind == 'panels':
        half = rng.uniform(0.03, 0.05)
        parts = [mirrored(box([-x * 0.9, out - half, 0], [x * 0.9, out + half, top + 0.01],
                              color))]
    elif kind == 'trestle':
        spread = rng.uniform(0.7, 1)
        leg = assemble([beam([s * x * 0.2, out, top], [s * x * spread, out, 0], thick * 1.3, color)
                        for s in (-1, 1)])
        bar = box([-x * 0.6, out - thick / 2, top - 0.06], [x * 0.6, out + thick / 2, top + 0.01],
                  color)
        parts = [mirrored(assemble([leg, bar]))]
    elif kind == 'loops':
        loop = [[-x * 0.85, out, top], [-x * 0.85, out, thick / 2], [x * 0.85, out, thick / 2],
                [x * 0.85, out, top]]
        parts = [mirrored(tube(loop, thick * 0.5, color))]
    else:  # cast feet: bowed legs that meet under the seat
        leg = assemble([tube([[s * x * 0.1, out, top], [s * x * 0.6, out, top * 0.75],
                              [s * x * 0.55, out, top * 0.3], [s * x, out, thick * 0.4]],
                             thick * 0.6, color) for s in (-1, 1)])
        parts = [mirrored(leg)]
    if rng.random() < 0.5:
        low = top * rng.uniform(0.25, 0.6)
        parts.append(rod([0, -out, top * 0.97], [0, out, top * 0.97], thick * 0.5, color))
        if kind == 'panels':
            parts.append(beam([0, -out, low], [0, out, low], thick, color))
    return assemble(parts)
