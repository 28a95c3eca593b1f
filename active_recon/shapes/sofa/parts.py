"""Arms, backs, cushions and feet of upholstered seats."""

from dataclasses import dataclass
import math

from active_recon.shapes.common import materials
from active_recon.shapes.common.parts import (
    beam,
    box,
    Color,
    lathe,
    Mesh,
    mirrored,
    prism,
    rod,
    tube,
)
from active_recon.shapes.common.soft_parts import cushion, tilted
import numpy as np


@dataclass(frozen=True)
class Plan:
    """The measures of a straight sofa, its seat's middle above the origin; metres."""

    seats: int
    span: float  # between the arms
    depth: float
    lift: float  # the frame's height over the floor
    deck: float  # the top of the frame, on which the seat cushions lie
    seat_top: float
    arm_top: float
    back_top: float
    back: float  # the back's thickness
    arm: float  # the arms' thickness
    radius: float
    body: Color
    pads: Color
    frame: Color

    @property
    def rear(self) -> float:
        return -self.depth / 2

    @property
    def front(self) -> float:
        return self.depth / 2


ARM_KINDS = ('box', 'rolled', 'sloped', 'thin', 'open', 'pillow', 'scoop', 'none')
BACK_KINDS = ('tight', 'loose', 'low', 'channels', 'camel', 'parted')


def arms(rng: np.random.Generator, plan: Plan, kind: str) -> list[Mesh]:
    """Return both arms of a kind, from the frame's underside up."""
    y, low, top = plan.span / 2, plan.lift, plan.arm_top
    front = plan.front - rng.choice([0, rng.uniform(0.02, 0.05)])
    if kind == 'none':
        return []
    if kind == 'rolled':
        radius = 0.62 * plan.arm
        middle = y + 0.6 * plan.arm
        post = box([plan.rear, y, low], [front, y + plan.arm, top - radius], plan.body)
        roll = rod([plan.rear, middle, top - radius], [front + 0.02, middle, top - radius], radius,
                   plan.body, sections=16)
        return [mirrored(post), mirrored(roll)]
    if kind in ('sloped', 'scoop'):
        drop = rng.uniform(0.3, 0.8) * (top - plan.seat_top + 0.05)
        x = np.linspace(plan.rear, front, 9)
        share = np.linspace(0, 1, 9)
        fall = share if kind == 'sloped' else np.sin(share * math.pi / 2) ** 0.5
        high = min(plan.back_top, top + 0.12)
        upper = np.column_stack([x, high - (high - top + drop) * fall])
        outline = np.vstack([[[plan.rear, low], [front, low]], upper[::-1]])
        return [mirrored(prism(outline, y, y + plan.arm, 'y', plan.body))]
    if kind == 'open':
        width = max(0.04, 0.4 * plan.arm)
        post_x = (plan.rear + 0.03, front - 0.03)
        parts = [beam([x, y + width / 2, 0], [x, y + width / 2, top], width, plan.frame)
                 for x in post_x]
        parts += [beam([plan.rear, y + width / 2, top], [front, y + width / 2, top], 1.5 * width,
                       plan.frame, 0.04),
                  beam([plan.rear, y + width / 2, plan.deck - 0.05],
                       [front, y + width / 2, plan.deck - 0.05], width, plan.frame, 0.06)]
        count = int(rng.integers(0, 6))
        for x in np.linspace(plan.rear, front, count + 2)[1:-1]:
            parts.append(beam([x, y + width / 2, plan.deck - 0.05], [x, y + width / 2, top], 0.03,
                              plan.frame))
        return [mirrored(part) for part in parts]
    if kind == 'pillow':
        split = top - 0.12
        return [mirrored(cushion([plan.rear, y, low], [front, y + plan.arm, split], plan.body,
                                 0.03)),
                mirrored(cushion([plan.rear, y - 0.02, split - 0.01],
                                 [front + 0.02, y + plan.arm + 0.02, top], plan.pads, 0.06))]
    width = plan.arm if kind == 'box' else 0.07
    color = plan.frame if kind == 'thin' and rng.random() < 0.4 else plan.body
    return [mirrored(cushion([plan.rear, y, low], [front, y + width, top], color,
                             plan.radius if kind == 'box' else 0.02))]


def back(rng: np.random.Generator, plan: Plan, kind: str, width: float) -> list[Mesh]:
    """Return the back of a kind, width wide, with its loose cushions."""
    low, inside = plan.lift, plan.rear + plan.back
    lean = rng.uniform(0, 0.2)
    if kind == 'camel':
        return [_camel(plan, width, rng.uniform(0.06, 0.16))]
    if kind == 'tight':
        block = cushion([plan.rear, -width / 2, low], [inside, width / 2, plan.back_top],
                        plan.body, plan.radius)
        return [tilted(block, [plan.rear, 0, plan.deck], 0.5 * lean)]
    if kind in ('low', 'loose'):
        thin = 0.55 * plan.back if kind == 'loose' else plan.back
        top = plan.arm_top if kind == 'low' else plan.back_top - rng.uniform(0, 0.12)
        parts = [cushion([plan.rear, -width / 2, low], [plan.rear + thin, width / 2, top],
                         plan.body, 0.5 * plan.radius)]
        if kind == 'loose' or rng.random() < 0.5:
            parts += _row(plan, plan.rear + thin - 0.02, rng.uniform(0.14, 0.2), lean,
                          plan.back_top + rng.choice([0, 0.06]), plan.pads, 0.06)
        return parts
    count = plan.seats if kind == 'parted' else int(rng.integers(4, 6)) * plan.seats
    thin = plan.back if kind == 'parted' else 0.5 * plan.back
    parts = [cushion([plan.rear, y - 0.5 * plan.span / count + 0.004, plan.deck - 0.02],
                     [plan.rear + plan.back, y + 0.5 * plan.span / count - 0.004, plan.back_top],
                     plan.pads, plan.radius)
             for y in (np.arange(count) + 0.5) / count * plan.span - plan.span / 2]
    core = box([plan.rear, -width / 2 + 0.01, low],
               [plan.rear + 0.6 * thin, width / 2 - 0.01, plan.back_top - 0.05], plan.body)
    return [core, *parts]


def seat_cushions(rng: np.random.Generator, plan: Plan, start: float) -> list[Mesh]:
    """Return the cushions on the frame from x = start to the front: one each, or one for all."""
    count = plan.seats if rng.random() < 0.7 else 1
    over, crown = rng.uniform(-0.02, 0.03), rng.uniform(0, 0.025)
    edges = np.linspace(-plan.span / 2, plan.span / 2, count + 1)
    return [cushion([start, a + 0.004, plan.deck - 0.005], [plan.front + over, b - 0.004,
                                                           plan.seat_top], plan.pads,
                    plan.radius, crown) for a, b in zip(edges[:-1], edges[1:], strict=True)]


def feet(rng: np.random.Generator, plan: Plan, width: float) -> list[Mesh]:
    """Return what lifts the frame, width wide over all: feet, legs, a plinth, or runners."""
    x, y, top = plan.depth / 2 - 0.09, width / 2 - 0.05, plan.lift + 0.01
    if plan.lift < 0.01:
        return []
    if plan.lift < 0.09 and rng.random() < 0.5:
        return [box([-x, -y, 0], [x, y, top], plan.frame)]
    kind = rng.choice(['block', 'cone', 'bun', 'runner'])
    if kind == 'runner':
        path = [[-x, y, top], [-x, y, 0.02], [x, y, 0.02], [x, y, top]]
        return [mirrored(tube(path, 0.02, materials.metal(rng), sections=6))]
    across = (y, 0.0) if plan.seats > 2 and rng.random() < 0.4 else (y,)
    parts = []
    for s, side in [(s, side) for s in (-1, 1) for side in across]:
        at = np.array([s * x, side, 0])
        size = rng.uniform(0.028, 0.032) + 0.1 * plan.lift
        if kind == 'block':
            leg = box(at - [size, size, 0], at + [size, size, top], plan.frame)
        elif kind == 'cone':
            leg = rod(at + [0, 0, top], at * [1.08, 1.04, 0], size, plan.frame,
                      end_radius=0.5 * size)
        else:
            leg = lathe([[0.6 * size, 0], [1.3 * size, 0.45 * top], [0.8 * size, top]], plan.frame,
                        at, sections=12)
        parts.append(mirrored(leg))
    return parts


def throws(rng: np.random.Generator, plan: Plan, start: float) -> list[Mesh]:
    """Return a few loose pillows that lean on the back."""
    color, parts = materials.fabric(rng), []
    for side in rng.uniform(-1, 1, int(rng.integers(1, 4))):
        size = rng.uniform(0.16, 0.22)
        y = side * max(plan.span / 2 - size, 0)
        pillow = cushion([start, y - size, plan.seat_top - 0.01],
                         [start + 0.12, y + size, plan.seat_top + 1.8 * size], color, 0.055)
        parts.append(tilted(pillow, [start + 0.12, 0, plan.seat_top], rng.uniform(0.1, 0.4)))
    return parts


def _row(plan: Plan, start: float, thickness: float, lean: float, top: float, color: Color,
         radius: float) -> list[Mesh]:
    edges = np.linspace(-plan.span / 2, plan.span / 2, plan.seats + 1)
    return [tilted(cushion([start, a + 0.004, plan.seat_top - 0.02],
                           [start + thickness, b - 0.004, top], color, radius),
                   [start + thickness, 0, plan.seat_top], lean)
            for a, b in zip(edges[:-1], edges[1:], strict=True)]


def _camel(plan: Plan, width: float, hump: float) -> Mesh:
    across = np.linspace(-1, 1, 13)
    tops = plan.back_top - hump + hump * (0.5 + 0.5 * np.cos(math.pi * across))
    outline = np.vstack([[[-width / 2, plan.lift], [width / 2, plan.lift]],
                         np.column_stack([across * width / 2, tops])[::-1]])
    return prism(outline, plan.rear, plan.rear + plan.back, 'x', plan.body)
