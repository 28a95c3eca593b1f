"""What chairs stand on: legs, sleds, runners, blocks; and the seat that all is built round."""

from collections.abc import Callable
from dataclasses import dataclass
import math

from active_recon.shapes.common.parts import beam, box, Color, lathe, Mesh, mirrored, rod, tube
from active_recon.shapes.common.soft_parts import filleted, smoothed, wall
import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Seat:
    """The seat a chair is built round, its middle above the origin; metres."""

    width: float
    back_width: float
    depth: float
    top: float
    thickness: float
    is_round: bool = False
    stoutness: float = 1.0  # what the thickness of legs and posts is multiplied by

    @property
    def bottom(self) -> float:
        return self.top - self.thickness

    @property
    def back_x(self) -> float:
        """Where the back stands: on a round seat its posts stand in from the rim."""
        return -0.32 * self.depth if self.is_round else 0.02 - self.depth / 2

    @property
    def back_span(self) -> float:
        """The width between the middles of the back's posts."""
        return 0.7 * self.width if self.is_round else self.back_width - 0.035 * self.stoutness

    def corners(self, inset: float) -> NDArray[np.float64]:
        """Return where legs meet the seat: front left, front right, back right, back left."""
        if self.is_round:
            reach = 0.7 * (self.width / 2 - inset)
            return reach * np.array([[1, 1], [1, -1], [-1, -1], [-1, 1]])
        x = self.depth / 2 - inset
        front, back = self.width / 2 - inset, self.back_width / 2 - inset
        return np.array([[x, front], [x, -front], [-x, -back], [-x, back]])


Base = Callable[[np.random.Generator, Seat, Color], list[Mesh]]


def legs(rng: np.random.Generator, seat: Seat, color: Color) -> list[Mesh]:
    """Return four legs, straight, tapered, turned or splayed, with or without stretchers."""
    width = rng.uniform(0.028, 0.055) * seat.stoutness
    tops = np.column_stack([seat.corners(width / 2 + rng.uniform(0, 0.03)), np.full(4, seat.top
                           - 0.4 * seat.thickness)])
    feet = tops * [1, 1, 0]
    if rng.random() < 0.5:
        feet[:, :2] += rng.uniform(0.01, 0.09, 2) * np.sign(feet[:, :2])
    elif rng.random() < 0.5:
        feet[2:, 0] -= rng.uniform(0.03, 0.09)
    style = rng.choice(['square', 'round', 'tapered', 'cone', 'turned'])
    parts = [_leg(style, top, foot, width, color) for top, foot in zip(tops, feet, strict=True)]
    if rng.random() < 0.35 and not seat.is_round:
        low = seat.bottom - rng.uniform(0.03, 0.07)
        parts += [beam(a * [1, 1, 0] + [0, 0, (low + seat.bottom) / 2],
                       b * [1, 1, 0] + [0, 0, (low + seat.bottom) / 2], 0.6 * width, color,
                       height=seat.bottom - low + 0.01)
                  for a, b in zip(tops, np.roll(tops, -1, axis=0), strict=True)]
    return parts + stretchers(rng, tops, feet, 0.55 * width, color)


def stretchers(rng: np.random.Generator, tops: NDArray[np.float64], feet: NDArray[np.float64],
               width: float, color: Color) -> list[Mesh]:
    """Return the bars between four legs, (4, 3) each end: none, an H, a box, or a cross."""
    share = rng.uniform(0.2, 0.5)
    front_left, front_right, back_right, back_left = feet + share * (tops - feet)
    bar = beam if rng.random() < 0.5 else rod
    width = max(width, 0.02)
    size = width if bar is beam else width / 2
    sides = [(front_left, back_left), (front_right, back_right)]
    pairs = {
        'none': [],
        'h': [*sides, ((front_left + back_left) / 2, (front_right + back_right) / 2)],
        'box': [*sides, (front_left, front_right), (back_left, back_right)],
        'front': [(front_left, front_right)],
        'sides': sides,
        'cross': [(front_left, back_right), (front_right, back_left)],
    }
    kind = rng.choice(list(pairs), p=[0.45, 0.15, 0.2, 0.07, 0.08, 0.05])
    return [bar(a, b, size, color) for a, b in pairs[kind]]


def tripod(rng: np.random.Generator, seat: Seat, color: Color) -> list[Mesh]:
    """Return three splayed legs under a seat."""
    reach = 0.34 * min(seat.width, seat.depth)
    spread = rng.uniform(1.0, 1.5)
    width = rng.uniform(0.03, 0.06) * seat.stoutness
    parts = []
    for angle in math.pi + np.arange(3) * 2 * math.pi / 3:
        out = reach * np.array([math.cos(angle), math.sin(angle), 0])
        parts.append(_leg('cone', out + [0, 0, seat.bottom + 0.01], spread * out, width, color))
    return parts


def sled(rng: np.random.Generator, seat: Seat, color: Color) -> list[Mesh]:
    """Return a bent tube on each side that runs along the floor, and bars across."""
    radius = rng.uniform(0.011, 0.018)
    x, y = seat.depth / 2 - 0.03, min(seat.width, seat.back_width) / 2 - 0.02
    top, reach = seat.bottom + 0.005, rng.uniform(0.95, 1.3)
    path = filleted([[0.8 * x, y, top], [reach * x, y, radius], [-reach * x, y, radius],
                     [-0.8 * x, y, top]], rng.uniform(0.02, 0.12))
    bars = [rod([s * 0.8 * x, -y, top], [s * 0.8 * x, y, top], radius, color) for s in (-1, 1)]
    return [mirrored(tube(path, radius, color, sections=8)), *bars]


def cantilever(rng: np.random.Generator, seat: Seat, color: Color) -> list[Mesh]:
    """Return the tube of a seat that hangs from its front: nothing stands under its back."""
    radius = rng.uniform(0.012, 0.02)
    x, y = seat.depth / 2, min(seat.width, seat.back_width) / 2 - 0.02
    top = seat.bottom - 0.3 * radius
    path = filleted([[-x, y, top], [x, y, top], [0.95 * x, y, radius], [-x, y, radius],
                     [-x, 0, radius]], rng.uniform(0.04, 0.12))
    return [mirrored(tube(path, radius, color, sections=8)),
            rod([-0.7 * x, -y, top], [-0.7 * x, y, top], radius, color)]


def hairpins(rng: np.random.Generator, seat: Seat, color: Color) -> list[Mesh]:
    """Return legs of two thin rods each that meet at the foot."""
    radius = rng.uniform(0.009, 0.014)
    splay = rng.uniform(1.0, 1.25)
    parts = []
    for x, y in seat.corners(0.05):
        foot = [splay * x, splay * y, 0]
        for dx, dy in ((-0.06 * np.sign(x), 0), (0, -0.06 * np.sign(y))):
            parts.append(rod([x + dx, y + dy, seat.bottom + 0.005], foot, radius, color))
    return parts


def scissors(rng: np.random.Generator, seat: Seat, color: Color) -> list[Mesh]:
    """Return folding legs that cross on each side, with bars across."""
    radius = rng.uniform(0.011, 0.02) * seat.stoutness
    x, y = seat.depth / 2 - 0.03, seat.back_width / 2 - 0.03
    top, foot = seat.bottom + 0.005, rng.uniform(0.9, 1.2)
    parts = []
    for s in (-1, 1):
        parts.append(mirrored(beam([s * x, y, top], [-s * foot * x, y, 0], 2 * radius, color)))
        parts += [rod([s * x, -y, top], [s * x, y, top], radius, color),
                  rod([0.9 * s * foot * x, -y, 0.05 * top], [0.9 * s * foot * x, y, 0.05 * top],
                      radius, color)]
    return parts


def rockers(rng: np.random.Generator, seat: Seat, color: Color) -> list[Mesh]:
    """Return four legs on two bent runners."""
    width = rng.uniform(0.03, 0.045)
    bend, reach = rng.uniform(0.25, 0.5), rng.uniform(0.38, 0.5)
    runner_x = np.linspace(-reach - 0.08, reach, 9)
    corners = seat.corners(0.04)
    y = abs(corners[0, 1]) * 1.05
    runner = np.column_stack([runner_x, np.full(9, y), bend * runner_x**2 + width / 2])
    parts = [mirrored(beam(a, b, width, color)) for a, b in zip(runner[:-1], runner[1:],
                                                                strict=True)]
    tops = np.column_stack([corners, np.full(4, seat.bottom + 0.01)])
    feet = np.column_stack([1.15 * corners[:, 0], np.sign(corners[:, 1]) * y,
                            bend * (1.15 * corners[:, 0]) ** 2 + width / 2])
    parts += [rod(top, foot, width / 2, color) for top, foot in zip(tops, feet, strict=True)]
    return parts + stretchers(rng, tops, feet, 0.6 * width, color)


def block(rng: np.random.Generator, seat: Seat, color: Color) -> list[Mesh]:
    """Return a body that reaches the floor: a box, two side panels, a drum, or a bent sheet."""
    top = seat.bottom + 0.01
    x, y = seat.depth / 2 - 0.01, min(seat.width, seat.back_width) / 2 - 0.01
    kind = rng.choice(['box', 'panels', 'sheet']) if not seat.is_round else 'drum'
    if kind == 'box':
        inset = rng.uniform(0, 0.05)
        return [box([inset - x, inset - y, 0], [x - inset, y - inset, top], color)]
    if kind == 'panels':
        width = rng.uniform(0.02, 0.06)
        return [mirrored(box([-x, y - width, 0], [x, y, top], color)),
                box([-0.02, -y, 0.4 * top], [0.02, y, 0.8 * top], color)]
    if kind == 'sheet':
        path = np.array([[-x, -y], [x - 0.05, -y], [x, 0], [x - 0.05, y], [-x, y]])
        return [wall(smoothed(path * 0.93, 1), 0, top, 0.03, color)]
    radius, waist = seat.width / 2, rng.uniform(0.55, 1.2)
    return [lathe([[0.85 * radius, 0], [0.9 * waist * radius, 0.4 * top],
                   [0.9 * waist * radius, 0.6 * top], [0.85 * radius, top]], color)]


def _leg(style: str, top: NDArray[np.float64], foot: NDArray[np.float64], width: float,
         color: Color) -> Mesh:
    if style == 'square':
        return beam(top, foot, width, color)
    if style == 'tapered':
        return beam(top, foot, 1.2 * width, color, end_scale=0.55)
    if style == 'cone':
        return rod(top, foot, 0.6 * width, color, end_radius=0.35 * width)
    if style == 'round':
        return rod(top, foot, width / 2, color)
    shares = np.array([0, 0.08, 0.2, 0.3, 0.42, 0.55, 0.75, 0.85, 1.0])
    radii = 0.6 * width * np.array([0.5, 0.8, 0.5, 1.0, 0.6, 1.0, 0.7, 1.0, 1.0])
    mesh = lathe(np.column_stack([radii, shares]), color, sections=10)
    mesh.vertices = (mesh.vertices * [1, 1, 0] + foot
                     + mesh.vertices[:, 2:] * (np.asarray(top) - foot))
    return mesh
