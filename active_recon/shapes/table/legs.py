"""Table legs, four (or three) under one top, and what ties them: aprons, stretchers, shelves."""

from collections.abc import Callable
import math
from typing import NamedTuple

from active_recon.shapes.common.parts import (
    assemble,
    beam,
    box,
    Color,
    ellipsoid,
    lathe,
    loft,
    Mesh,
    mirrored,
    rod,
    superellipse,
)
import numpy as np
from numpy.typing import NDArray


class Room(NamedTuple):
    """The box under a table top that its base may fill, centred on the z axis, floor at 0."""

    depth: float  # along x
    width: float  # along y
    height: float


class Leg(NamedTuple):
    """One leg, at the corner (+x, +y): where it meets the top, where the floor, how thick."""

    head: NDArray[np.float64]
    foot: NDArray[np.float64]
    thickness: float


_Maker = Callable[[np.random.Generator, Leg, Color], Mesh]


def fourfold(mesh: Mesh) -> Mesh:
    """Return a part at the corner (+x, +y) with its twins at the three other corners."""
    twin = mesh.copy()
    twin.apply_transform(np.diag([-1.0, 1.0, 1.0, 1.0]))
    return mirrored(assemble([mesh, twin]))


def thickness(rng: np.random.Generator, room: Room, low: float = 0.025,
              high: float = 0.09) -> float:
    """Return a bar's thickness that suits the table's size, slim ones more often."""
    return float(max(room) * low * (high / low) ** rng.random())


def turned(rng: np.random.Generator, height: float, radius: float, color: Color,
           beads: int = 5) -> Mesh:
    """Return a turned post on the z axis: random beads and necks, at most radius wide."""
    levels = np.sort(rng.uniform(0.05, 0.95, beads))
    radii = radius * rng.uniform(0.4, 1, beads)
    profile = np.column_stack([radii, height * levels])
    ends = [[radius * rng.uniform(0.5, 1), 0]], [[radius * rng.uniform(0.6, 1), height]]
    return lathe(np.vstack([ends[0], profile, ends[1]]), color, sections=14)


def _square(rng: np.random.Generator, leg: Leg, color: Color) -> Mesh:
    return beam(leg.head, leg.foot, leg.thickness, color, end_scale=rng.choice([1, 1, 0.6, 0.4]))


def _round(rng: np.random.Generator, leg: Leg, color: Color) -> Mesh:
    radius = leg.thickness / 2
    return rod(leg.head, leg.foot, radius, color, radius * rng.choice([1, 0.7, 0.5]))


def _blade(rng: np.random.Generator, leg: Leg, color: Color) -> Mesh:
    wide = leg.thickness * rng.uniform(1.6, 3)
    across, along = (wide, leg.thickness) if rng.random() < 0.5 else (leg.thickness, wide)
    return beam(leg.head, leg.foot, across, color, along, rng.uniform(0.5, 1))


def _corner(rng: np.random.Generator, leg: Leg, color: Color) -> Mesh:
    wide, thin = leg.thickness * rng.uniform(2, 3.2), leg.thickness * 0.6
    (x, y, top), half = leg.head, leg.thickness / 2
    return assemble([
        box([x + half - wide, y + half - thin, 0], [x + half, y + half, top], color),
        box([x + half - thin, y + half - wide, 0], [x + half, y + half, top], color)])


def _turned(rng: np.random.Generator, leg: Leg, color: Color) -> Mesh:
    x, y, height = leg.head
    block, half = height * rng.uniform(0.1, 0.25), leg.thickness / 2
    post = turned(rng, height - block, half * 1.1, color, int(rng.integers(3, 8)))
    post.apply_translation([x, y, 0])
    return assemble([post, box([x - half, y - half, height - block],
                               [x + half, y + half, height], color)])


def _cabriole(rng: np.random.Generator, leg: Leg, color: Color) -> Mesh:
    (x, y, height), bend = leg.head, rng.uniform(0.5, 1.2)
    bulge = bend * min(leg.thickness, 0.1 * height)
    loops = []
    for level in np.linspace(1, 0, 8):
        out = bulge * math.sin(2 * math.pi * level ** 0.8 + math.pi)
        wide = leg.thickness * (0.55 + 0.75 * level ** 2 + 0.5 * max(0, 0.15 - level))
        flat = superellipse(wide, wide, 3, 10) + [x + out, y + out]
        loops.append(np.column_stack([flat, np.full(10, height * level)]))
    return loft(loops, color)


def _hairpin(rng: np.random.Generator, leg: Leg, color: Color) -> Mesh:
    radius = max(0.22 * leg.thickness, leg.head[2] / 70)
    spread = leg.head[2] * rng.uniform(0.15, 0.3)
    parts = [rod(leg.head - offset, leg.foot, radius, color, sections=8)
             for offset in ([spread, 0, 0], [0, spread, 0])]
    return assemble([*parts, ellipsoid(leg.foot, [radius * 1.6] * 3, color, 1)])


def _castor(rng: np.random.Generator, leg: Leg, color: Color) -> Mesh:
    wheel = max(leg.thickness * rng.uniform(0.5, 0.8), 0.02)
    x, y, top = leg.head
    axle = np.array([x, y, wheel])
    return assemble([rod(leg.head, axle, leg.thickness / 2, color),
                     rod(axle - [0, wheel / 2, 0], axle + [0, wheel / 2, 0], wheel, [40] * 3)])


_UPRIGHT: list[_Maker] = [
    _square, _square, _square, _round, _round, _blade, _corner, _turned, _turned, _cabriole,
    _hairpin, _castor]
_SPLAYED: list[_Maker] = [_square, _round, _round, _blade]


def legs(rng: np.random.Generator, room: Room, color: Color, accent: Color) -> Mesh:
    """Return four legs at the corners of the room, often with aprons, stretchers or a shelf."""
    thick = thickness(rng, room)
    splayed = rng.random() < 0.3
    head = np.array([room.depth / 2 - thick / 2, room.width / 2 - thick / 2, room.height])
    if splayed:
        foot = np.append(head[:2], 0)
        out = room.height * rng.uniform(0.08, 0.28)
        head[:2] -= np.minimum(out * np.array([1, 1]), head[:2] * 0.6)
        make = _SPLAYED[rng.integers(len(_SPLAYED))]
    else:
        foot = np.append(head[:2], 0)
        make = _UPRIGHT[rng.integers(len(_UPRIGHT))]
    leg = Leg(head, foot, thick)
    parts = [fourfold(make(rng, leg, color))]
    if rng.random() < 0.6:
        parts.append(_apron(rng, room, leg, accent if rng.random() < 0.5 else color))
    if make not in (_hairpin, _cabriole) and rng.random() < 0.45:
        parts.append(_ties(rng, room, leg, color, accent))
    return assemble(parts)


def three_legs(rng: np.random.Generator, room: Room, color: Color, accent: Color) -> Mesh:
    """Return three legs round the z axis, straight, splayed, or crossing like a tripod's."""
    radius, thick = min(room.depth, room.width) / 2, thickness(rng, room, 0.03)
    top = radius * rng.choice([-0.6, 0.1, 0.4, 0.85])
    turn = rng.choice([0, math.pi])
    parts = []
    for angle in turn + np.arange(3) * 2 * math.pi / 3:
        out = np.array([math.cos(angle), math.sin(angle), 0])
        parts.append(rod(out * top + [0, 0, room.height], out * (radius - thick / 2), thick / 2,
                         color))
    if rng.random() < 0.4 and top > 0.2 * radius:
        level = rng.uniform(0.2, 0.5)
        reach = radius + (top - radius) * level
        low = level * room.height
        parts.append(lathe([[reach, low], [reach, low + thick * 0.6]], accent))
    return assemble(parts)


def _apron(rng: np.random.Generator, room: Room, leg: Leg, color: Color) -> Mesh:
    """Return the boards between the legs' heads."""
    low = room.height * (1 - rng.uniform(0.08, 0.22))
    thin = leg.thickness * rng.uniform(0.4, 0.9)
    x, y, top = leg.head
    boards = [box([x - thin / 2, -y, low], [x + thin / 2, y, top], color),
              box([-x, y - thin / 2, low], [x, y + thin / 2, top], color)]
    return fourfold(assemble(boards))


def _ties(rng: np.random.Generator, room: Room, leg: Leg, color: Color, accent: Color) -> Mesh:
    """Return what joins the legs near the floor: a box, an H, a cross, a board or slats."""
    level = rng.uniform(0.08, 0.4)
    x, y, z = leg.foot + (leg.head - leg.foot) * level
    thin = leg.thickness * rng.uniform(0.5, 0.9)
    kind = rng.choice(['box', 'h', 'cross', 'shelf', 'slats', 'back'])
    if kind == 'box':
        return fourfold(assemble([beam([x, -y, z], [x, y, z], thin, color),
                                  beam([-x, y, z], [x, y, z], thin, color)]))
    if kind == 'h':
        return assemble([mirrored(beam([-x, y, z], [x, y, z], thin, color)),
                         beam([0, -y, z], [0, y, z], thin, color)])
    if kind == 'cross':
        return mirrored(beam([-x, -y, z], [x, y, z], thin, color))
    if kind == 'shelf':
        return box([-x, -y, z - thin / 2], [x, y, z + thin / 2], accent)
    if kind == 'slats':
        count = int(rng.integers(3, 7))
        rails = mirrored(beam([-x, y, z], [x, y, z], thin, color))
        half = x / count * rng.uniform(0.5, 0.8)
        return assemble([rails, *(box([s - half, -y, z - thin / 2], [s + half, y, z + thin / 2],
                                      accent)
                                  for s in np.linspace(-x + half, x - half, count))])
    return assemble([mirrored(beam([-x, y, z], [x, y, z], thin, color)),
                     beam([-x, -y, z], [-x, y, z], thin, color)])


def ring(radius: float, level: float, thin: float, color: Color) -> Mesh:
    """Return a round bar bent to a level ring about the z axis."""
    section = superellipse(thin, thin, points=6) + [radius, level]
    mesh = lathe(np.vstack([section, section[:1]]), color)
    sides = len(mesh.faces) - 2 * 24  # the ends meet: drop their caps
    mesh.update_faces(np.arange(len(mesh.faces)) < sides)
    mesh.merge_vertices()
    return mesh
