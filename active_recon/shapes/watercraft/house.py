"""What stands on decks: houses with windows, funnels, masts, cranes, lifeboats, engines."""

from active_recon.shapes.common.parts import (
    assemble,
    beam,
    box,
    Color,
    ellipsoid,
    loft,
    Mesh,
    mirrored,
    rod,
    superellipse,
)
from active_recon.shapes.common.skin import painted_loft
from active_recon.shapes.watercraft.hull import Hull, Livery
import numpy as np
from numpy.typing import ArrayLike


def house(livery: Livery, x: tuple[float, float], half: tuple[float, float],
          z: tuple[float, float], rows: int = 1, panes: int = 3,
          lean: tuple[float, float] = (0, 0), tumblehome: float = 0.05,
          curve: float = 0.1) -> Mesh:
    """
    Return a block with rows of windows along its sides and across its front.

    x, half and z are pairs: rear and front, half widths there, low and high. Rear and front lean
    inwards by `lean` at the top, in metres; the front bulges by `curve` of the width.
    """
    storeys = (np.arange(rows)[:, None] + [0.35, 0.78]).ravel() / max(rows, 1)
    heights = np.concatenate([[0], storeys, [1]])
    along = np.concatenate([[0.0], np.linspace(0.06, 0.96, 2 * panes), [1.0]])
    across = np.array([-0.5, 0.0, 0.5])
    loops = []
    for share in heights:
        rear, fore = x[0] + lean[0] * share, x[1] - lean[1] * share
        wide = (half[0] + (half[1] - half[0]) * along) * (1 - tumblehome * share)
        bulge = curve * wide[-1]
        side = np.column_stack([rear + (fore - bulge - rear) * along, wide])
        nose = np.column_stack([fore - bulge * (2 * across) ** 2 * 0.5, across * wide[-1]])
        plan = np.vstack([side * [1, -1], nose, side[::-1]])
        loops.append(np.insert(plan, 2, z[0] + (z[1] - z[0]) * share, axis=1))
    count = len(along)
    glazed = np.zeros(2 * count + 3, bool)
    glazed[1:count - 1:2] = True
    glazed[count + 3:-1] = glazed[:count - 1][::-1]
    glazed[count - 1:count + 3] = True
    colors = np.tile(np.asarray(livery.house, np.float64), (len(heights) - 1, len(glazed), 1))
    colors[np.ix_(np.arange(len(heights) - 1) % 2 == 1, glazed)] = livery.glass
    return painted_loft(loops, colors, (livery.house, livery.roof))


def on_deck(hull: Hull, livery: Livery, x: tuple[float, float], height: float,
            share: float = 0.8, rows: int = 1, panes: int = 3, lean: tuple[float, float] = (0, 0),
            curve: float = 0.1, sunk: float = 0.12) -> tuple[Mesh, float]:
    """
    Return a house that follows the hull's plan from x rear to front, and its roof's height.

    Its foot is sunk by a share of the depth, to stand on a well's floor.
    """
    base = min(hull.deck(place) for place in x) - sunk * hull.depth
    high = max(hull.deck(place) for place in x) + height
    rear, fore = (min(hull.half_deck(place) * share, 0.97 * float(
        hull.half_beam(place / hull.length + 0.5, 1 - sunk))) for place in x)
    half = (rear, fore)
    return house(livery, x, half, (base, high), rows, panes, lean, 0.04, curve), high


def tier(hull: Hull, livery: Livery, s: tuple[float, float], low: float, high: float,
         color: Color, rise: float = 0.0) -> Mesh:
    """
    Return a raised deck on the hull's own plan between two s, its foot at v = low.

    Its top is `high` metres over the deck and climbs by `rise` towards the nearer end.
    """
    stations = np.linspace(*s, 7)
    away = np.abs(stations - (s[1] if s[0] < 0.5 else s[0])) / (s[1] - s[0])
    loops = []
    for place, climb in zip(stations, away, strict=True):
        skin = [[float(at(place, v)) for at in (hull.x, hull.half_beam, hull.z)]
                for v in (low, 1.0)]
        edge = np.array([*skin, skin[1]]) * [1, 1.01, 1]
        edge[2, 2] += high + rise * climb
        loops.append(np.vstack([edge * [1, -1, 1], edge[::-1]]))
    colors = np.tile(np.asarray(color, np.float64), (len(loops) - 1, 6, 1))
    colors[:, 2] = livery.deck
    return painted_loft(loops, colors, (color, color))


def funnel(x: float, low: float, height: float, size: tuple[float, float], color: Color,
           band: Color, rake: float = 0.2) -> Mesh:
    """Return a chimney, raked back by its height times rake; size is its length and width."""
    outline = superellipse(*size, 2.4, 12)
    levels = np.array([0, 0.45, 0.75, 1.0])
    loops = [np.insert(outline * (1 - 0.12 * t) + (x - rake * height * t, 0), 2,
                       low + height * t, axis=1) for t in levels]
    colors = np.tile(np.asarray(color, np.float64), (3, 12, 1))
    colors[1] = band
    return painted_loft(loops, colors, (color, (30, 30, 32)))


def mast(rng: np.random.Generator, x: float, low: float, height: float, livery: Livery,
         thick: float) -> Mesh:
    """Return a ship's mast with a yard, a radar bar or domes."""
    parts = [rod((x, 0, low), (x - 0.06 * height, 0, low + height), thick / 2, livery.trim,
                 end_radius=thick * 0.4, sections=8)]
    reach = height * rng.uniform(0.15, 0.3)
    for level in np.linspace(0.55, 0.9, int(rng.integers(1, 4))):
        z, back = low + height * level, x - 0.06 * height * level
        parts.append(box((back - thick / 2, -reach, z - thick * 0.4),
                         (back + thick / 2, reach, z + thick * 0.4), livery.trim))
    if rng.random() < 0.6:
        dome = thick * rng.uniform(0.9, 1.6)
        parts.append(ellipsoid((x - 0.06 * height, 0, low + height), (dome,) * 3, livery.house, 1))
    if rng.random() < 0.4:
        parts.append(beam((x, 0, low), (x - 0.3 * height, 0, low), thick, livery.house))
        parts.append(beam((x - 0.28 * height, 0, low), (x - 0.05 * height, 0, low + height * 0.8),
                          thick * 0.8, livery.trim))
    return assemble(parts)


def crane(x: float, low: float, height: float, jib: float, thick: float, color: Color) -> Mesh:
    """Return a deck crane; the jib points forward where positive."""
    top = low + height
    return assemble([rod((x, 0, low), (x, 0, top), thick, color, sections=10),
                     box((x - 1.4 * thick, -1.4 * thick, top - thick),
                         (x + 1.4 * thick, 1.4 * thick, top + 1.5 * thick), color),
                     beam((x, 0, top), (x + jib, 0, top + 0.3 * abs(jib)), thick, color)])


def lifeboats(x: ArrayLike, y: float, z: float, length: float, color: Color) -> Mesh:
    """Return lifeboats along both sides, hung at the places x."""
    boats = [ellipsoid((place, y, z), (length / 2, length * 0.17, length * 0.19), color, 1)
             for place in np.asarray(x, np.float64)]
    return mirrored(assemble(boats))


def outboard(x: float, y: float, z: float, size: float, color: Color) -> Mesh:
    """Return an outboard engine clamped to a transom at x whose top is at z."""
    z -= 0.25 * size
    cowl = [np.insert(superellipse(size * w, size * 0.62 * w, 3, 10) + (x - size * 0.35, y), 2,
                      z + size * h, axis=1)
            for w, h in ((0.7, -0.1), (0.95, 0.15), (0.9, 0.6), (0.6, 0.85))]
    leg = box((x - size * 0.5, y - size * 0.12, z - size * 1.2),
              (x - size * 0.15, y + size * 0.12, z), (70, 70, 75))
    clamp = box((x - size * 0.35, y - size * 0.2, z - size * 0.4),
                (x + size * 0.15, y + size * 0.2, z + size * 0.15), (60, 60, 64))
    blade = rod((x - size * 0.75, y, z - size * 1.1), (x - size * 0.1, y, z - size * 1.1),
                size * 0.16, (60, 60, 64), end_radius=size * 0.1, sections=8)
    return assemble([loft(cowl, color), leg, clamp, blade])


def canopy(x: tuple[float, float], half: float, low: float, high: float, post: float,
           color: Color, posts: Color) -> Mesh:
    """Return a flat roof on four posts."""
    inner = half - post
    legs = [rod((place, inner, low), (place, inner, high), post / 2, posts, sections=6)
            for place in (x[0] + post, x[1] - post)]
    roof = box((x[0], -half, high - post / 2), (x[1], half, high + post * 0.7), color)
    return assemble([mirrored(assemble(legs)), roof])
