"""Blocks with what a mill takes away: holes, slots, pockets, steps, chamfers; cast cases."""


from active_recon.shapes.common.drawing import choose
from active_recon.shapes.things.colors import draw_palette
from active_recon.shapes.things.drawing import chance
from active_recon.shapes.things.fields import block, Body, column, half_space, molten
import numpy as np
from numpy.typing import NDArray
import trimesh

Points = NDArray[np.float64]


def milled(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return a block or a round blank with holes, slots, pockets, steps and chamfers cut in."""
    main, second, accent, detail = draw_palette(rng)
    half = rng.uniform(0.3, 1, 3)
    inside = [main, second][rng.integers(2)]
    if chance(rng, 0.7):
        bodies = [block(-half, half, main, rng.choice([0, 0.08]))]
    else:
        half[:2] = half[0]
        bodies = [column([0, 0, -half[2]], [0, 0, half[2]], half[0], main)]
    if chance(rng, 0.5):  # a boss
        axis = int(rng.integers(3))
        along = np.eye(3)[axis]
        rise = half[axis] + rng.uniform(0.2, 0.6)
        radius = rng.uniform(0.4, 0.85) * np.delete(half, axis).min()
        bodies.append(column(along * 0, along * rise, radius, accent))
    cuts: list[Body] = []
    for _ in range(int(rng.integers(2, 7))):
        cuts.append(_cut(rng, half, detail if chance(rng, 0.2) else inside))
    return molten(bodies, cuts=cuts, cells=52)


def _cut(rng: np.random.Generator, half: Points, color: Points) -> Body:
    axis = int(rng.integers(3))
    along = np.eye(3)[axis]
    side, other = (i for i in range(3) if i != axis)
    reach = 1.2 * half.max() * along
    kind = choose(rng, {'hole': 0.4, 'slot': 0.2, 'pocket': 0.15, 'step': 0.13, 'chamfer': 0.12})
    at = np.zeros(3)
    at[side], at[other] = rng.uniform(-0.4, 0.4, 2) * half[[side, other]] * rng.choice([0, 1])
    room = float(half[[side, other]].min())
    if kind == 'hole':
        start = at - reach if chance(rng, 0.7) else at
        return column(start, at + reach * 1.5, rng.uniform(0.2, 0.65) * room, color)
    low, high = -1.5 * half, 1.5 * half
    if kind == 'slot':
        wide = rng.uniform(0.15, 0.4) * half[side]
        low[side], high[side] = at[side] - wide, at[side] + wide
        low[other] = rng.uniform(-0.5, 0.4) * half[other]
        return block(low, high, color)
    if kind == 'pocket':
        size = rng.uniform(0.5, 0.8) * half
        low, high = -size, size
        high[axis] = 1.5 * half[axis]
        return block(low, high, color)
    if kind == 'step':
        low[side] = rng.uniform(0, 0.5) * half[side] * rng.choice([-1, 1])
        low[other] = rng.uniform(-0.2, 0.5) * half[other]
        if low[side] < 0:
            low[side], high[side] = -1.5 * half[side], low[side]
        return block(low, high, color)
    signs = rng.choice([-1, 1], 2)
    outward = np.zeros(3)
    outward[side], outward[other] = signs
    corner = np.zeros(3)
    corner[side], corner[other] = signs * half[[side, other]]
    depth = rng.uniform(0.3, 1) * room
    return half_space(corner - outward * depth / 2, -outward, color)


def housing(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return a cast case: open or closed, with lugs, ribs, a bearing seat, windows."""
    main, second, accent, _ = draw_palette(rng)
    half = np.array([1, rng.uniform(0.5, 1), rng.uniform(0.3, 0.9)])
    wall = rng.uniform(0.1, 0.18)
    bodies = [block(-half, half, main, rng.choice([0, 0.12]))]
    cuts = []
    if chance(rng, 0.7):
        inner = half - wall
        cuts.append(block(-inner, inner + [0, 0, 2 * wall], second))
    if chance(rng, 0.6):  # lugs with screw holes
        reach = half + [rng.uniform(0.25, 0.45), 0, 0]
        wide = rng.uniform(0.5, 1) * half[1]
        bodies.append(block([-reach[0], -wide, -half[2]], [reach[0], wide, -half[2] + wall], main))
        for x in (-1, 1):
            at = np.array([x * (half[0] + reach[0]) / 2, 0, 0])
            cuts.append(column(at - [0, 0, 2], at + [0, 0, 2], 0.35 * (reach[0] - half[0]),
                               second))
    if chance(rng, 0.5):  # a bearing seat through two walls
        radius = rng.uniform(0.3, 0.8) * half[2]
        axis = [0, 1.3 * half[1], 0] if chance(rng, 0.6) else [1.25 * half[0], 0, 0]
        seat = column(np.negative(axis), axis, min(radius * 1.35, 0.98 * half[2]), accent)
        bodies.append(seat)
        cuts.append(column(np.multiply(axis, -2), np.multiply(axis, 2), 0.75 * radius, second))
    if chance(rng, 0.4):
        for x in np.linspace(-0.7, 0.7, int(rng.integers(2, 6))):
            bodies.append(block([x - 0.05, -half[1] - 0.15, -half[2]],
                                [x + 0.05, half[1] + 0.15, half[2] * rng.uniform(0.3, 1)], main))
    if chance(rng, 0.3):
        size = half * rng.uniform(0.3, 0.6, 3)
        cuts.append(block([-size[0], -2, -size[2]], [size[0], 2, size[2]], second))
    return molten(bodies, cuts=cuts, cells=52)
