"""Cars built from separate bodies: pickups' loads, lorries, and vintage cars with mudguards."""

import math

from active_recon.shapes.car import fittings
from active_recon.shapes.car.bodies import greenhouse, hull, Livery, Stance
from active_recon.shapes.common import materials
from active_recon.shapes.common.parts import (
    box,
    Color,
    ellipsoid,
    loft,
    Mesh,
    mirrored,
    prism,
    rod,
    superellipse,
    tube,
)
import numpy as np


def pickup_fittings(rng: np.random.Generator, stance: Stance, livery: Livery,
                    well: tuple[float, float, float]) -> list[Mesh]:
    """Return a load, a cover or a roll bar for the bed; often nothing."""
    rear, front, floor = well
    y = stance.width / 2 - 0.14
    style = rng.integers(6)
    if style == 0:
        return [box((rear - 0.05, -y, floor), (front + 0.05, y, stance.roof - 0.05), livery.roof)]
    if style == 1:
        hoop = [(front - 0.15, -y, floor), (front - 0.15, -y, stance.roof),
                (front - 0.15, y, stance.roof), (front - 0.15, y, floor)]
        return [tube(hoop, 0.06, livery.trim, 8)]
    if style == 2:
        return [box((rear + rng.uniform(0.1, 0.5), rng.uniform(-y, -0.2), floor - 0.02),
                    (front - rng.uniform(0.1, 0.5), rng.uniform(0.2, y),
                     stance.belt + rng.uniform(-0.2, 0.4)), materials.wood(rng))]
    return []


def lorry(rng: np.random.Generator, livery: Livery) -> list[Mesh]:
    """Return a lorry: a cab over the engine or behind it, and a box, tank, tipper or flatbed."""
    width, radius = rng.uniform(1.9, 2.5), rng.uniform(0.4, 0.55)
    length = rng.uniform(4.5, 9.0)
    end = length / 2
    frame = radius * rng.uniform(1.3, 1.7)  # the height of the load's floor
    roof = frame + rng.uniform(1.3, 2.1)
    cab = rng.uniform(1.5, 2.3)
    bonnet = rng.uniform(0.5, 1.3) if rng.random() < 0.4 else rng.uniform(0.02, 0.15)
    belt = frame + (roof - frame) * rng.uniform(0.35, 0.5)
    middle = end - (cab + bonnet) / 2
    stance = Stance(
        length=cab + bonnet, width=width, clearance=radius * 0.7, nose=belt * rng.uniform(0.9, 1),
        belt=belt, deck=belt, roof=roof, cowl=(cab - bonnet) / 2,
        roof_front=(cab - bonnet) / 2 - rng.uniform(0.05, 0.4),
        roof_rear=-(cab + bonnet) / 2 + 0.1, back=-(cab + bonnet) / 2 + 0.05, axles=(0, 0),
        wheel_radius=radius, smooth=rng.random() < 0.35, plan_taper=rng.uniform(0, 0.06))
    parts = [hull(stance, livery), greenhouse(stance, livery, int(rng.integers(1, 3)),
                                              tumblehome=rng.uniform(0.02, 0.12)),
             *fittings.lights(rng, stance, livery), *fittings.bumpers(rng, stance, livery.trim)]
    if rng.random() < 0.6:
        parts.append(fittings.mirrors(rng, stance, livery.trim))
    for part in parts:
        part.apply_translation((middle, 0, 0))
    parts.append(box((-end, -width * 0.3, frame - 0.3), (end - 0.4, width * 0.3, frame + 0.02),
                     livery.trim))
    parts += _load(rng, livery, (-end, end - cab - bonnet - rng.uniform(0.02, 0.3)), width, frame,
                   roof)
    tyre = radius * rng.uniform(0.6, 1.1)
    y = width / 2 - tyre / 2 + 0.02
    front, rear = end - bonnet * 0.6 - rng.uniform(0.6, 1.0), -end + rng.uniform(0.7, 1.2)
    axles = [front, rear]
    if length > 6 and rng.random() < 0.6:
        axles.append(rear + radius * rng.uniform(2.1, 2.4))
    parts.append(fittings.wheels(fittings.wheel(rng, radius, tyre, livery, 14),
                                 [(x, y, radius) for x in axles]))
    parts += [box((x - 0.1, -y, radius - 0.1), (x + 0.1, y, radius + 0.1), livery.trim)
              for x in axles]
    parts += [box((x - 0.1, -width * 0.25, radius), (x + 0.1, width * 0.25, frame), livery.trim)
              for x in axles]
    parts.append(fittings.arch(front, width / 2 - 0.015, radius, radius * 1.18, tyre, livery.trim))
    return parts


def _load(rng: np.random.Generator, livery: Livery, span: tuple[float, float], width: float,
          frame: float, roof: float) -> list[Mesh]:
    """Return what a lorry carries, between two x, standing on its frame."""
    rear, front = span
    y = width / 2 * rng.uniform(0.95, 1.05)
    color = livery.paint if rng.random() < 0.25 else materials.paint(rng)
    style = rng.choice(['box', 'tank', 'tipper', 'flat', 'tilt'], p=[0.4, 0.15, 0.2, 0.1, 0.15])
    floor = box((rear, -y, frame - 0.02), (front, y, frame + 0.14), livery.trim)
    if style == 'box':
        return [box((rear, -y, frame - 0.05), (front, y, roof + rng.uniform(-0.2, 0.9)), color)]
    if style == 'tilt':  # canvas over hoops
        height = roof - frame + rng.uniform(0, 0.5)
        outline = superellipse(2 * y, 2 * height, rng.uniform(2.2, 4), 24)
        outline[:, 1] = np.maximum(outline[:, 1], 0) + frame
        return [floor, prism(outline, rear, front, 'x', materials.fabric(rng))]
    if style == 'tank':
        height = rng.uniform(1.2, 1.8)
        outline = superellipse(2 * y * 0.95, height, rng.uniform(2, 3), 20)
        outline[:, 1] += frame + 0.05 + height / 2
        return [floor, prism(outline, rear, front, 'x', color)]
    parts = [floor]
    if style == 'tipper':
        top, flare = frame + rng.uniform(0.5, 1.1), rng.uniform(0, 0.15)
        side = [(y - 0.12, frame), (y, frame), (y + flare, top), (y + flare - 0.12, top)]
        parts += [mirrored(prism(side, rear, front, 'x', color)),
                  box((rear, -y - flare / 2, frame), (rear + 0.12, y + flare / 2, top), color),
                  box((front - 0.12, -y, frame), (front, y, top + rng.uniform(0, 0.4)), color)]
    if rng.random() < 0.6:
        heap = frame + rng.uniform(0.3, 0.8)
        parts.append(ellipsoid(((rear + front) / 2, 0, frame), ((front - rear) * 0.42, y * 0.8,
                               heap - frame), materials.wood(rng)) if style == 'tipper' else
                     box((rear + 0.3, -y * 0.8, frame), (front - rng.uniform(0.2, 1.2), y * 0.7,
                         heap + 0.4), materials.wood(rng)))
    return parts


def vintage(rng: np.random.Generator, livery: Livery) -> list[Mesh]:
    """Return a car of the thirties: a narrow body between mudguards and running boards."""
    length, width = rng.uniform(3.4, 4.8), rng.uniform(1.1, 1.4)
    end, radius = length / 2, rng.uniform(0.36, 0.48)
    clearance = radius * rng.uniform(0.8, 1.1)
    belt = clearance + rng.uniform(0.6, 0.8)
    cowl = length * rng.uniform(0.0, 0.12)
    rear = -end * rng.uniform(0.85, 0.97)
    stance = Stance(
        length=length, width=width, clearance=clearance, nose=belt * rng.uniform(0.9, 1),
        belt=belt, deck=belt * rng.uniform(0.7, 0.95), roof=belt + rng.uniform(0.5, 0.75),
        cowl=cowl, roof_front=cowl - rng.uniform(0.02, 0.25),
        roof_rear=rear * rng.uniform(0.7, 0.95), back=rear,
        axles=(end - radius * rng.uniform(0.7, 1.1), -end + radius * rng.uniform(1.0, 1.5)),
        wheel_radius=radius, smooth=rng.random() < 0.5, plan_taper=rng.uniform(0.1, 0.35))
    guard = materials.paint(rng) if rng.random() < 0.4 else livery.trim
    if rng.random() < 0.3:
        guard = livery.paint
    parts = [hull(stance, livery), greenhouse(stance, livery, int(rng.integers(1, 4)),
                                              tumblehome=rng.uniform(0, 0.1))]
    tyre = radius * rng.uniform(0.35, 0.55)
    y = width / 2 + tyre * rng.uniform(0.7, 1.2)
    one = fittings.wheel(rng, radius, tyre, livery, 16)
    parts.append(fittings.wheels(one, [(x, y, radius) for x in stance.axles]))
    for x in stance.axles:
        parts += [box((x - 0.07, -y, radius - 0.07), (x + 0.07, y, radius + 0.07), livery.trim),
                  box((x - 0.1, -0.3, radius), (x + 0.1, 0.3, clearance + 0.1), livery.trim),
                  mirrored(_mudguard(x, y, width * 0.35, radius * 1.12, tyre, radius, guard))]
    board = clearance * 0.85
    front, back = stance.axles
    parts.append(mirrored(box((back, width * 0.3, board - 0.05), (front, y + tyre * 0.5,
                                                                  board + 0.06), guard)))
    lamp = np.array([end - radius * 0.8, width * 0.42, belt * rng.uniform(0.85, 0.98)])
    size = rng.uniform(0.1, 0.17)
    parts += [mirrored(rod(lamp - (0.15, 0, 0), lamp + (0.12, 0, 0), size, livery.trim)),
              mirrored(rod(lamp, lamp + (0.14, 0, 0), size * 0.85, (250, 240, 190))),
              box((end - 0.2, -width * 0.3, clearance), (end + 0.04, width * 0.3, belt * 0.92),
                  livery.rim)]
    if rng.random() < 0.6:
        spare = one.copy()
        turn = np.eye(4)
        turn[:2, :2] = [[0, -1], [1, 0]]
        spare.apply_transform(turn)
        spare.apply_translation((-end - tyre * 0.3, 0, belt * 0.75))
        parts.append(spare)
    return parts


def _mudguard(x: float, y: float, inner: float, radius: float, tyre: float, z: float,
              color: Color) -> Mesh:
    """Return a band bent over a wheel, from the body's side to the wheel's outside."""
    loops = []
    for angle in np.linspace(math.radians(5), math.radians(175), 9):
        out = np.array([math.cos(angle), 0, math.sin(angle)])
        near, far = radius, radius + 0.08
        loops.append([(x, side, z) + out * reach for side, reach in (
            (inner, near), (y + tyre * 0.6, near), (y + tyre * 0.6, far), (inner, far))])
    return loft(loops, color)
