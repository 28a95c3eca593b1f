"""Easy chairs: tubs, lounge chairs with loose cushions, and folding frames with cloth."""

import math

from active_recon.shapes.chair.backs import BACKS, leaned, padded
from active_recon.shapes.chair.bases import legs, rockers, scissors, Seat, sled
from active_recon.shapes.chair.columns import pedestal, star
from active_recon.shapes.chair.parts import arms, seat_parts
from active_recon.shapes.common import materials
from active_recon.shapes.common.parts import (
    beam,
    Color,
    lathe,
    Mesh,
    mirrored,
    prism,
    rod,
    superellipse,
    tube,
)
from active_recon.shapes.common.soft_parts import cushion, shell, smoothed, wall
import numpy as np

Colors = tuple[Color, Color]  # the frame's and the cover's


def draw_colors(rng: np.random.Generator) -> Colors:
    """Return colours that go together; often one alone."""
    frame = [materials.wood, materials.metal, materials.paint][rng.choice(3, p=[0.55, 0.2, 0.25])]
    first = frame(rng)
    return first, first if rng.random() < 0.3 else materials.fabric(rng)


def tub(rng: np.random.Generator) -> list[Mesh]:
    """Return a barrel: one wall bent round the seat, its arms as high as its back or lower."""
    frame, cover = draw_colors(rng)
    inner = cover if rng.random() < 0.5 else materials.fabric(rng)
    reach, opening = rng.uniform(0.3, 0.42), rng.uniform(0.25, 0.42) * math.pi
    thickness = rng.uniform(0.035, 0.11)
    lift = rng.choice([0.0, rng.uniform(0.06, 0.25)])
    seat_top = rng.uniform(0.34, 0.46)
    angles = np.linspace(opening, 2 * math.pi - opening, 17)
    path = reach * np.column_stack([np.cos(angles), np.sin(angles)])
    if rng.random() < 0.5:  # straight arms run on to the front
        front = rng.uniform(0.6, 0.95) * reach
        path = np.vstack([[front, path[0, 1]], path, [front, path[-1, 1]]])
    back_top, arm_top = rng.uniform(0.62, 0.92), rng.uniform(0.52, 0.68)
    share = np.clip(1.3 * (path[:, 0].max() - path[:, 0]) / np.ptp(path[:, 0]), 0, 1)
    share **= rng.uniform(0.5, 1.6)
    tops = arm_top + max(back_top - arm_top, 0) * share**2 * (3 - 2 * share)
    radius = reach + 0.01
    bottom = lift + rng.choice([0, 0.03])
    disc = superellipse(2 * radius, 2 * radius, 2) * 0.98
    disc[:, 0] = np.maximum(disc[:, 0], -reach)
    parts = [wall(path, bottom, tops, thickness, cover, rng.choice([0, rng.uniform(0, 0.12)])),
             prism(disc, lift, seat_top - 0.12, 'z', cover),
             lathe([[radius - 0.03, seat_top - 0.13], [radius, seat_top - 0.1],
                    [radius, seat_top - 0.03], [0.85 * radius, seat_top],
                    [0.4 * radius, seat_top + 0.015]], inner)]
    seat = Seat(2 * reach, 2 * reach, 2 * reach, lift + 0.02, 0.02, True)
    if lift:
        base = [legs, legs, star if lift > 0.2 else legs, pedestal][rng.choice(4)]
        parts += base(rng, seat, frame)
    return parts


def lounge(rng: np.random.Generator) -> list[Mesh]:
    """Return a low wooden or tubular easy chair with loose cushions on a leaning frame."""
    frame, cover = draw_colors(rng)
    width = rng.uniform(0.55, 0.7)
    seat = Seat(width, width, rng.uniform(0.55, 0.7), rng.uniform(0.3, 0.4), 0.04,
                stoutness=rng.uniform(0.9, 1.7))
    lean, height = rng.uniform(0.2, 0.45), rng.uniform(0.45, 0.75)
    back = BACKS[rng.choice([1, 2, 3, 5])](rng, seat, height, frame, cover)
    padding = rng.uniform(0.08, 0.14)
    soft = [cushion([0, -seat.width / 2 + 0.04, padding], [padding, seat.width / 2 - 0.04,
                                                         height + 0.05], cover, 0.04)]
    base = [legs, legs, sled, rockers][rng.choice(4)]
    return [*base(rng, seat, frame), *seat_parts(rng, seat, frame, frame),
            *arms(rng, seat, lean, frame, cover), *leaned([*back, *soft], seat, lean, 0),
            cushion([-seat.depth / 2, -seat.width / 2 + 0.03, seat.top - 0.005],
                     [seat.depth / 2 + 0.02, seat.width / 2 - 0.03, seat.top + padding], cover,
                     0.04, 0.01)]


def sling(rng: np.random.Generator) -> list[Mesh]:
    """Return a folding frame with cloth: a deck chair, a director's chair, or a long lounger."""
    frame, cover = draw_colors(rng)
    radius, y = rng.uniform(0.013, 0.024), rng.uniform(0.24, 0.32)
    kind = rng.choice(['deck', 'director', 'lounger'])
    if kind == 'director':
        seat = Seat(2 * y, 2 * y, rng.uniform(0.4, 0.48), rng.uniform(0.42, 0.6), 0.03)
        back = padded(rng, seat, rng.uniform(0.35, 0.5), frame, cover)
        return [*seat_parts(rng, seat, cover, cover), *scissors(rng, seat, frame),
                *leaned(back, seat, rng.uniform(0, 0.15), 0), *arms(rng, seat, 0.05, frame, cover)]
    if kind == 'deck':
        head, foot = [-0.55, 0.85 + rng.uniform(0, 0.2)], [0.55, 0.28]
        floor = [0.6 + rng.uniform(0, 0.1), 0.0]
        prop = np.array([head[0] + 0.35, head[1] - 0.25])
        parts = [mirrored(beam([head[0], y, head[1]], [floor[0], y, floor[1]], 2 * radius, frame)),
                 mirrored(beam([foot[0], y - 0.03, foot[1]], [-0.5, y - 0.03, 0], 2 * radius,
                               frame)),
                 *[rod([x, -y, z], [x, y, z], radius, frame)
                   for x, z in (head, foot, (-0.48, 0.02), (0.63, 0.03))]]
        slack = smoothed([head, [0.05, 0.22], foot])
        parts.append(shell(slack[::-1], y - 0.02, 0.0, 0.018, cover))
        return [*parts, mirrored(rod([prop[0], y, prop[1] + 0.02], [-0.3, y - 0.03, 0.08], radius,
                                     frame))]
    top, rise = rng.uniform(0.25, 0.38), rng.uniform(0.3, 0.55)
    profile = smoothed([[0.85, top], [0.3, top + rng.uniform(0, 0.15)], [-0.25, top],
                        [-0.7, top + rise]], 1)
    parts = [shell(profile, y, 0.0, rng.uniform(0.03, 0.09), cover),
             mirrored(tube([[p[0], y, p[1] - 0.01] for p in profile], radius, frame, sections=6))]
    for x in (0.65, -0.35):
        z = float(np.interp(x, profile[::-1, 0], profile[::-1, 1]))
        parts += [mirrored(rod([x, y, z], [1.08 * x, y, 0], radius, frame)),
                  rod([x, -y, z - 0.02], [x, y, z - 0.02], radius, frame)]
    return parts
