"""Tall beds: bunks, lofts over a desk or drawers, four-posters with and without a canopy."""

from active_recon.shapes.bed.frames import base, bedding, board, Livery, Plan, post
from active_recon.shapes.common.parts import assemble, beam, box, Mesh, mirrored
from active_recon.shapes.common.soft_parts import cushion
import numpy as np


def bunk(rng: np.random.Generator, plan: Plan, livery: Livery) -> list[Mesh]:
    """Return two beds over each other, or a loft bed with something else below."""
    width = rng.uniform(0.85, 1.05)
    x, half, thick = plan.length / 2, width / 2, rng.uniform(0.06, 0.1)
    upper = Plan(plan.length, width, rng.uniform(1.2, 1.5), 0.15)
    rail = upper.top + rng.uniform(0.12, 0.25)
    ends = str(rng.choice(['rails', 'slats', 'spindles', 'panel', 'framed']))
    parts = [*_deck(upper, livery), *bedding(rng, upper, livery)]
    for at in (-x, x):
        parts += [mirrored(post(rng, at, half, rail + 0.06, thick, False, livery.frame)),
                  board(rng, ends, at, half, upper.deck - 0.1, rail + 0.03, livery)]
    gap = rng.uniform(0.4, 0.55)  # where one climbs in
    for side, end in ((-1, x), (1, x - gap)):
        y = side * half
        parts += [box((-x, y - 0.025, z), (end, y + 0.025, z + 0.07), livery.frame)
                  for z in (upper.top + 0.03, rail - 0.06)]
        parts.append(box((end - 0.07, y - 0.03, upper.deck), (end, y + 0.03, rail),
                         livery.frame))
    below = str(rng.choice(['bed', 'wide', 'desk', 'drawers', 'open'],
                           p=[0.55, 0.15, 0.13, 0.1, 0.07]))
    front = half
    if below in ('bed', 'wide'):
        extra = rng.uniform(0.3, 0.5) if below == 'wide' else 0.0
        lower = Plan(plan.length, width + extra, rng.uniform(0.22, 0.38), 0.16)
        kind = 'drawers' if rng.random() < 0.3 else 'rails'
        under = assemble([*base(rng, kind, lower, livery), *bedding(rng, lower, livery)])
        under.apply_translation((0, extra / 2, 0))
        parts.append(under)
        front += extra
        parts += [board(rng, ends, at, half, lower.deck - 0.05, lower.top + 0.25, livery)
                  for at in (-x, x)]
    elif below == 'desk':
        parts += [box((-x, -half, 0.7), (x, half * 0.3, 0.76), livery.panel),
                  box((-x, -half, 1.0), (x, -half + 0.25, 1.05), livery.panel),
                  box((-x, -half, 0.1), (-x + 0.45, half * 0.2, 0.72), livery.frame)]
    elif below == 'drawers':
        parts.append(box((-x, -half, 0.04), (x, half, 0.9 * upper.deck), livery.panel))
        edges = np.linspace(-x + 0.06, x - gap, 3)
        parts += [box((a + 0.03, half - 0.02, z + 0.02), (b - 0.03, half + 0.04, z + 0.3),
                      livery.frame) for a, b in zip(edges[:-1], edges[1:], strict=True)
                  for z in (0.1, 0.42, 0.74)]
    parts.append(_climb(rng, x - gap / 2, half, front, upper.top, gap, livery))
    return parts


def _deck(plan: Plan, livery: Livery) -> list[Mesh]:
    x, y, deck = plan.length / 2, plan.width / 2, plan.deck
    return [box((-x, -y, deck - 0.06), (x, y, deck), livery.panel),
            mirrored(box((-x, y - 0.03, deck - 0.1), (x, y + 0.03, deck + 0.05), livery.frame))]


def _climb(rng: np.random.Generator, x: float, upper_y: float, lower_y: float, high: float,
           gap: float, livery: Livery) -> Mesh:
    """Return a ladder or, at the side, a stair of chests."""
    if rng.random() < 0.2:
        count = 4
        deep = 0.28
        edges = np.linspace(x + gap / 2 - count * deep, x + gap / 2, count + 1)
        return assemble([box((a, lower_y - 0.02, 0), (b, lower_y + 0.42, high * (i + 1) / 5),
                             livery.panel if i % 2 else livery.frame)
                         for i, (a, b) in enumerate(zip(edges[:-1], edges[1:], strict=True))])
    foot = np.array([x, max(lower_y, upper_y) + rng.uniform(0.06, 0.3), 0])
    head = np.array([x, upper_y + 0.04, high + 0.1])
    across = np.array([0.4 * gap, 0, 0])
    steps = [beam(foot + share * (head - foot) - across, foot + share * (head - foot) + across,
                  0.05, livery.frame, 0.05) for share in np.linspace(0.14, 0.86, 5)]
    rails = [beam(foot + side * across, head + side * across, 0.06, livery.frame)
             for side in (-1, 1)]
    hook = box(head + [-0.4 * gap, -0.1, -0.16], head + [0.4 * gap, 0.0, -0.1], livery.frame)
    return assemble([*steps, *rails, hook])


def four_poster(rng: np.random.Generator, plan: Plan, livery: Livery) -> list[Mesh]:
    """Return a bed with four high posts, mostly joined above; with a canopy and curtains."""
    x, half = plan.length / 2 + 0.02, plan.width / 2 + 0.01
    high, thick = rng.uniform(1.7, 2.2), rng.uniform(0.07, 0.11)
    joined = rng.random() < 0.85
    turned = bool(rng.random() < (0.25 if joined else 0.7))
    style = str(rng.choice(['panel', 'framed', 'slats', 'arched', 'tufted', 'spindles']))
    parts = [*base(rng, 'rails', plan, livery), *bedding(rng, plan, livery),
             board(rng, style, -x, half, plan.deck - 0.1, plan.top + rng.uniform(0.3, 0.7),
                   livery)]
    for at in (-x, x):
        parts.append(mirrored(post(rng, at, half, high, thick, turned, livery.frame)))
    if rng.random() < 0.5:
        parts.append(board(rng, 'framed', x, half, plan.deck - 0.1, plan.top + 0.08, livery))
    if not joined:
        return parts
    bar = 0.8 * thick
    parts += [mirrored(box((-x, half - bar / 2, high - bar), (x, half + bar / 2, high),
                           livery.frame))]
    parts += [box((at - bar / 2, -half, high - bar), (at + bar / 2, half, high), livery.frame)
              for at in (-x, x)]
    roof = rng.choice(['open', 'flat', 'slats', 'valance'], p=[0.4, 0.25, 0.15, 0.2])
    if roof in ('flat', 'valance'):
        drop = rng.uniform(0.15, 0.28) if roof == 'valance' else 0.05
        parts.append(box((-x, -half, high - 0.05), (x, half, high + 0.02), livery.throw))
        parts.append(mirrored(box((-x, half - 0.02, high - drop), (x, half + 0.04, high),
                                  livery.throw)))
        parts.append(box((x - 0.02, -half, high - drop), (x + 0.04, half, high), livery.throw))
    elif roof == 'slats':
        parts += [box((at - 0.04, -half, high - bar), (at + 0.04, half, high), livery.frame)
                  for at in np.linspace(-x, x, 7)[1:-1]]
    if rng.random() < 0.4:
        wide = rng.uniform(0.12, 0.3)
        parts += [mirrored(cushion((at, half - 0.05, 0.1), (at + wide, half + 0.05, high - 0.02),
                                   livery.throw, 0.03)) for at in (-x - 0.03, x - wide + 0.03)]
    return parts
