"""Hulls of boats and ships: lofts from stern to stem, solid, decked with bulwarks, or open."""

from dataclasses import dataclass

from active_recon.shapes.common import materials
from active_recon.shapes.common.parts import Color, ellipsoid, Mesh, prism
from active_recon.shapes.common.skin import painted_loft
import numpy as np
from numpy.typing import ArrayLike, NDArray

# Half of the midship section: (share of the depth above the keel, share of the half beam).
_SECTIONS = {
    'round': [(0, 0.04), (0.1, 0.4), (0.25, 0.7), (0.5, 0.92), (0.75, 1), (1, 1)],
    'vee': [(0, 0.03), (0.36, 0.74), (0.42, 0.84), (0.7, 0.93), (1, 1)],
    'box': [(0, 0.8), (0.05, 0.94), (0.15, 1), (0.5, 1), (1, 1)],
    'flat': [(0, 0.6), (0.06, 0.68), (0.5, 0.86), (1, 1)],
    'tumblehome': [(0, 0.05), (0.08, 0.45), (0.25, 0.85), (0.45, 1), (0.75, 0.93), (1, 0.82)],
}


@dataclass(frozen=True)
class Livery:
    """The colours of a watercraft."""

    hull: Color
    boot: Color  # below the waterline
    stripe: Color  # below the deck's edge
    deck: Color
    inside: Color
    house: Color
    roof: Color
    glass: Color
    trim: Color
    accent: Color
    wood: Color
    sail: Color


@dataclass(frozen=True)
class Well:
    """What is open to the sky: its ends in shares of the length from the stern, its floor's v."""

    rear: float
    front: float
    floor: float
    wall: float  # thickness, in metres


@dataclass(frozen=True)
class Hull:
    """
    The lines of a hull; metres, x from the middle, the keel at z = 0.

    Points of its skin are named by s, the share of the length from stern to stem, and v, the
    share of the height from keel to deck.
    """

    length: float
    beam: float
    depth: float
    section: str = 'round'
    parallel: float = 0.5  # s from where the bow narrows
    entry: tuple[float, float] = (1.3, 2.2)  # of keel and deck: a wedge at 1, bluff at 3
    blunt: float = 0.02  # share of the beam left at the stem
    run: float = 0.35  # s up to where the stern narrows
    stern: float = 0.8  # share of the beam left at the stern
    tuck: float = 0.7  # share of that left at the keel
    rake: float = 0.08  # how far the stem's foot stands back, of the length
    stem: float = 1.0  # a clipper's hollow stem below 1, a spoon's above
    counter: float = 0.03  # how far the stern's foot stands forward, of the length
    sheer: tuple[float, float] = (0.25, 0.05)  # rise of the deck at stem and stern, of the depth
    rocker: tuple[float, float] = (0.05, 0.05)  # rise of the keel there

    def x(self, s: ArrayLike, v: ArrayLike) -> NDArray[np.float64]:
        """Return where the skin's points lie lengthwise."""
        s, down = np.asarray(s, np.float64), 1 - np.asarray(v, np.float64)
        stern = self.counter * down
        return self.length * (stern + s * (1 - self.rake * down ** self.stem - stern) - 0.5)

    def half_beam(self, s: ArrayLike, v: ArrayLike) -> NDArray[np.float64]:
        """Return how far the skin's points lie from the middle plane."""
        s, v = np.asarray(s, np.float64), np.asarray(v, np.float64)
        fore = np.clip((s - self.parallel) / (1 - self.parallel), 0, 1)
        aft = np.clip((self.run - s) / self.run, 0, 1)
        stern = self.stern * (self.tuck + (1 - self.tuck) * v)
        power = self.entry[0] + (self.entry[1] - self.entry[0]) * v
        plan = (1 - (1 - self.blunt) * fore ** power) * (1 - (1 - stern) * aft ** 2)
        levels, breadths = np.transpose(_SECTIONS[self.section])
        breadth = plan * np.interp(v, levels, breadths)
        return np.asarray(self.beam / 2 * np.maximum(breadth, 0.01), np.float64)

    def z(self, s: ArrayLike, v: ArrayLike) -> NDArray[np.float64]:
        """Return the heights of the skin's points."""
        s, v = np.asarray(s, np.float64), np.asarray(v, np.float64)
        fore, aft = np.clip(2 * s - 1, 0, 1), np.clip(1 - 2 * s, 0, 1)
        deck = 1 + self.sheer[0] * fore ** 2 + self.sheer[1] * aft ** 2
        keel = self.rocker[0] * fore ** 4 + self.rocker[1] * aft ** 3
        return np.asarray(self.depth * (keel + v * (deck - keel)), np.float64)

    def deck(self, x: float) -> float:
        """Return the height of the deck at x."""
        return float(self.z(x / self.length + 0.5, 1))

    def half_deck(self, x: float) -> float:
        """Return half the deck's width at x."""
        return float(self.half_beam(x / self.length + 0.5, 1))

    def skin(self, livery: Livery, well: Well | None = None, boot: float = 0.3,
             stripe: float = 0.85, ports: tuple[float, float, int] | None = None) -> Mesh:
        """
        Return the hull as one closed mesh.

        Below v = boot it has the boot's colour, above v = stripe the stripe's. Ports are a row of
        dark openings: lower v, upper v, count.
        """
        bow = self.parallel + (1 - self.parallel) * np.array([0.2, 0.4, 0.6, 0.75, 0.87, 0.95])
        stations = [*np.linspace(0, self.parallel, 6), *bow, 1.0]
        levels = [v for v, _ in _SECTIONS[self.section]] + [boot, stripe]
        edges: list[float] = []
        if ports is not None:
            edges = list(np.linspace(0.1, 0.85, 2 * ports[2]))
            levels += ports[:2]
        if well is not None:
            edges += [well.rear, well.rear + 1e-4, well.front - 1e-4, well.front]
        s, v = np.unique(stations + edges), np.unique(levels)
        grid = np.meshgrid(s, v[::-1], indexing='ij')
        outer = np.stack([self.x(*grid), self.half_beam(*grid), self.z(*grid)], axis=-1)
        port = outer[:, ::-1]
        starboard = outer * [1, -1, 1]
        inner = self._inner(s, well)
        loops = np.concatenate([starboard, port, inner, inner[:, ::-1] * [1, -1, 1]], axis=1)

        middle = (v[:-1] + v[1:]) / 2
        side = np.where((middle < boot)[:, None], livery.boot, np.where(
            (middle > stripe)[:, None], livery.stripe, livery.hull))
        deck = np.tile(np.asarray(livery.deck, np.float64), (5, 1))
        around = np.concatenate([side[::-1], np.atleast_2d(livery.boot), side, deck])
        colors = np.tile(around, (len(s) - 1, 1, 1))
        between = (s[:-1] + s[1:]) / 2
        if well is not None:
            within = (between > well.rear) & (between < well.front)
            colors[within, -5:] = [livery.trim, livery.inside, livery.deck, livery.inside,
                                   livery.trim]
        if ports is not None:
            pane = np.searchsorted(edges[:2 * ports[2]], between) % 2 == 1
            high = np.flatnonzero((middle > ports[0]) & (middle < ports[1]))
            colors[np.ix_(pane, np.concatenate([len(v) - 2 - high, len(v) + high]))] = (
                livery.glass)
        return painted_loft(list(loops), colors, (livery.hull, livery.hull))

    def _inner(self, s: NDArray[np.float64], well: Well | None) -> NDArray[np.float64]:
        """Return the port wall's top and foot, (S, 2, 3); in the deck where there is no well."""
        wall = 0.1 * self.beam if well is None else well.wall
        floor = 1.0 if well is None else well.floor
        levels = np.ones((len(s), 2))
        if well is not None:
            levels[(s > well.rear) & (s < well.front), 1] = floor
        # The floor's edge keeps inside the skin where that is narrower than the deck's edge.
        narrow = np.minimum(self.half_beam(s, floor), self.half_beam(s, 1)) - wall
        half = np.column_stack([self.half_beam(s, 1) - wall, narrow])
        half = np.maximum(half, 0.3 * self.half_beam(s, floor)[:, None])
        across = s[:, None]
        return np.stack([self.x(across, levels), half, self.z(across, levels)], axis=-1)

    def bulb(self, livery: Livery) -> Mesh:
        """Return a cargo ship's bulb under the stem."""
        x = float(self.x(1, 0.15))
        radius = 0.16 * self.depth
        return ellipsoid((x - 0.5 * radius, 0, 1.1 * radius), (2.6 * radius, radius, radius),
                         livery.boot)

    def rudder(self, color: Color) -> Mesh:
        """Return a rudder under the stern."""
        x, thick = float(self.x(0, 0.1)), 0.03 * self.beam
        chord, top = 0.045 * self.length, float(self.z(0, 0.5))
        outline = [(x - chord * 0.6, 0), (x + chord, 0), (x + chord, top), (x - chord * 0.4, top)]
        return prism(outline, -thick, thick, 'y', color)


def livery(rng: np.random.Generator, style: str) -> Livery:
    """Return colours in the style of white yachts, painted ships, grey navies or bare wood."""
    if rng.random() < 0.06:  # an untextured model
        return Livery(*[np.full(3, rng.uniform(90, 225))] * 12)
    white = np.full(3, rng.uniform(215, 255)) - (0, 0, rng.uniform(0, 20))
    paint, wood = materials.paint(rng), materials.wood(rng)
    dark = np.array([rng.uniform(20, 60), rng.uniform(25, 70), rng.uniform(35, 110)])
    red = rng.uniform((100, 20, 15), (180, 60, 50))
    grey = np.full(3, rng.uniform(90, 180)) + (-6, 0, rng.uniform(2, 14))
    planks = np.clip(wood * rng.uniform(0.85, 1.3), 0, 255)
    hull = {'yacht': [white, white, white, dark, paint], 'ship': [paint, paint, dark, white, red],
            'navy': [grey], 'wood': [wood, wood, wood, paint, white]}[style]
    body = hull[rng.integers(len(hull))]
    house = {'yacht': [white, white, body, wood], 'ship': [white, white, white, paint],
             'navy': [grey, grey * 1.1], 'wood': [wood, planks, white]}[style]
    decks = {'yacht': [planks, white, grey * 1.2], 'navy': [grey * 0.7, grey, red * 0.8],
             'ship': [red, grey, np.array([60, 110, 80]), planks], 'wood': [planks, wood]}[style]
    upper = house[rng.integers(len(house))]
    deck = decks[rng.integers(len(decks))]
    boot = [red, dark, body * 0.6, body][rng.integers(4)]
    stripe = [body, body, paint, white][rng.integers(4)] if style != 'navy' else body
    trim = [white, dark, wood, materials.metal(rng)][rng.integers(4)]
    sails = [white, white, rng.uniform((200, 180, 140), (245, 230, 200)), paint, dark]
    return Livery(
        hull=body, boot=boot, stripe=stripe, deck=deck, house=upper, trim=trim, wood=wood,
        inside=[body, deck, white][rng.integers(3)] if style != 'wood' else planks * 0.8,
        roof=upper if rng.random() < 0.6 else [deck, paint, grey][rng.integers(3)],
        glass=materials.glass(rng) * rng.uniform(0.4, 1), accent=materials.paint(rng),
        sail=sails[rng.integers(5)])
