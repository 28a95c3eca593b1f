"""Sofas on an open frame of wood or metal: settees and futons."""

from active_recon.shapes.chair.backs import BACKS, leaned
from active_recon.shapes.chair.bases import legs, Seat, sled
from active_recon.shapes.chair.parts import arms, seat_parts
from active_recon.shapes.common import materials
from active_recon.shapes.common.parts import beam, box, Mesh, mirrored
from active_recon.shapes.common.soft_parts import cushion, tilted
import numpy as np


def settee(rng: np.random.Generator) -> list[Mesh]:
    """Return a wide wooden or tubular frame with a back like a chair's, bare or cushioned."""
    frame = materials.wood(rng) if rng.random() < 0.6 else materials.metal(rng)
    cover, width = materials.fabric(rng), rng.uniform(1.05, 1.9)
    seat = Seat(width, width, rng.uniform(0.5, 0.7), rng.uniform(0.36, 0.45),
                rng.uniform(0.04, 0.09), stoutness=rng.uniform(1.3, 2.2))
    lean, height = rng.uniform(0.05, 0.35), rng.uniform(0.35, 0.6)
    back_parts = BACKS[rng.choice([0, 1, 2, 3, 4])](rng, seat, height, frame, cover)
    if rng.random() < 0.7:
        thickness, count = rng.uniform(0.08, 0.15), int(rng.integers(1, 4))
        edges = np.linspace(-width / 2, width / 2, count + 1) * 0.94
        for a, b in zip(edges[:-1], edges[1:], strict=True):
            back_parts.append(cushion([0, a, thickness], [thickness, b - 0.005, 0.95 * height],
                                      cover, 0.04))
    pads = seat_parts(rng, seat, frame, cover)
    base = legs if rng.random() < 0.7 else sled
    parts = [*pads, *base(rng, seat, frame), *leaned(back_parts, seat, lean, 0),
             *arms(rng, seat, lean, frame, cover)]
    if rng.random() < 0.7:
        y = width / 2 - 0.04
        parts.append(cushion([-seat.depth / 2 + 0.02, -y, seat.top - 0.01],
                             [seat.depth / 2, y, seat.top + 0.12], cover, 0.04))
    return parts


def futon(rng: np.random.Generator) -> list[Mesh]:
    """Return a folded mattress on a slatted frame between two side frames."""
    frame, cover = materials.wood(rng), materials.fabric(rng)
    if rng.random() < 0.3:
        frame = materials.metal(rng)
    half, depth, top = rng.uniform(0.7, 1.05), rng.uniform(0.75, 0.95), rng.uniform(0.28, 0.36)
    pad, lean, rise = rng.uniform(0.1, 0.2), rng.uniform(0.2, 0.5), rng.uniform(0.5, 0.65)
    x, bar = depth / 2, rng.uniform(0.05, 0.08)
    pivot = np.array([-0.55 * x, 0, top])
    seat_pad = cushion([-0.6 * x, -half, top], [x, half, top + pad], cover, 0.05, 0.01)
    back_pad = cushion([-0.55 * x, -half, top], [pad - 0.55 * x, half, top + rise], cover, 0.05)
    parts = [seat_pad, tilted(back_pad, pivot, lean)]
    for y in np.linspace(-0.9, 0.9, 7) * half:
        parts.append(tilted(box([-0.55 * x - 0.03, y - 0.03, top], [-0.55 * x + 0.01, y + 0.03,
                            top + 0.95 * rise], frame), pivot, lean))
    parts.append(box([-x, -half - 0.01, top - 0.06], [x, half + 0.01, top + 0.005], frame))
    arm_top = top + rng.uniform(0.15, 0.35)
    for s in (-1, 1):
        parts.append(mirrored(box([s * x - bar / 2, half, 0], [s * x + bar / 2, half + bar,
                                                              arm_top], frame)))
    parts += [mirrored(box([-x - 0.04, half - 0.01, arm_top - 0.02],
                           [x + 0.04, half + bar + 0.01, arm_top + 0.02], frame)),
              mirrored(box([-x, half, top - 0.07], [x, half + bar, top], frame))]
    for place in np.linspace(-x, x, int(rng.integers(0, 7)) + 2)[1:-1]:
        parts.append(mirrored(beam([place, half + bar / 2, top - 0.02],
                                   [place, half + bar / 2, arm_top], 0.03, frame)))
    return parts
