"""What closes the bays of a cabinet: drawers, doors, panes, and their handles."""

import math

from active_recon.shapes.cabinet.bays import Bay, carcass, HOLLOW
from active_recon.shapes.cabinet.style import Style
from active_recon.shapes.common.parts import assemble, box, Color, ellipsoid, Mesh, rod
import numpy as np
from numpy.typing import NDArray


def fronts(rng: np.random.Generator, style: Style, bays: list[Bay], x: float,
           depth: float) -> list[Mesh]:
    """Return the fronts of all closed bays of a carcass that ends at x and is depth deep."""
    parts = []
    for index, bay in enumerate(bays):
        if bay.kind == 'open':
            continue
        color = style.fronts[index % len(style.fronts)]
        if bay.kind not in HOLLOW:  # the shadow in the gaps
            parts.append(box([x - style.board, bay.left, bay.low],
                             [x + 0.15 * style.proud, bay.right, bay.high],
                             np.asarray(style.body) * 0.5))
        if bay.kind == 'sliding':
            lap = bay.width * 0.04
            for leaf, lift in ((bay._replace(right=bay.left + bay.width / 2 + lap, side=-1), 1),
                               (bay._replace(left=bay.right - bay.width / 2 - lap, side=1), 0)):
                parts += _door(style, leaf, x + lift * style.proud, color)
        elif bay.kind in ('drawer', 'pulled'):
            out = depth * rng.uniform(0.3, 0.6) if bay.kind == 'pulled' else 0.0
            parts += _drawer(style, bay, x, out, color)
        elif bay.kind == 'ajar':
            hinge = np.array([x - style.board / 2, (bay.left, bay.right)[bay.side < 0], 0])
            parts.append(_swung(assemble(_door(style, bay, x, color)), hinge,
                                rng.uniform(0.5, 1.9) * -bay.side))
        else:
            parts += _door(style, bay, x, color)
    return parts


def fronted(rng: np.random.Generator, style: Style, bays: list[Bay], rear: float,
            front: float) -> list[Mesh]:
    """Return a carcass between x = rear and x = front together with the fronts of its bays."""
    return [*carcass(bays, rear, front, style.board, style.body, style.inside),
            *fronts(rng, style, bays, front, front - rear)]


def _swung(door: Mesh, hinge: NDArray[np.float64], angle: float) -> Mesh:
    """Return a door turned about the vertical through its hinge, counter-clockwise from above."""
    cosine, sine = math.cos(angle), math.sin(angle)
    turn = np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]])
    door.vertices = (door.vertices - hinge) @ turn.T + hinge
    return door


def _drawer(style: Style, bay: Bay, x: float, out: float, color: Color) -> list[Mesh]:
    """Return a drawer's front, its box behind it where it is pulled out."""
    gap, board = style.gap, style.board
    left, right, low, high = bay.left + gap, bay.right - gap, bay.low + gap, bay.high - gap
    face, parts = x + out + style.proud, []
    parts.append(box([x + out - board, left, low], [face, right, high], color))
    if out:
        inner, rim = (left + board, right - board), low + 0.75 * (high - low)
        parts.append(box([x - board, inner[0], low], [x + out, inner[1], low + board],
                         style.inside))
        parts += [box([x - board, y, low], [x + out, y + sign * board, rim], style.inside)
                  for y, sign in zip(inner, (1, -1), strict=True)]
    if style.face in ('frame', 'raised') and bay.height > 6 * board:
        parts.append(_center(style, left, right, low, high, face))
    wide = bay.width > 2.6 * bay.height and bay.width > 20 * style.grip_size
    places = [0.22, 0.78] if wide and style.grip in ('knob', 'plate', 'cup') else [0.5]
    for place in places:
        y = left + (right - left) * place
        parts += _grip(style, face, y, (low + high) / 2, high, right - left, level=True)
    return parts


def _center(style: Style, left: float, right: float, low: float, high: float, x: float) -> Mesh:
    inset = 0.14 * min(right - left, high - low)
    return box([x - style.proud, left + inset, low + inset],
               [x + style.proud * 0.4, right - inset, high - inset], style.panel)


def _door(style: Style, bay: Bay, x: float, color: Color) -> list[Mesh]:
    gap, face = style.gap, x + style.proud
    left, right, low, high = bay.left + gap, bay.right - gap, bay.low + gap, bay.high - gap
    rail = min(0.16 * min(right - left, high - low), 3 * style.board)
    glazed = bay.kind in ('glass', 'mirror')
    framed = style.face in ('frame', 'louvre') or glazed
    parts = [box([x - style.board, left, low],
                 [face - 0.7 * style.proud * framed, right, high],
                 style.glass if glazed else style.panel if framed else color)]
    if framed:
        parts += [box([x - style.board, left, z], [face, right, z + rail], color)
                  for z in (low, high - rail)]
        parts += [box([x - style.board, y, low], [face, y + rail, high], color)
                  for y in (left, right - rail)]
    inner_low, inner_high = low + rail, high - rail
    if bay.kind == 'glass':
        bar, (across, up) = rail / 2, style.panes
        parts += [box([x, y - bar / 2, low], [face, y + bar / 2, high], color)
                  for y in np.linspace(left, right, across + 1)[1:-1]]
        parts += [box([x, left, z - bar / 2], [face, right, z + bar / 2], color)
                  for z in np.linspace(inner_low, inner_high, up + 1)[1:-1]]
    elif style.face == 'louvre' and not glazed:
        slats = np.linspace(inner_low, inner_high, 2 * min(8, 2 + int(bay.height * 8)) + 1)
        parts += [box([x, left, a], [face, right, b], color)
                  for a, b in zip(slats[1:-1:2], slats[2::2], strict=True)]
    elif style.face == 'raised' and not glazed:
        halves = [(low, high)] if bay.height < 1.6 * bay.width else [
            (low, low + 0.45 * (high - low)), (low + 0.45 * (high - low), high)]
        parts += [_center(style, left, right, a, b, face) for a, b in halves]
    elif style.face == 'planks' and not glazed:
        cuts = np.linspace(left, right, 5)
        parts += [box([x, a + rail * 0.1, low], [face + 0.3 * style.proud, b, high],
                      np.asarray(color) * shade)
                  for a, b, shade in zip(cuts[:-1], cuts[1:], (1, 0.86, 0.95, 0.8), strict=True)]
    margin = max(rail / 2, 2 * style.grip_size)
    y = right - margin if bay.side > 0 else left + margin
    z = low + style.grip_level * (high - low)
    return parts + _grip(style, face, y, z, high, high - low, level=False)


def _grip(style: Style, x: float, y: float, z: float, top: float, length: float,
          level: bool) -> list[Mesh]:
    """Return a handle on the plane x; level on drawers, upright on doors length high."""
    size, color, kind = style.grip_size, style.handle, style.grip
    reach = min(max(0.2 * length, 3 * size), 8 * size) / 2
    along = np.array([0, 1, 0] if level else [0, 0, 1])
    at, out = np.array([x, y, z]), np.array([1, 0, 0])
    if kind == 'knob':
        return [ellipsoid(at + out * size * 0.6, [size] * 3, color, 1)]
    if kind == 'plate':
        plate = box(at - [size, size, 1.6 * size], at + [size * 0.25, size, 1.6 * size], color)
        return [plate, ellipsoid(at + out * size * 0.6, [size * 0.8] * 3, color, 1)]
    if kind == 'cup':
        return [ellipsoid(at, size * (1 + out * 0.3 + along), color, 1)]
    if kind == 'bar':
        ends = [at + sign * reach * 0.8 * along for sign in (-1, 1)]
        posts = [rod(end - out * size, end + out * size * 1.5, size * 0.35, color, sections=6)
                 for end in ends]
        middle = at + out * size * 1.4
        return [*posts, rod(middle - reach * along, middle + reach * along, size * 0.45, color,
                            sections=8)]
    half = np.array([size, size * 0.6, size * 0.6])
    if kind == 'block':
        return [box(at - half - reach * along, at + half + reach * along, color)]
    if kind == 'slot' or (kind == 'rail' and not level):
        dark = np.asarray(color) * 0.4
        return [box(at - half - reach * along, at + half * [0.1, 1, 1] + reach * along, dark)]
    if kind == 'rail':
        reach = 0.5 * length
        return [box([x - size, y - reach, top - size], [x + size * 0.9, y + reach, top], color)]
    return []


def left_open(rng: np.random.Generator, bays: list[Bay]) -> list[Bay]:
    """Return the bays with, now and then, one door ajar or one drawer pulled out."""
    if rng.random() > 0.06:
        return bays
    index = int(rng.integers(len(bays)))
    kind = {'door': 'ajar', 'drawer': 'pulled'}.get(bays[index].kind, bays[index].kind)
    return [*bays[:index], bays[index]._replace(kind=kind), *bays[index + 1:]]

