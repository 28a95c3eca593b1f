"""Cabinets: chests of drawers, sideboards, wardrobes, media stands, kitchen and office ones."""

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

from active_recon.shapes.cabinet import layouts, special
from active_recon.shapes.cabinet.bays import Bay, carcass
from active_recon.shapes.cabinet.fronts import fronts, left_open
from active_recon.shapes.cabinet.style import draw_style, Style
from active_recon.shapes.cabinet.trims import base, lift, top
from active_recon.shapes.common.drawing import choose
from active_recon.shapes.common.materials import metal, plastic
from active_recon.shapes.common.parts import assemble, Mesh
from active_recon.shapes.table.legs import Room
import numpy as np

_Range = tuple[float, float]


class _Kind(NamedTuple):
    weight: float
    depth: _Range  # metres
    width: _Range
    height: _Range
    layout: Callable[[np.random.Generator, Bay], list[Bay]]
    bases: str
    tops: str


_FEET = 'none plinth skirting blocks buns brackets tapered square'
_KINDS = {
    'chest': _Kind(17, (0.36, 0.55), (0.4, 1.6), (0.65, 1.35), layouts.chest,
                   f'{_FEET} plinth sled', 'flush slab slab slab cornice gallery'),
    'bedside': _Kind(11, (0.3, 0.5), (0.34, 0.6), (0.4, 0.7), layouts.bedside,
                     f'{_FEET} tapered square sled table table', 'flush slab slab slab gallery'),
    'sideboard': _Kind(16, (0.36, 0.52), (1.1, 2.2), (0.6, 0.95), layouts.sideboard,
                       f'{_FEET} tapered square sled table', 'flush slab slab slab cornice'),
    'media': _Kind(11, (0.35, 0.55), (0.9, 2.2), (0.32, 0.62), layouts.media,
                   'none plinth blocks tapered tapered square sled castors',
                   'flush slab slab'),
    'wardrobe': _Kind(13, (0.45, 0.65), (0.55, 2.4), (1.65, 2.3), layouts.wardrobe,
                      'none plinth plinth skirting blocks buns brackets',
                      'flush flush slab cornice cornice pediment'),
    'kitchen': _Kind(8, (0.5, 0.65), (0.4, 2.0), (0.8, 0.92), layouts.kitchen,
                     'plinth plinth plinth none square', 'worktop'),
    'wall': _Kind(5, (0.18, 0.38), (0.35, 1.2), (0.4, 0.95), layouts.wall_unit,
                  'none', 'flush flush slab cornice'),
    'filing': _Kind(5, (0.42, 0.65), (0.38, 0.95), (0.55, 1.4), layouts.filing,
                    'none none plinth castors', 'flush flush slab'),
    'lockers': _Kind(2, (0.35, 0.5), (0.3, 1.6), (1.4, 1.95), layouts.lockers,
                     'none plinth blocks square', 'flush flush slab'),
    'vitrine': _Kind(5, (0.3, 0.45), (0.5, 1.4), (1.1, 2.1), layouts.vitrine,
                     f'{_FEET} table', 'flush slab cornice cornice pediment'),
}


def cabinet(rng: np.random.Generator) -> Mesh:
    """Return a random cabinet; its doors and drawers are at +x."""
    if rng.random() < 0.16:
        return special.special(rng)
    name = choose(rng, {name: kind.weight for name, kind in _KINDS.items()})
    kind = _KINDS[name]
    room = Room(*(rng.uniform(*limits) for limits in (kind.depth, kind.width, kind.height)))
    style = draw_style(rng, max(room))
    if name in ('filing', 'lockers'):
        style = _of_metal(rng, style)
    stand = rng.choice(kind.bases.split())
    under = min(lift(rng, stand), (0.55 if stand == 'table' else 0.35) * room.height)
    half = style.board / 2
    face = Bay(half - room.width / 2, room.width / 2 - half, under + half, room.height - half)
    bays = left_open(rng, kind.layout(rng, face))
    x = room.depth / 2
    back = None if name == 'media' and rng.random() < 0.25 else style.inside
    foot = [style.body, style.top, style.handle][rng.integers(3)]
    return assemble([
        *carcass(bays, -x, x, style.board, style.body, back),
        *fronts(rng, style, bays, x, room.depth),
        *base(rng, stand, room._replace(height=under), style.board, style.body, foot),
        *top(rng, rng.choice(kind.tops.split()), room, style.board, (style.top, style.body))])


def _of_metal(rng: np.random.Generator, style: Style) -> Style:
    """Return the style with the plain painted sheet of office furniture."""
    coat = [metal, plastic][rng.integers(2)](rng)
    lid = coat * rng.uniform(0.75, 1.1)
    return replace(style, body=coat, inside=coat, top=lid, fronts=(coat * 1.05,), panel=coat,
                   face=rng.choice(['slab', 'slab', 'louvre']),
                   grip=rng.choice(['block', 'cup', 'slot', 'plate', 'bar']))
