"""Loudspeakers: bookshelf boxes, towers, subwoofers, soundbars, stage and smart ones."""

from collections.abc import Callable
import math

from active_recon.shapes.common.drawing import choose
from active_recon.shapes.common.materials import fabric, metal, paint, plastic, wood
from active_recon.shapes.common.parts import (
    assemble,
    box,
    Color,
    ellipsoid,
    lathe,
    loft,
    Mesh,
    mirrored,
    prism,
    rod,
)
from active_recon.shapes.speaker.parts import Cabinet, drivers, feet, shell
import numpy as np


def speaker(rng: np.random.Generator) -> Mesh:
    """Return a random loudspeaker; its cones face +x."""
    kinds: dict[Callable[[np.random.Generator], Mesh], float] = {
        _bookshelf: 0.3, _tower: 0.26, _subwoofer: 0.09, _soundbar: 0.06, _stage: 0.09,
        _cylinder: 0.07, _ball: 0.04, _wedge: 0.06, _horn: 0.03}
    return choose(rng, kinds)(rng)


def _coat(rng: np.random.Generator) -> Color:
    return [wood, wood, plastic, plastic, paint][rng.integers(5)](rng)


def _grille(rng: np.random.Generator, cabinet: Cabinet) -> Mesh:
    """Return a cloth frame over most of the front."""
    y, z = cabinet.width / 2 * rng.uniform(0.82, 0.96), cabinet.height * rng.uniform(0.42, 0.48)
    rise = rng.uniform(0.01, 0.035)
    x = cabinet.depth / 2
    middle = cabinet.height / 2
    return box([x - 0.01, -y, middle - z], [x + rise, y, middle + z], fabric(rng) * 0.5)


def _fronted(rng: np.random.Generator, cabinet: Cabinet, cones: int, grille: float) -> list[Mesh]:
    if rng.random() < grille:
        return [_grille(rng, cabinet)]
    return drivers(rng, cabinet, cones)


def _bookshelf(rng: np.random.Generator) -> Mesh:
    """Return a box of a shelf's size, sometimes on a stand of its own."""
    cabinet = Cabinet(rng.uniform(0.4, 0.85), rng.uniform(0.45, 0.75), 1.0)
    color = _coat(rng)
    parts = [shell(rng, cabinet, color), *_fronted(rng, cabinet, int(rng.integers(1, 4)), 0.2)]
    if rng.random() < 0.16:
        parts.append(_stand(rng, cabinet))
    elif rng.random() < 0.3:
        parts.append(feet(rng, cabinet))
    return assemble(parts)


def _stand(rng: np.random.Generator, cabinet: Cabinet) -> Mesh:
    color, tall = metal(rng), rng.uniform(0.9, 1.9)
    x, y = cabinet.depth / 2, cabinet.width / 2
    plate = box([-x * 0.8, -y * 0.8, -0.05], [x * 0.8, y * 0.8, 0.02], color)
    foot = box([-x * 1.1, -y * 1.15, -tall - 0.06], [x * 1.1, y * 1.15, -tall], color)
    thick = rng.uniform(0.04, 0.1)
    post = (mirrored(rod([0, y * 0.4, 0], [0, y * 0.4, -tall - 0.02], thick * 0.7, color))
            if rng.random() < 0.4 else rod([0, 0, 0], [0, 0, -tall - 0.02], thick, color))
    return assemble([plate, foot, post])


def _tower(rng: np.random.Generator) -> Mesh:
    """Return a tall box that stands on the floor, on a plinth, spikes or nothing."""
    cabinet = Cabinet(rng.uniform(0.2, 0.42), rng.uniform(0.16, 0.3), 1.0)
    color = _coat(rng)
    parts = [shell(rng, cabinet, color), *_fronted(rng, cabinet, int(rng.integers(2, 6)), 0.2)]
    if rng.random() < 0.75:
        parts.append(feet(rng, cabinet))
    if rng.random() < 0.12:  # a tweeter in a pod of its own
        radius = cabinet.width * rng.uniform(0.3, 0.42)
        parts.append(ellipsoid([0, 0, 1.0 + radius * 0.6], [radius * 1.4, radius, radius],
                               plastic(rng)))
    return assemble(parts)


def _subwoofer(rng: np.random.Generator) -> Mesh:
    """Return a cube with one large cone, or none to be seen."""
    cabinet = Cabinet(rng.uniform(0.85, 1.2), rng.uniform(0.8, 1.1), 1.0)
    parts = [shell(rng, cabinet, _coat(rng)), *_fronted(rng, cabinet, 1, 0.3)]
    if rng.random() < 0.7:
        parts.append(feet(rng, cabinet))
    return assemble(parts)


def _soundbar(rng: np.random.Generator) -> Mesh:
    """Return a long bar that lies along y, cloth or cones in front."""
    depth, height = rng.uniform(0.08, 0.15), rng.uniform(0.07, 0.13)
    color = plastic(rng)
    parts = [box([-depth / 2, -0.5, 0], [depth / 2, 0.5, height], color)]
    if rng.random() < 0.5:
        parts.append(box([depth / 2 - 0.01, -0.46, height * 0.08],
                         [depth / 2 + 0.012, 0.46, height * 0.92], fabric(rng) * 0.5))
    else:
        for y in np.linspace(0.1, 0.42, int(rng.integers(2, 5))):
            parts.append(mirrored(rod([depth / 2 - 0.01, y, height / 2],
                                      [depth / 2 + 0.012, y, height / 2], height * 0.34,
                                      metal(rng), sections=16)))
    if rng.random() < 0.5:
        parts.append(mirrored(box([-depth * 0.55, 0.5 - 0.03, -0.01],
                                  [depth * 0.55, 0.52, height * 1.05], metal(rng))))
    return assemble(parts)


def _stage(rng: np.random.Generator) -> Mesh:
    """Return a stage cabinet or an amplifier: handles, corners, one to four large cones."""
    cabinet = Cabinet(rng.uniform(0.35, 0.6), rng.uniform(0.55, 1.1), 1.0)
    color = [plastic, paint][rng.integers(2)](rng) * 0.6
    parts = [shell(rng, cabinet, color), *_fronted(rng, cabinet, int(rng.choice([1, 2, 4])), 0.5)]
    if rng.random() < 0.6:
        y = cabinet.width * rng.uniform(0.12, 0.25)
        parts.append(assemble([
            box([-0.03, -y, 1.0 + 0.04], [0.03, y, 1.0 + 0.07], plastic(rng)),
            mirrored(box([-0.03, y - 0.04, 0.99], [0.03, y, 1.0 + 0.06], plastic(rng)))]))
    if rng.random() < 0.5:
        parts.append(feet(rng, cabinet))
    if rng.random() < 0.3:  # a head on top
        parts.append(box([-cabinet.depth * 0.45, -cabinet.width / 2, 0.99],
                         [cabinet.depth * 0.45, cabinet.width / 2, 1.0 + rng.uniform(0.18, 0.3)],
                         color))
    return assemble(parts)


def _cylinder(rng: np.random.Generator) -> Mesh:
    """Return a round smart speaker or a round tower."""
    radius = rng.uniform(0.12, 0.5)
    waist = rng.uniform(0.85, 1.15)
    edge = min(0.06, radius * 0.3)
    body = lathe([[radius - edge, 0], [radius, edge], [radius * waist, 0.5], [radius, 1 - edge],
                  [radius - edge, 1.0]], _coat(rng))
    parts = [body, lathe([[radius * 0.75, 0.99], [radius * 0.7, 1.015]], metal(rng))]
    if rng.random() < 0.5:
        parts.append(lathe([[radius * 1.03, 0.0], [radius * 1.03, rng.uniform(0.05, 0.2)]],
                           metal(rng)))
    if rng.random() < 0.5:
        z = rng.uniform(0.55, 0.8)
        parts.append(rod([radius * 0.6, 0, z], [radius * max(waist, 1) + 0.02, 0, z],
                         radius * rng.uniform(0.4, 0.7), fabric(rng) * 0.5, sections=18))
    return assemble(parts)


def _ball(rng: np.random.Generator) -> Mesh:
    """Return a round speaker on a foot, its cone let into the front."""
    color = _coat(rng)
    radii = np.array([0.45, 0.45 * rng.uniform(0.85, 1.15), 0.45])
    cone = rod([0.25, 0, 0.5], [0.45, 0, 0.5], rng.uniform(0.2, 0.32), metal(rng), sections=20)
    foot = lathe([[0.12, 0.1], [rng.uniform(0.2, 0.35), 0.02], [0.3, 0.0]], metal(rng))
    parts = [ellipsoid([0, 0, 0.5], radii, color, 3), cone, foot]
    if rng.random() < 0.3:
        tall = rng.uniform(0.4, 1.2)
        parts += [rod([0, 0, 0.05], [0, 0, -tall], 0.05, metal(rng)),
                  lathe([[0.3, -tall], [0.32, -tall - 0.05]], metal(rng))]
    return assemble(parts)


def _wedge(rng: np.random.Generator) -> Mesh:
    """Return a box with a leaning front, as stage monitors and computers' speakers have."""
    depth, width = rng.uniform(0.4, 0.9), rng.uniform(0.4, 1.0)
    lean = rng.uniform(0.08, 0.4) * depth
    profile = [[-depth / 2, 0], [depth / 2, 0], [depth / 2 - lean, 1.0],
               [-depth / 2 + rng.uniform(0, 0.3) * depth, 1.0]]
    color = _coat(rng)
    body = prism(profile, -width / 2, width / 2, 'y', color)
    angle = math.atan2(lean, 1.0)
    normal = np.array([math.cos(angle), 0, math.sin(angle)])
    parts = [body]
    for z, share in ((0.35, 0.36), (0.76, 0.18)):
        middle = np.array([depth / 2 - lean * z, 0, z])
        radius = min(width, 0.8) * share * rng.uniform(0.8, 1)
        parts.append(rod(middle - 0.03 * normal, middle + 0.015 * normal, radius,
                         metal(rng) * 0.6, sections=18))
    return assemble(parts)


def _horn(rng: np.random.Generator) -> Mesh:
    """Return a horn that opens towards +x, on a foot or on a box."""
    steps = np.linspace(0, 1, 6)
    mouth = rng.uniform(0.35, 0.55)
    flat = rng.uniform(0.6, 1.2)
    color = [metal, plastic, wood][rng.integers(3)](rng)
    angles = np.arange(20) * 2 * math.pi / 20
    loops = [np.column_stack([np.full(20, -0.5 + 0.9 * s), r * np.cos(angles) * flat,
                              r * np.sin(angles) + 0.5])
             for s, r in zip(steps, 0.09 + (mouth - 0.09) * steps ** 2.2, strict=True)]
    parts = [loft(loops, color), rod([-0.7, 0, 0.5], [-0.45, 0, 0.5], 0.16, metal(rng))]
    if rng.random() < 0.5:
        parts.append(box([-0.6, -0.35, -0.55], [0.25, 0.35, 0.42], wood(rng)))
    else:
        parts += [rod([-0.3, 0, 0.5], [-0.3, 0, -0.05], 0.045, metal(rng)),
                  lathe([[0.25, -0.02], [0.3, -0.08]], metal(rng), [-0.3, 0, 0])]
    return assemble(parts)
