"""The lofted skins of cars: the hull from bumper to bumper, and the greenhouse on top of it."""

from dataclasses import dataclass

from active_recon.shapes.common.parts import box, Color, Mesh
from active_recon.shapes.common.skin import painted_loft
import numpy as np
from numpy.typing import NDArray

_BOXY = np.array([(0.85, 0.0), (1.0, 0.2), (1.0, 0.78), (0.9, 1.0), (0.16, 1.0)])
_SMOOTH = np.array([(0.7, 0.0), (0.93, 0.06), (0.98, 0.26), (1.0, 0.5), (0.97, 0.76),
                    (0.88, 0.93), (0.7, 1.0), (0.16, 1.03)])


@dataclass(frozen=True)
class Stance:
    """The proportions of a car, in metres; x from the middle, z from the road."""

    length: float
    width: float
    clearance: float
    nose: float  # height of the bonnet's front edge
    belt: float  # height of the windows' lower edge
    deck: float  # height of the tail
    roof: float
    cowl: float  # x of the windscreen's foot
    roof_front: float
    roof_rear: float
    back: float  # x of the rear window's foot
    axles: tuple[float, float]
    wheel_radius: float
    smooth: bool
    plan_taper: float  # how much narrower the ends are than the middle, of the width

    def half_width(self, x: float) -> float:
        """Return half the hull's width at x."""
        return self.width / 2 * (1 - self.plan_taper * abs(2 * x / self.length) ** 3)

    def top(self, x: float) -> float:
        """Return the height of the hull at x."""
        end = self.length / 2
        return float(np.interp(x, [-end, self.back, self.cowl, end],
                               [self.deck, self.belt, self.belt, self.nose]))


@dataclass(frozen=True)
class Livery:
    """The colours of a car."""

    paint: Color
    roof: Color
    doors: Color
    stripe: Color
    sill: Color
    trim: Color
    glass: Color
    tyre: Color
    rim: Color
    seat: Color


def hull(stance: Stance, livery: Livery, well: tuple[float, float, float] | None = None) -> Mesh:
    """
    Return the body below the windows.

    A well (rear x, front x, floor z) is open to the sky: a pickup's bed, a roadster's cockpit.
    """
    end = stance.length / 2
    rounding = (0.06 if stance.smooth else 0.03) * stance.length
    scales = (0.66, 0.87, 1.0) if stance.smooth else (0.92, 0.98, 1.0)
    ends = [(end - rounding * t, s) for t, s in zip((0, 0.35, 1), scales, strict=True)]
    stations = [(x, s, stance.top(x)) for x, s in ends]
    stations += [(-x, s, stance.top(-x)) for x, s in ends]
    inner = np.linspace(stance.back, stance.cowl, 5)
    stations += [(float(x), 1.0, stance.top(float(x))) for x in inner]
    bonnet = (stance.cowl + end - rounding) / 2
    # Bonnets are convex from the side.
    stations.append((bonnet, 1.0, stance.top(bonnet) + (0.03 if stance.smooth else 0)))
    if well is not None:
        rear, front, floor = well
        stations = [(x, s, floor if rear < x < front else z) for x, s, z in stations]
        for x, step in ((rear, 1e-3), (front, -1e-3)):
            stations += [(x, 1.0, stance.top(x)), (x + step, 1.0, floor)]
    stations.sort(key=lambda station: station[0])
    half = _SMOOTH if stance.smooth else _BOXY
    section = np.vstack([half, half[::-1] * [-1, 1]])
    loops = []
    for x, scale, top in stations:
        middle = 0.45 * top + 0.55 * stance.clearance
        low, high = (middle + (z - middle) * scale for z in (stance.clearance, top))
        loops.append(np.column_stack([
            np.full(len(section), x), section[:, 0] * stance.half_width(x) * (0.4 + 0.6 * scale),
            low + section[:, 1] * (high - low)]))
    colors = np.tile(np.asarray(livery.paint), (len(loops) - 1, len(section), 1))
    xs = np.array([x for x, _, _ in stations])
    between = (xs[:-1] >= stance.back - 0.01) & (xs[1:] <= stance.cowl + 0.01)
    sides = (np.abs(section[:, 0]) > 0.8) & (section[:, 1] < 0.95)
    colors[np.ix_(between, sides & np.roll(sides, -1))] = livery.doors
    colors[:, len(half) - 1] = livery.stripe
    colors[:, (section[:, 1] < 0.1) | (np.roll(section[:, 1], -1) < 0.1)] = livery.sill
    if well is not None:
        inside = (xs[:-1] >= well[0]) & (xs[1:] <= well[1])
        upward = (section[:, 1] > 0.75) & (np.roll(section[:, 1], -1) > 0.75)
        colors[np.ix_(inside, upward)] = livery.sill
    return painted_loft(loops, colors, (livery.paint, livery.paint))


def walls(stance: Stance, livery: Livery, well: tuple[float, float, float],
          thickness: float) -> list[Mesh]:
    """Return the two sides that a well's hull lacks above its floor."""
    rear, front, floor = well
    reach = min(stance.half_width(rear), stance.half_width(front))
    return [box((rear - 0.02, side * (reach - thickness), floor - 0.15),
                (front + 0.02, side * reach * 0.985, stance.belt), livery.paint)
            for side in (-1, 1)]


def greenhouse(stance: Stance, livery: Livery, windows: int, glazed: int | None = None,
               rear_pillar: float = 0.06, tumblehome: float = 0.15) -> Mesh:
    """
    Return windscreen, side windows, rear window and roof as one skin.

    Of the windows on each side the first `glazed` are glass (all by default). rear_pillar is the
    share of the side behind the last window; the roof is narrower than the belt by tumblehome.
    """
    curve = 0.05 * stance.width if stance.smooth else 0.0
    bulge = 0.02 * stance.length if stance.smooth else 0.0
    shares, kinds = _side_breaks(windows, windows if glazed is None else glazed, rear_pillar)
    crown = 0.04 if stance.smooth else 0.015
    low, high = stance.belt, stance.roof - crown
    loops = []
    for v in (-0.12, 0.06, 0.45, 0.84, 1.0):
        swell = np.sin(np.pi * np.clip(v, 0, 1)) * bulge
        front = stance.cowl + (stance.roof_front - stance.cowl) * v + swell
        rear = stance.back + (stance.roof_rear - stance.back) * v - swell
        belt_width = stance.width / 2 * 0.93
        y = belt_width * (1 - tumblehome * v) + swell * 0.5
        loops.append(_plan(front, rear, y, curve, shares, low + (high - low) * v))
    top = loops[-1].copy()
    centre = top.mean(axis=0)
    top = centre + (top - centre) * (0.9, 0.82, 1)
    top[:, 2] = stance.roof
    loops.append(top)
    half = ['glass', 'roof', *kinds, 'roof', 'rear']
    labels = [*half, 'rear', *half[::-1], 'glass']
    glazing = np.array([livery.glass if k in ('glass', 'rear') else livery.paint
                        if k == 'panel' else livery.roof for k in labels])
    if glazed == 1 and windows > 1:  # panel vans have no rear window
        glazing[[k == 'rear' for k in labels]] = livery.paint
    paint = np.tile(np.asarray(livery.paint), (len(labels), 1))
    roof = np.tile(np.asarray(livery.roof), (len(labels), 1))
    return painted_loft(loops, [paint, glazing, glazing, roof, roof], (livery.paint, livery.roof))


def _side_breaks(windows: int, glazed: int,
                 rear_pillar: float) -> tuple[NDArray[np.float64], list[str]]:
    """Return where a side's panes begin and end, from front 0 to rear 1, and what is between."""
    pane = (1 - rear_pillar) / windows
    pillar = min(0.05, pane * 0.2)
    shares, kinds = [0.0], []
    for i in range(windows):
        last = i == windows - 1
        shares += [(i + 1) * pane - (0 if last else pillar), (i + 1) * pane]
        kinds += ['glass' if i < glazed else 'panel', 'roof' if i < glazed else 'panel']
    shares[-1] = 1.0
    return np.array(shares), kinds


def _plan(front: float, rear: float, y: float, curve: float, shares: NDArray[np.float64],
          z: float) -> NDArray[np.float64]:
    """Return a loop round the cabin at one height, from the front's middle to the left."""
    corner = min(0.05 * y + curve, (front - rear) * 0.1)
    sides = front - corner - shares * (front - rear - 2 * corner)
    half = np.array([(front + curve, 0.45 * y), (front, 0.88 * y), *((x, y) for x in sides),
                     (rear, 0.88 * y), (rear - curve, 0.45 * y)])
    loop = np.vstack([half, half[::-1] * [1, -1]])
    return np.column_stack([loop, np.full(len(loop), z)])
