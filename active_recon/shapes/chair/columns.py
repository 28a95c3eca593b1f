"""What chairs stand on where it is one column: pedestals and swivel stars."""

import math

from active_recon.shapes.chair.bases import Seat
from active_recon.shapes.common import materials
from active_recon.shapes.common.parts import beam, box, Color, ellipsoid, lathe, Mesh, rod, tube
import numpy as np


def pedestal(rng: np.random.Generator, seat: Seat, color: Color) -> list[Mesh]:
    """Return one column on a disc, a trumpet, a cone, or a wooden cross."""
    radius = rng.uniform(0.02, 0.045) * seat.stoutness
    reach = rng.uniform(0.36, 0.55) * min(seat.width, 0.6)
    top = seat.bottom + 0.01
    kind = rng.choice(['disc', 'trumpet', 'dome', 'cross'])
    parts = [rod([0, 0, 0.01], [0, 0, top], radius, color)]
    if kind == 'disc':
        parts.append(rod([0, 0, 0], [0, 0, 0.025], reach, color, sections=24))
    elif kind == 'trumpet':
        heights = np.linspace(0, 1, 8)
        parts = [lathe(np.column_stack([radius + (reach - radius) * (1 - heights) ** 4 + 0.8
                                        * reach * heights**8, top * heights]), color)]
    elif kind == 'dome':
        parts.append(lathe([[reach, 0], [reach, 0.02], [0.5 * reach, 0.06], [radius, 0.1]], color))
    else:
        width = rng.uniform(0.04, 0.07)
        for angle in np.arange(4) * math.pi / 2 + math.pi / 4:
            out = np.array([math.cos(angle), math.sin(angle), 0]) * reach * 1.1
            parts.append(beam([0, 0, 0.13], out + [0, 0, width / 2], width, color))
    if top > 0.6 and rng.random() < 0.7:
        parts += foot_ring(0.2, radius, 0.35 * top, color)
    return parts


def star(rng: np.random.Generator, seat: Seat, color: Color) -> list[Mesh]:
    """Return a swivel column on four or five spokes, with castors or glides."""
    spokes, reach = int(rng.integers(4, 6)), rng.uniform(0.26, 0.36)
    wheel = rng.uniform(0.025, 0.035) if rng.random() < 0.75 else 0.0
    hub = 2 * wheel + rng.uniform(0.04, 0.1)
    black = materials.rubber(rng)
    parts = [rod([0, 0, hub - 0.04], [0, 0, seat.bottom + 0.01], 0.028, color),
             rod([0, 0, 2 * wheel + 0.01], [0, 0, hub + 0.05], 0.045, color),
             box([-0.1, -0.1, seat.bottom - 0.03], [0.1, 0.1, seat.bottom + 0.01], black)]
    for angle in np.arange(spokes) * 2 * math.pi / spokes + rng.uniform(0, 1):
        out = reach * np.array([math.cos(angle), math.sin(angle), 0])
        parts.append(beam([0, 0, hub], out + [0, 0, 2 * wheel + 0.015], 0.05, color, height=0.035,
                          end_scale=0.7))
        if wheel:
            side = 0.025 * np.array([-math.sin(angle), math.cos(angle), 0])
            middle = out + [0, 0, wheel]
            parts.append(rod(middle - side, middle + side, wheel, black))
        else:
            parts.append(ellipsoid(out + [0, 0, 0.012], [0.02, 0.02, 0.012], black, 1))
    return parts


def foot_ring(reach: float, inner: float, height: float, color: Color) -> list[Mesh]:
    """Return a round foot rest held by spokes from a column or from nothing, inner wide."""
    angles = np.linspace(0, 2 * math.pi, 17)
    ring = np.column_stack([reach * np.cos(angles), reach * np.sin(angles), 0 * angles + height])
    spokes = [rod([0, 0, height], ring[i], max(0.4 * inner, 0.008), color) for i in (0, 8)]
    return [tube(ring, 0.012, color, sections=6), *spokes]
