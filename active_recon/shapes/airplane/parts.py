"""What aeroplanes are made of: fuselages, wings, fins, engines, propellers and gear."""

from collections.abc import Sequence
from dataclasses import dataclass
import math

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
import numpy as np
from numpy.typing import ArrayLike, NDArray

# Half an aerofoil: (share of the chord behind the leading edge, share of the thickness).
_AEROFOIL = np.array([(0.0, 0.0), (0.06, 0.32), (0.3, 0.5), (0.65, 0.34), (1.0, 0.06),
                      (1.0, -0.06), (0.65, -0.3), (0.3, -0.42), (0.06, -0.28)])


@dataclass(frozen=True)
class Livery:
    """The colours of an aeroplane."""

    top: Color
    belly: Color
    stripe: Color
    wing: Color
    tail: Color
    engine: Color
    glass: Color
    tyre: Color
    metal: Color


@dataclass(frozen=True)
class Fuselage:
    """Sections along x, front first: x, middle's z, width, height; all (N,)."""

    x: NDArray[np.float64]
    z: NDArray[np.float64]
    width: NDArray[np.float64]
    height: NDArray[np.float64]
    power: float = 2.0

    def at(self, x: float) -> tuple[float, float, float]:
        """Return the middle's z, the width and the height at x."""
        order = slice(None, None, -1)
        z, width, height = (float(np.interp(x, self.x[order], values[order]))
                            for values in (self.z, self.width, self.height))
        return z, width, height

    def skin(self, livery: Livery, belly: float, stripe: float,
             cockpit: tuple[float, float] | None = None) -> Mesh:
        """
        Return the fuselage: belly below and top above the stripe's upper edge.

        belly and stripe are heights in the section, from -1 to 1; within the x of the cockpit
        (rear, front) the upper quarter is glass.
        """
        fine = np.unique(np.concatenate([self.x, np.linspace(self.x[0], self.x[-1], 14),
                                         [] if cockpit is None else cockpit]))[::-1]
        loops, unit = [], superellipse(1, 1, self.power, 16)
        for x in fine:
            z, width, height = self.at(float(x))
            loops.append(np.insert(unit * [width, height] + [0, z], 0, x, axis=1))
        level = (unit[:, 1] + np.roll(unit[:, 1], -1))
        around = np.where((level < belly)[:, None], livery.belly, np.where(
            (level < stripe)[:, None], livery.stripe, livery.top))
        colors = np.tile(around, (len(fine) - 1, 1, 1))
        if cockpit is not None:
            within = (fine[:-1] <= cockpit[1] + 1e-9) & (fine[1:] >= cockpit[0] - 1e-9)
            colors[np.ix_(within, (level > 0.35) & (level < 0.95))] = livery.glass
        return painted_loft(loops, colors, (livery.stripe, livery.top))


def fuselage(rng: np.random.Generator, length: float, width: float, height: float, nose: float,
             tail: float, upsweep: float, bluntness: float, power: float = 2.0) -> Fuselage:
    """
    Return a body along x from length / 2 to -length / 2.

    nose and tail are the tapering shares of the length, upsweep how far the tail's end rises (of
    the height), bluntness the exponent of the nose: 0.5 is round, 1 a cone.
    """
    steps = np.array([0.0, 0.08, 0.25, 0.5, 0.75, 1.0])
    fore = np.maximum(steps ** bluntness, 0.04)
    aft = np.maximum(1 - steps ** rng.uniform(1.2, 2.0), rng.uniform(0.08, 0.22))
    x = np.concatenate([0.5 - nose * steps, -0.5 + tail * (1 - steps)]) * length
    drop = -rng.uniform(0, 0.15) * height * (1 - fore)
    rise = upsweep * height * steps ** 1.5
    return Fuselage(x, np.concatenate([drop, rise]), width * np.concatenate([fore, aft]),
                    height * np.concatenate([fore, aft]), power)


def panel(stations: Sequence[tuple[ArrayLike, float]], thickness: float, normal: ArrayLike,
          color: Color) -> Mesh:
    """
    Return a wing or a fin over stations from root to tip: leading edge (3,) and chord.

    thickness is the root's, in metres, and shrinks with the chord to no less than a half.
    """
    upward = np.asarray(normal, np.float64) / np.linalg.norm(normal)
    root = stations[0][1]
    loops = []
    for edge, chord in stations:
        thick = thickness * max(chord / root, 0.5)
        loops.append(np.asarray(edge) + np.outer(-_AEROFOIL[:, 0] * chord, (1, 0, 0))
                     + np.outer(_AEROFOIL[:, 1] * thick, upward))
    return loft(loops, color)


def wing(x: float, z: float, half_span: float, root: float, tip: float, sweep: float,
         dihedral: float, thickness: float, color: Color, kink: float = 0.0) -> Mesh:
    """
    Return both wings; x is the leading edge at the middle, sweep the tip's way back, in metres.

    dihedral is the tip's rise; kink (0 to 1) widens the chord at a third of the span.
    """
    third = root + (tip - root) / 3
    halves = []
    for side in (1, -1):
        stations = [((x, 0, z), root + kink * (root - third)),
                    ((x - sweep / 3, side * half_span / 3, z + dihedral / 3), third),
                    ((x - sweep * 0.92, side * half_span * 0.92, z + dihedral * 0.92),
                     tip + (root - tip) * 0.06),
                    ((x - sweep, side * half_span, z + dihedral), tip * 0.85)]
        halves.append(panel(stations, thickness, (0, 0, 1), color))
    return assemble(halves)


def fin(x: float, y: float, z: float, height: float, root: float, tip: float, sweep: float,
        thickness: float, color: Color, cant: float = 0.0) -> Mesh:
    """Return an upright surface; cant is how far its tip leans to +y, in metres."""
    return panel([((x, y, z), root), ((x - sweep, y + cant, z + height), tip)], thickness,
                 (0, height, -cant), color)


def nacelle(front: ArrayLike, length: float, radius: float, livery: Livery) -> Mesh:
    """Return a jet engine with its dark mouth at front."""
    x, y, z = np.asarray(front, np.float64)
    circle = superellipse(2, 2, 2, 12)
    shape = [(0, 0.86), (0.08, 1.0), (0.5, 1.0), (0.8, 0.75), (1.0, 0.5)]
    loops = [np.insert(circle * radius * r + (y, z), 0, x - length * t, axis=1) for t, r in shape]
    colors = np.tile(np.asarray(livery.engine), (4, 12, 1))
    colors[0] = livery.metal
    return painted_loft(loops, colors, ((25, 25, 30), (45, 45, 50)))


def propeller(rng: np.random.Generator, hub: ArrayLike, radius: float, blades: int,
              spinner: float, livery: Livery) -> Mesh:
    """Return a spinner whose base is at hub and blades round it, or a spinning disc for none."""
    centre = np.asarray(hub, np.float64)
    middle = centre + (spinner * 0.5, 0, 0)
    parts = [rod(centre - (spinner * 0.3, 0, 0), centre + (spinner * 1.9, 0, 0), spinner,
                 livery.stripe, end_radius=spinner * 0.2, sections=10)]
    if blades == 0:
        parts.append(rod(middle - (0.04, 0, 0), middle + (0.04, 0, 0), radius, livery.metal,
                         sections=18))
    turn = rng.uniform(0, 2 * math.pi)
    for angle in turn + np.arange(blades) * 2 * math.pi / max(blades, 1):
        tip = middle + radius * np.array([0, math.cos(angle), math.sin(angle)])
        parts.append(beam(middle, tip, radius * 0.16, livery.tyre, radius * 0.12, end_scale=0.7))
    return assemble(parts)


def leg(top: ArrayLike, foot: ArrayLike, radius: float, wheels: int, livery: Livery,
        spat: bool = False) -> Mesh:
    """Return one leg of the gear with wheels at its foot, side by side."""
    x, y, z = np.asarray(foot, np.float64)
    parts = [beam(top, foot, radius * 0.5, livery.metal)]
    for i in range(wheels):
        side = y + (i - (wheels - 1) / 2) * radius * 1.1
        parts.append(rod((x, side - radius * 0.35, z), (x, side + radius * 0.35, z), radius,
                         livery.tyre, sections=12))
    if spat:
        parts.append(ellipsoid((x - radius * 0.3, y, z + radius * 0.25),
                               (radius * 2, radius * 0.6, radius * 1.05), livery.top, 1))
    return assemble(parts)


def float_hull(x: float, y: float, z: float, length: float, width: float, color: Color) -> Mesh:
    """Return one float of a seaplane, its deck at z."""
    shape = [(0.5, 0.25, -0.1), (0.4, 0.8, 0.5), (0.15, 1, 0.95), (-0.1, 1, 1), (-0.11, 1, 0.7),
             (-0.5, 0.4, 0.1)]
    loops = [[(x + length * t, y - width * w / 2, z), (x + length * t, y + width * w / 2, z),
              (x + length * t, y + width * w / 2, z - width * (0.2 + 0.5 * deep)),
              (x + length * t, y, z - width * (0.3 + 0.8 * deep)),
              (x + length * t, y - width * w / 2, z - width * (0.2 + 0.5 * deep))]
             for t, w, deep in shape]
    return loft(loops, color)


def strut(start: ArrayLike, end: ArrayLike, width: float, color: Color) -> Mesh:
    """Return a flat streamlined strut."""
    return beam(start, end, width, color, width)


def pylon(x: float, y: float, low: float, high: float, length: float, width: float,
          color: Color) -> Mesh:
    """Return the fin that an engine hangs from."""
    return box((x - length, y - width / 2, low), (x, y + width / 2, high), color)


def tricycle(body: Fuselage, x: float, y: float, z: float, ground: float, radius: float,
              wheels: int, livery: Livery) -> list[Mesh]:
    """Return a nose leg and two main legs whose wheels stand at the height of ground."""
    front = float(body.x[0]) * 0.72
    nose = body.at(front)[0]
    low = ground + radius
    return [leg((front, 0, nose), (front, 0, low), radius, 1, livery),
            mirrored(leg((x, y, z), (x, y, low), radius, wheels, livery))]
