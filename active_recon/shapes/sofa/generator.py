"""Sofas: upholstered or of wood, straight, cornered, curved, with and without backs."""

from collections.abc import Callable
from dataclasses import replace
import math

from active_recon.shapes.common import materials
from active_recon.shapes.common.drawing import choose
from active_recon.shapes.common.parts import assemble, box, Mesh, mirrored, prism, rod, tube
from active_recon.shapes.common.soft_parts import cushion, filleted, wall
from active_recon.shapes.sofa.frames import futon, settee
from active_recon.shapes.sofa.parts import (
    ARM_KINDS,
    arms,
    back,
    BACK_KINDS,
    feet,
    Plan,
    seat_cushions,
    throws,
)
import numpy as np
import trimesh


def sofa(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return a sofa of any kind, its front at +x, z up."""
    kinds: dict[Callable[[np.random.Generator], list[Mesh]], float] = {
        _straight: 0.42, _sectional: 0.2, settee: 0.1, _chesterfield: 0.07, _curved: 0.08,
        futon: 0.06, _daybed: 0.07}
    return assemble(choose(rng, kinds)(rng))


def upholstered(rng: np.random.Generator, seats: int) -> list[Mesh]:
    """Return a straight sofa of any number of seats; an armchair where it is one."""
    plan = _plan(rng, seats)
    kind = rng.choice(ARM_KINDS, p=[0.3, 0.16, 0.1, 0.1, 0.1, 0.1, 0.08, 0.06])
    back_kind = rng.choice(BACK_KINDS, p=[0.27, 0.38, 0.08, 0.07, 0.08, 0.12])
    return _body(rng, plan, kind, back_kind)


def armchair(rng: np.random.Generator) -> list[Mesh]:
    """Return an upholstered chair with arms; some have a high back with wings."""
    if rng.random() < 0.7:
        return upholstered(rng, 1)
    plan = _plan(rng, 1)
    plan = replace(plan, back_top=plan.arm_top + rng.uniform(0.25, 0.5))
    low, reach = plan.arm_top - 0.1, plan.back + rng.uniform(0.14, 0.3)
    wing = [[plan.rear, low], [plan.rear + reach, low], [plan.rear + reach, 0.4 * low + 0.6
            * plan.back_top], [plan.rear + 0.6 * reach, plan.back_top], [plan.rear, plan.back_top]]
    y = plan.span / 2
    return [*_body(rng, plan, rng.choice(['box', 'rolled']), 'tight'),
            mirrored(prism(wing, y - 0.02, y + 0.07, 'y', plan.body))]


def _straight(rng: np.random.Generator) -> list[Mesh]:
    return upholstered(rng, int(rng.choice([1, 2, 3, 4], p=[0.1, 0.38, 0.42, 0.1])))


def _plan(rng: np.random.Generator, seats: int) -> Plan:
    """Draw a straight sofa's measures and materials."""
    lift = rng.choice([0.0, rng.uniform(0.03, 0.1), rng.uniform(0.1, 0.22)], p=[0.2, 0.45, 0.35])
    seat_top = rng.uniform(0.36, 0.5)
    deck = max(lift + 0.06, seat_top - rng.uniform(0.08, 0.22))
    arm_top = seat_top + rng.uniform(0.1, 0.28)
    body = materials.fabric(rng)
    frame = materials.wood(rng) if rng.random() < 0.6 else materials.metal(rng)
    return Plan(seats, seats * rng.uniform(0.52, 0.78) + 0.05, rng.uniform(0.72, 1.05), lift, deck,
                seat_top, arm_top, max(arm_top + 0.02, seat_top + rng.uniform(0.28, 0.55)),
                rng.uniform(0.13, 0.28), rng.uniform(0.09, 0.28), rng.uniform(0.02, 0.08), body,
                body if rng.random() < 0.6 else materials.fabric(rng), frame)


def _body(rng: np.random.Generator, plan: Plan, arm_kind: str, back_kind: str) -> list[Mesh]:
    """Return a straight sofa put together from its plan."""
    arm_width = {'none': 0.0, 'thin': 0.07, 'open': max(0.04, 0.4 * plan.arm)}.get(
        arm_kind, plan.arm)
    width = plan.span + 2 * arm_width
    back_width = plan.span if arm_kind == 'open' or rng.random() < 0.4 else width - 0.01
    seat_start = plan.rear + 0.5 * plan.back
    base_color = plan.frame if arm_kind == 'open' else plan.body
    parts = [box([plan.rear + 0.01, -plan.span / 2 - 0.01, plan.lift],
                 [plan.front - 0.01, plan.span / 2 + 0.01, plan.deck], base_color),
             *arms(rng, plan, arm_kind), *back(rng, plan, back_kind, back_width),
             *seat_cushions(rng, plan, seat_start)]
    if arm_kind != 'open':
        parts += feet(rng, plan, width)
    if rng.random() < 0.25:
        parts += throws(rng, plan, plan.rear + plan.back + 0.05)
    return parts


def _sectional(rng: np.random.Generator) -> list[Mesh]:
    """Return a sofa with a chaise or a cornered wing at its left, its right, or both sides."""
    plan = _plan(rng, int(rng.integers(2, 5)))
    arm_kind = rng.choice(['box', 'thin', 'none', 'rolled', 'pillow'])
    parts = _body(rng, plan, arm_kind, rng.choice(['tight', 'loose', 'parted']))
    wing_width = plan.span / plan.seats
    reach = rng.uniform(0.45, 1.7)
    with_back = bool(rng.random() < 0.5)
    both = rng.random() < 0.12
    for side in ((-1, 1) if both else (rng.choice([-1, 1]),)):
        parts += _wing(rng, plan, side, wing_width, reach, with_back)
    return parts


def _wing(rng: np.random.Generator, plan: Plan, side: int, width: float, reach: float,
          with_back: bool) -> list[Mesh]:
    """Return the part of a sectional that runs on forwards at one side."""
    outer, inner = side * plan.span / 2, side * (plan.span / 2 - width)
    start, end = plan.front - 0.03, plan.front + reach
    count = max(1, round(reach / 0.7)) if with_back else 1
    edges = np.linspace(start, end, count + 1)
    parts = [box([start - 0.05, inner, plan.lift], [end - 0.01, outer, plan.deck], plan.body)]
    parts += [cushion([a, inner, plan.deck - 0.005], [b, outer, plan.seat_top], plan.pads,
                      plan.radius) for a, b in zip(edges[:-1], edges[1:], strict=True)]
    if with_back:
        rest = outer + side * plan.back
        parts.append(cushion([plan.rear, outer - side * 0.01, plan.lift],
                             [end, rest, plan.back_top], plan.body, plan.radius))
        parts += [cushion([a, outer - side * 0.14, plan.seat_top - 0.02],
                          [b, outer, plan.back_top - 0.03], plan.pads, 0.05)
                  for a, b in zip(edges[:-1], edges[1:], strict=True)]
        if rng.random() < 0.5:
            parts.append(cushion([end - 0.02, inner, plan.lift],
                                 [end + plan.arm, rest, plan.arm_top], plan.body, plan.radius))
    if plan.lift > 0.01:
        parts += [box([end - 0.1, y - 0.03, 0], [end - 0.04, y + 0.03, plan.lift + 0.01],
                      plan.frame) for y in (outer - side * 0.06, inner + side * 0.06)]
    return parts


def _chesterfield(rng: np.random.Generator) -> list[Mesh]:
    """Return a sofa whose rolled arms are as high as its back and run round it as one."""
    plan = _plan(rng, int(rng.integers(1, 4)))
    y, radius, top = plan.span / 2 + 0.5 * plan.arm, rng.uniform(0.07, 0.12), plan.arm_top + 0.05
    path = np.array([[plan.front, -y], [plan.rear + 0.1, -y], [plan.rear + 0.1, y],
                     [plan.front, y]])
    rounded = bool(rng.random() < 0.5)
    if rounded:
        path = filleted(path, 0.25)
    roll = np.column_stack([path, np.full(len(path), top - radius)])
    front = [rod([plan.front - 0.01, s * y, top - radius], [plan.front + 0.015, s * y,
                 top - radius], 1.05 * radius, plan.body, sections=16) for s in (-1, 1)]
    outer = y + 0.45 * plan.arm
    sides = [mirrored(box([plan.rear, y - 0.45 * plan.arm, plan.lift],
                          [plan.front, outer, top - radius], plan.body)),
             box([plan.rear, -outer, plan.lift], [plan.rear + 0.2, outer, top - radius],
                 plan.body)]
    if rounded:
        sides = [wall(path, plan.lift, top - radius, plan.arm, plan.body)]
    stance = replace(plan, depth=plan.depth - 0.16) if rounded else plan
    return [*sides, tube(roll, radius, plan.body), *front,
            box([plan.rear + 0.14, 0.07 - y, plan.lift], [plan.front - 0.02, y - 0.07, plan.deck],
                plan.body),
            *seat_cushions(rng, plan, plan.rear + 0.1), *feet(rng, stance, 2 * y)]


def _curved(rng: np.random.Generator) -> list[Mesh]:
    """Return a sofa bent in plan: the sitters face the middle of an arc."""
    body, frame = materials.fabric(rng), materials.wood(rng)
    pads = body if rng.random() < 0.5 else materials.fabric(rng)
    reach, depth = rng.uniform(1.1, 2.4), rng.uniform(0.5, 0.75)
    half = min(rng.uniform(0.35, 1.5), 2.0 / reach) if reach > 1.4 else rng.uniform(0.6, 2.0)
    lift, seat_top = rng.choice([0.0, 0.06, 0.14]), rng.uniform(0.36, 0.46)
    angles = math.pi + np.linspace(-half, half, 17)
    ring = np.column_stack([np.cos(angles), np.sin(angles)])
    thickness = rng.uniform(0.12, 0.24)
    drop = rng.choice([0.0, 0.12]) * (np.linspace(-1, 1, 17) ** 4)
    parts = [wall(ring * reach, lift, seat_top - 0.13, depth - 0.03, body),
             wall(ring * (reach - 0.005), seat_top - 0.14, seat_top, depth, pads)]
    if rng.random() < 0.85:
        parts.append(wall(ring * (reach + depth / 2), lift, seat_top + rng.uniform(0.25, 0.45)
                          - drop, thickness, body, rng.choice([0.0, 0.15])))
        if rng.random() < 0.4:
            for end in (ring[0], ring[-1]):
                along = np.linspace(reach - depth / 2, reach + depth / 2, 3)[:, None]
                parts.append(wall(along * end, lift, seat_top + 0.2, 0.16, body))
    if lift:
        for point in ring[1::5] * reach:
            for r in (-0.35 * depth, 0.35 * depth):
                x, y = point * (reach + r) / reach
                parts.append(rod([x, y, lift + 0.01], [x, y, 0], 0.035, frame))
    return parts


def _daybed(rng: np.random.Generator) -> list[Mesh]:
    """Return a long seat with no back, or with a raised end or two, or half a back."""
    plan = _plan(rng, int(rng.integers(2, 4)))
    y = plan.span / 2
    parts = [box([plan.rear, -y, plan.lift], [plan.front, y, plan.deck],
                 plan.frame if rng.random() < 0.5 else plan.body),
             *seat_cushions(rng, plan, plan.rear), *feet(rng, plan, plan.span)]
    side = rng.choice([-1, 1])
    kind = rng.choice(['bare', 'bolster', 'end', 'half', 'ends'])
    if kind == 'bolster':
        parts.append(rod([plan.rear, side * (y - 0.1), plan.seat_top + 0.08],
                         [plan.front, side * (y - 0.1), plan.seat_top + 0.08], 0.1, plan.pads))
    if kind in ('end', 'half', 'ends'):
        for s in ((-1, 1) if kind == 'ends' else (side,)):
            end = cushion([plan.rear, s * y - 0.06, plan.lift],
                          [plan.front, s * y + 0.06, plan.back_top], plan.body, plan.radius)
            parts.append(end)
    if kind == 'half':
        parts.append(cushion([plan.rear - 0.02, side * (y + 0.05), plan.lift],
                             [plan.rear + plan.back, -side * rng.uniform(0, 0.7) * y,
                              plan.back_top], plan.body, plan.radius))
    return parts
