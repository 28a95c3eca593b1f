"""Seats and arms of chairs."""

import math

from active_recon.shapes.chair.bases import Seat
from active_recon.shapes.common.parts import (
    beam,
    Color,
    lathe,
    Mesh,
    mirrored,
    prism,
    superellipse,
    tube,
)
from active_recon.shapes.common.soft_parts import cushion, filleted, smoothed
import numpy as np


def seat_parts(rng: np.random.Generator, seat: Seat, frame: Color, cover: Color) -> list[Mesh]:
    """Return the seat: a board, a padded board, or a cushion."""
    low, high = [-seat.depth / 2, -seat.width / 2], [seat.depth / 2, seat.width / 2]
    padding = 0.0 if seat.thickness < 0.05 else rng.choice([0.6, 1.0]) * seat.thickness
    split = seat.top - padding
    parts = []
    if seat.is_round:
        radius, edge = seat.width / 2, min(0.015, seat.thickness / 3)
        profile = [[radius - edge, seat.bottom], [radius, seat.bottom + edge]]
        if padding:
            profile += [[radius, seat.top - 2 * edge], [0.85 * radius, seat.top],
                        [0.4 * radius, seat.top + 0.2 * padding]]
        else:
            profile += [[radius, seat.top - edge], [radius - edge, seat.top]]
        return [lathe(profile, cover if padding else frame)]
    if padding < seat.thickness:
        half = np.array([seat.depth / 2, 1])
        outline = np.array([[1, seat.width / 2], [-1, seat.back_width / 2],
                            [-1, -seat.back_width / 2], [1, -seat.width / 2]]) * half
        if rng.random() < 0.4:
            outline = superellipse(seat.depth, seat.width, rng.uniform(3.5, 7))
            outline[:, 1] *= np.interp(outline[:, 0], [-seat.depth / 2, seat.depth / 2],
                                       [seat.back_width / seat.width, 1])
        parts.append(prism(outline, seat.bottom, split, 'z', frame))
    if padding:
        pad = cushion([*low, split], [*high, seat.top], cover, rng.uniform(0.02, 0.05),
                      rng.uniform(0, 0.02))
        pad.vertices *= np.column_stack([np.ones(len(pad.vertices)), np.interp(
            pad.vertices[:, 0], [low[0], high[0]], [seat.back_width / seat.width, 1]),
            np.ones(len(pad.vertices))])
        parts.append(pad)
    return parts


def arms(rng: np.random.Generator, seat: Seat, lean: float, frame: Color,
         cover: Color) -> list[Mesh]:
    """Return two arms that rest on the seat's sides and reach back to the back's plane."""
    height = seat.top + rng.uniform(0.17, 0.26)
    side = min(seat.width, seat.back_width) / 2 - 0.005
    back = seat.back_x - math.tan(lean) * (height - seat.top) - 0.01
    front = rng.uniform(0.25, 0.5) * seat.depth
    width = rng.uniform(0.035, 0.07) * seat.stoutness
    kind = rng.choice(['post', 'padded', 'loop', 'panel', 'tee', 'bow'])
    root = np.array([back, seat.back_span / 2, height])
    hand = np.array([front, side, height])
    low = seat.bottom + 0.005
    if kind == 'loop':
        path = filleted([[0.8 * front, side, low], [front, side, height],
                         [seat.back_x + 0.03, side, height], [seat.back_x + 0.03, side, low]],
                        rng.uniform(0.02, 0.1))
        return [mirrored(tube(path, 0.4 * width, frame, sections=6))]
    if kind == 'panel':
        return [mirrored(cushion([back, side - 0.01, low], [front, side + width, height], cover,
                                 0.02))]
    if kind == 'tee':
        return [mirrored(beam([0, side, low + 0.01], [0, side + 0.03, height], 0.04, frame, 0.03)),
                mirrored(cushion([-0.14, side, height - 0.015],
                                 [0.14, side + 0.07, height + 0.02], frame, 0.015))]
    if kind == 'bow':
        elbow = [front + 0.02, side + 0.03, height]
        path = smoothed(np.array([root, elbow, [0.6 * front, side, low]]))
        return [mirrored(tube(path, 0.017 * seat.stoutness, frame, sections=6))]
    parts = [mirrored(beam(root, hand + [0.03, 0, 0], width, frame, 0.025)),
             mirrored(beam([0.9 * front, side, low], hand * [0.9, 1, 1], 0.03 * seat.stoutness,
                           frame))]
    if kind == 'padded':
        parts.append(mirrored(cushion([back + 0.1, side - width / 2, height],
                                      [front, side + width / 2, height + 0.035], cover, 0.015)))
    return parts
