"""What motorbikes share: the chassis' measures, wheels, fenders, forks, bars and engines."""

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
    tube,
)
import numpy as np
from numpy.typing import ArrayLike


@dataclass(frozen=True)
class Chassis:
    """Where a motorbike's main points lie; (x, z) pairs in metres, the ground at z = 0."""

    front: tuple[float, float]  # axle
    rear: tuple[float, float]
    head: tuple[float, float]  # the top of the steering head
    seat: tuple[float, float]  # the lowest point of the saddle
    widths: tuple[float, float]  # of the front and the rear tyre
    clearance: float  # the engine's underside

    @property
    def pivot(self) -> tuple[float, float]:
        """The swing arm's front end, behind the engine."""
        return (0.62 * self.rear[0] + 0.38 * self.front[0], self.clearance + 0.16)

    def on_fork(self, share: float) -> tuple[float, float]:
        """Return a point of the fork: 0 at the axle, 1 at the head, further above it."""
        (x, z), (head_x, head_z) = self.front, self.head
        return (x + share * (head_x - x), z + share * (head_z - z))


@dataclass(frozen=True)
class Livery:
    """A motorbike's colours."""

    paint: Color
    second: Color
    frame: Color
    chrome: Color
    engine: Color
    seat: Color
    tyre: Color
    rim: Color
    glass: Color


def hull(stations: ArrayLike, color: Color, power: float = 2.6) -> Mesh:
    """Return a body over stations along x: rows of (x, half width, low, high), (N, 4)."""
    loops = []
    for x, half, low, high in np.asarray(stations, np.float64):
        section = superellipse(2 * half, high - low, power, 14)
        loops.append(np.insert(section + [0, (low + high) / 2], 0, x, axis=1))
    return loft(loops, color)


def arc(center: tuple[float, float], section: ArrayLike, angles: tuple[float, float],
        color: Color, steps: int = 24) -> Mesh:
    """
    Return a section swept about the axis along y through center (x, z): a tyre or a fender.

    The section's corners are (radius, y), (N, 2); angles are from +x, up being positive.
    """
    outline = np.asarray(section, np.float64)
    loops = [np.column_stack([center[0] + outline[:, 0] * math.cos(angle), outline[:, 1],
                              center[1] + outline[:, 0] * math.sin(angle)])
             for angle in np.linspace(*angles, steps + 1)]
    return loft(loops, color)


def wheel(kind: str, spokes: int, axle: tuple[float, float], width: float,
          livery: Livery) -> Mesh:
    """Return a wheel, its tyre down to z = 0: 'wire', 'cast' or 'disc'."""
    x, radius = axle
    depth = min(0.55 * width + 0.03, 0.4 * radius)
    around = (0.0, 2 * math.pi)
    tread = superellipse(depth, width, 2.4, 8) + [radius - depth / 2, 0]
    felly = superellipse(0.05, 0.65 * width, 4, 8) + [radius - depth, 0]
    parts = [arc(axle, tread, around, livery.tyre), arc(axle, felly, around, livery.rim),
             rod((x, -0.1, radius), (x, 0.1, radius), 0.04, livery.chrome)]
    reach = radius - depth
    if kind == 'disc':
        half = 0.25 * width
        parts.append(rod((x, -half, radius), (x, half, radius), reach, livery.rim, sections=20))
    for turn in np.arange(0 if kind == 'disc' else spokes) * 2 * math.pi / spokes:
        end = np.array([x + reach * math.cos(turn), 0, radius + reach * math.sin(turn)])
        if kind == 'cast':
            parts.append(beam((x, 0, radius), end, 0.3 * width, livery.rim, 0.05))
        else:
            side = np.array([0, 0.05 * (-1) ** round(turn * spokes / (2 * math.pi)), 0])
            parts.append(rod(np.array([x, 0, radius]) + side, end, 0.012, livery.chrome,
                             sections=5))
    brake = rod((x, 0.06, radius), (x, 0.08, radius), 0.45 * reach, livery.chrome, sections=16)
    return assemble([*parts, brake])


def rolling(rng: np.random.Generator, chassis: Chassis, livery: Livery,
             usual: str) -> list[Mesh]:
    """Return both wheels, most often of the usual kind."""
    kind = usual if rng.random() < 0.65 else str(rng.choice(['wire', 'cast', 'disc']))
    spokes = int(rng.integers(10, 17)) if kind == 'wire' else int(rng.integers(3, 8))
    return [wheel(kind, spokes, axle, width, livery)
            for axle, width in zip((chassis.front, chassis.rear), chassis.widths, strict=True)]


def fender(axle: tuple[float, float], width: float, gap: float, angles: tuple[float, float],
           color: Color) -> Mesh:
    """Return a mudguard around a wheel, gap off its tread, with cheeks where it is close."""
    inner = axle[1] + gap
    half = width / 2 + 0.025
    section = [(inner - 0.03, -half), (inner + 0.015, -half), (inner + 0.04, -0.5 * half),
               (inner + 0.04, 0.5 * half), (inner + 0.015, half), (inner - 0.03, half),
               (inner, 0.6 * half), (inner, -0.6 * half)]
    return arc(axle, section, angles, color, 12)


def fork(chassis: Chassis, livery: Livery, thick: float, springer: bool) -> Mesh:
    """Return a front fork up to the bars' clamp, with its steering head."""
    half = chassis.widths[0] / 2 + thick + 0.01
    parts = []
    (bottom_x, bottom_z), (top_x, top_z) = chassis.front, chassis.on_fork(1.06)
    middle_x, middle_z = chassis.on_fork(0.5)
    legs = [rod((bottom_x, half, bottom_z), (middle_x, half, middle_z), 1.25 * thick,
                livery.frame),
            rod((middle_x, half, middle_z), (top_x, half, top_z), thick, livery.chrome)]
    if springer:
        legs.append(rod((bottom_x + 0.04, half, bottom_z), (top_x + 0.1, half, top_z - 0.1),
                        0.8 * thick, livery.chrome))
    parts.append(mirrored(assemble(legs)))
    parts.append(rod((bottom_x, -half - 0.02, bottom_z), (bottom_x, half + 0.02, bottom_z),
                     0.022, livery.chrome))
    for share in (0.8, 1.03):
        x, z = chassis.on_fork(share)
        parts.append(beam((x, -half - 0.02, z), (x, half + 0.02, z), 0.08, livery.frame, 0.05))
    low_x, low_z = chassis.on_fork(0.76)
    parts.append(rod((low_x - 0.05, 0, low_z), (top_x - 0.05, 0, top_z - 0.03), 0.05,
                     livery.frame))
    return assemble(parts)


def handlebars(chassis: Chassis, livery: Livery, rise: float, half: float, back: float,
               mirrors: bool) -> Mesh:
    """Return bars that rise from the clamp and sweep back, with their grips."""
    x, z = chassis.on_fork(1.03)
    grip = np.array([x - back, half, z + rise])
    inner = np.array([x - 0.2 * back, 0.55 * half, z + rise + 0.01])
    bar = np.array([(x, 0, z), (x, 0.09, z), inner, grip])
    side = [tube(bar, 0.022, livery.chrome, 8),
            rod(inner + 0.5 * (grip - inner), grip + 0.1 * (grip - inner), 0.032, livery.tyre)]
    if mirrors:
        glass = inner + [0.04, 0.06, 0.17]
        side += [rod(inner, glass, 0.018, livery.frame, sections=6),
                 ellipsoid(glass, (0.03, 0.075, 0.05), livery.chrome, 1)]
    return mirrored(assemble(side))


def frame(chassis: Chassis, livery: Livery, twin_shocks: bool) -> Mesh:
    """Return the tubes around the engine, the seat's rails and the swing arm."""
    head_x, head_z = chassis.on_fork(0.85)
    neck = (head_x - 0.06, 0.0, head_z)
    pivot = np.array([chassis.pivot[0], 0.11, chassis.pivot[1]])
    seat = np.array([chassis.seat[0], 0.08, chassis.seat[1] - 0.07])
    floor = chassis.clearance + 0.02
    tail = seat + [-0.38, 0, 0.04]
    out = np.array([chassis.rear[0], chassis.widths[1] / 2 + 0.045, chassis.rear[1]])
    front = neck[0] - 0.1
    cradle = np.array([neck, (front, 0.1, floor + 0.1), (front - 0.12, 0.1, floor),
                       (pivot[0], 0.1, floor), pivot, seat, tail])
    side = [tube(cradle, 0.024, livery.frame, 8),
            rod(neck, seat, 0.028, livery.frame),
            beam(pivot, out, 0.045, livery.frame, 0.07)]
    if twin_shocks:
        foot = 0.2 * pivot + 0.8 * out
        top = 0.5 * (seat + tail) + [0, foot[1] - seat[1], 0]
        side += [rod(foot, top, 0.034, livery.chrome),
                 rod(top, top * [1, 0, 1], 0.025, livery.frame)]
    axle = rod(out * [1, -1, 1], out, 0.025, livery.chrome)
    across = rod(pivot * [1, -1, 1], pivot, 0.035, livery.frame)
    return assemble([mirrored(assemble(side)), axle, across])


def engine(kind: str, chassis: Chassis, livery: Livery) -> Mesh:
    """Return an engine between the wheels: 'twin', 'single', 'four' or 'boxer'."""
    color, chrome = livery.engine, livery.chrome
    x = chassis.pivot[0] + 0.24
    low, top = chassis.clearance + 0.01, chassis.seat[1] - 0.02
    crank = low + 0.15
    parts = [rod((x, -0.13, crank), (x, 0.13, crank), 0.16, color, sections=14),
             box((x - 0.27, -0.11, low), (x + 0.1, 0.11, crank + 0.12), color),
             rod((x, -0.17, crank), (x, 0.17, crank), 0.09, chrome, sections=14)]
    leans = {'twin': (-0.4, 0.4), 'single': (0.1,), 'four': (0.25,), 'boxer': ()}[kind]
    width = {'twin': 0.17, 'single': 0.19, 'four': 0.42, 'boxer': 0}[kind]
    tall = max(top - crank, 0.25)
    for lean in leans:
        axis = np.array([math.sin(lean), 0, math.cos(lean)])
        foot = np.array([x, 0, crank])
        parts.append(beam(foot, foot + 0.9 * tall * axis, width, color, 0.15))
        for share in (0.45, 0.58, 0.71, 0.84):  # the fins
            at = foot + share * tall * axis
            parts.append(beam(at, at + 0.045 * tall * axis, width + 0.05, chrome, 0.2))
    if kind == 'boxer':
        parts += [rod((x, -0.33, crank), (x, 0.33, crank), 0.095, color),
                  mirrored(rod((x, 0.3, crank), (x, 0.36, crank), 0.115, chrome)),
                  box((x - 0.2, -0.1, crank), (x + 0.15, 0.1, top - 0.05), color)]
    return assemble(parts)
