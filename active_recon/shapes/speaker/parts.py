"""What loudspeakers share: cabinets of several sections, cones, ports, plinths and spikes."""

from typing import NamedTuple

from active_recon.shapes.common.materials import metal, plastic
from active_recon.shapes.common.parts import (
    assemble,
    box,
    Color,
    ellipsoid,
    loft,
    Mesh,
    prism,
    rod,
)
from active_recon.shapes.table.legs import fourfold
import numpy as np


class Cabinet(NamedTuple):
    """A box about the z axis, from the floor up: metres along x, y and z."""

    depth: float
    width: float
    height: float


def shell(rng: np.random.Generator, cabinet: Cabinet, color: Color) -> Mesh:
    """Return the cabinet: plain, bevelled in front, bellied like a lute, narrower above."""
    x, y, z = cabinet.depth / 2, cabinet.width / 2, cabinet.height
    kind = rng.choice(['plain', 'bevelled', 'lute', 'tapered', 'hexagon', 'capped'],
                      p=[0.42, 0.16, 0.14, 0.1, 0.08, 0.1])
    if kind == 'bevelled':
        cut = min(x, y) * rng.uniform(0.15, 0.5)
        plan = [[-x, -y], [x - cut, -y], [x, -y + cut], [x, y - cut], [x - cut, y], [-x, y]]
        return prism(plan, 0, z, 'z', color)
    if kind == 'lute':
        steps = np.linspace(0, 1, 7)
        back = y * rng.uniform(0.25, 0.6)
        half = y + (back - y) * steps ** 2
        side = np.column_stack([x - 2 * x * steps, half])
        return prism(np.vstack([side, side[::-1] * [1, -1]]), 0, z, 'z', color)
    if kind == 'tapered':
        share = rng.uniform(0.55, 0.9)
        loops = [[[-x, -y, 0], [x, -y, 0], [x, y, 0], [-x, y, 0]],
                 [[-x * share, -y * share, z], [x, -y * share, z], [x, y * share, z],
                  [-x * share, y * share, z]]]
        return loft(loops, color)
    if kind == 'hexagon':
        cut = y * rng.uniform(0.3, 0.6)
        plan = [[-x, -y + cut], [-x * 0.2, -y], [x, -y], [x, y], [-x * 0.2, y], [-x, y - cut]]
        return prism(plan, 0, z, 'z', color)
    body = box([-x, -y, 0], [x, y, z], color)
    if kind == 'capped':
        other = plastic(rng)
        face = box([x - 0.02, -y * 1.02, -0.005], [x + 0.02, y * 1.02, z * 1.005], other)
        return assemble([body, face])
    return body


def drivers(rng: np.random.Generator, cabinet: Cabinet, count: int) -> list[Mesh]:
    """Return cones, large ones below, a small one near the top, and often a port."""
    x, wide = cabinet.depth / 2 - 0.012, cabinet.width / 2 * 0.88
    parts, color = [], metal(rng) * 0.7
    rim = plastic(rng)
    most = min(wide, cabinet.height / (2 * count + 0.6))
    if count == 4 and cabinet.width > 0.6:  # two by two
        for y in (-0.5, 0.5):
            for z in (0.27, 0.73):
                parts.append(_cone([x, y * cabinet.width * 0.48, z * cabinet.height],
                                   min(cabinet.width, 1) * 0.21, color, rim, rng))
        return parts
    z = most * rng.uniform(1.05, 1.3)
    for index in range(count):
        tweeter = count > 1 and index == count - 1
        radius = most * (rng.uniform(0.35, 0.55) if tweeter else rng.uniform(0.85, 1))
        place = min(z, cabinet.height - radius * 1.1)
        parts.append(_cone([x, 0, place], radius, color, rim, rng))
        z = place + radius + most * rng.uniform(0.95, 1.1)
    if rng.random() < 0.3:
        low = most * rng.uniform(0.12, 0.2)
        parts.append(rod([x, 0, low * 1.1], [x + 0.02, 0, low * 1.1], low, plastic(rng) * 0.4))
    return parts


def _cone(middle: list[float], radius: float, color: Color, rim: Color,
          rng: np.random.Generator) -> Mesh:
    """Return a rim with a cone in it and a dome in that."""
    x, y, z = middle
    rise = rng.uniform(0.018, 0.035)
    ring = rod([x, y, z], [x + rise, y, z], radius, rim, sections=20)
    face = rod([x, y, z], [x + rise + 0.004, y, z], radius * 0.84, color, sections=20)
    dome = ellipsoid([x + rise, y, z], [radius * 0.25, radius * 0.32, radius * 0.32], rim, 1)
    return assemble([ring, face, dome])


def feet(rng: np.random.Generator, cabinet: Cabinet) -> Mesh:
    """Return a plinth, spikes, or blocks under the cabinet."""
    x, y = cabinet.depth / 2, cabinet.width / 2
    kind = rng.choice(['plinth', 'spikes', 'blocks', 'outriggers'], p=[0.4, 0.25, 0.2, 0.15])
    color = [metal, plastic][rng.integers(2)](rng)
    if kind == 'plinth':
        wide, thick = rng.uniform(1.0, 1.35), rng.uniform(0.025, 0.06)
        return box([-x * wide, -y * wide, -thick], [x * wide, y * wide, 0.01], color)
    if kind == 'blocks':
        return fourfold(box([x * 0.6, y * 0.55, -0.04], [x * 0.95, y * 0.95, 0.01], color))
    if kind == 'spikes':
        return fourfold(rod([x * 0.75, y * 0.75, 0.01], [x * 0.8, y * 0.8, -0.06],
                            max(0.02, y * 0.14), color, end_radius=0.012))
    bars = [box([side * x * 0.7 - 0.03, -y * 1.6, -0.03], [side * x * 0.7 + 0.03, y * 1.6, 0.01],
                color) for side in (-1, 1)]
    return assemble(bars)
