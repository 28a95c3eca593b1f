"""Soft and grown things: animals, plush, fruit, stones, shoes, cushions, blobs."""

import math

from active_recon.shapes.common.drawing import choose
from active_recon.shapes.common.parts import assemble, Mesh, rod
from active_recon.shapes.common.soft_parts import smoothed
from active_recon.shapes.things.animals import beast, bird, fish, plush
from active_recon.shapes.things.colors import draw_palette, ripe
from active_recon.shapes.things.drawing import chance, Generator
from active_recon.shapes.things.fields import ball, Body, half_space, limb, molten, waves
from active_recon.shapes.things.solids import circle, extruded, moved, painted, revolved, swept
import numpy as np
import trimesh


def fruit(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return a fruit or a vegetable: round, ribbed, long, bent or in a bunch, with its stalk."""
    color = ripe(rng, (-0.05, 0.35)) if chance(rng, 0.8) else draw_palette(rng)[0]
    stalk, leaf = np.array([90.0, 70, 40]), ripe(rng, (0.2, 0.4))
    kind = choose(rng, {'round': 0.4, 'bent': 0.25, 'bunch': 0.2, 'root': 0.15})
    if kind == 'bunch':
        size = rng.uniform(0.18, 0.3)
        layers = int(rng.integers(3, 6))
        bodies = [limb([0, 0, 0], [0, 0, layers * size * 1.6], 0.4 * size, stalk)]
        for i in range(layers):
            count = int(rng.integers(2, 4)) + i
            reach = size * count / math.pi * rng.uniform(0.8, 0.95)
            bodies += [ball([reach * math.cos(a), reach * math.sin(a), i * size * 1.4 + 0.1],
                            [size] * 3, color * rng.uniform(0.85, 1))
                       for a in 2 * math.pi * (np.arange(count) + rng.random()) / count]
        return molten(bodies, 0.04, cells=60)
    if kind in ('bent', 'root'):
        bend = rng.uniform(0.3, 1.3) if kind == 'bent' else rng.uniform(0, 0.2)
        path = smoothed(np.array([[-1, 0, 0], [-0.4, 0, -bend], [0.4, 0, -bend], [1, 0, 0]]), 3)
        share = np.linspace(0, 1, len(path))
        swell = np.sin(math.pi * np.clip(share, 0.03, 0.98)) ** rng.uniform(0.3, 0.8)
        if kind == 'root':
            swell = np.minimum((1.02 - share) ** 0.7, (share * 12 + 0.1) ** 0.5)
        flat = circle(int(rng.choice([5, 20]))) * rng.uniform(0.2, 0.45)
        parts: list[Mesh] = [swept(path, flat, color, scales=swell, up=[0, 1, 0]),
                             swept([path[0], path[0] + [-0.25, 0, rng.uniform(-0.1, 0.2)]],
                                   circle(8, 0.06), stalk)]
        if chance(rng, 0.4):
            parts += [rod(path[0], path[0] + [-0.5, y, z], 0.06, leaf, 0.02)
                      for y, z in rng.uniform(-0.4, 0.4, (5, 2))]
        return assemble(parts)
    ribs = int(rng.choice([0, 0, 0, 5, 8, 12]))
    angles = np.arange(72) * 2 * math.pi / 72
    flat = circle(72) * (1 - rng.uniform(0.05, 0.12) * np.abs(np.sin(ribs / 2 * angles)))[:, None]
    t = np.linspace(-math.pi / 2, math.pi / 2, 33)
    dent, pear = rng.uniform(0, 0.35), rng.uniform(0, 0.5)
    radius = np.cos(t) * (1 - pear * np.clip(np.sin(t), 0, 1))
    level = rng.uniform(0.65, 1.3) * np.sin(t) - dent * np.exp(-(radius / 0.35)**2) * np.sign(t)
    parts = [revolved(np.column_stack([radius, level]), color, flat)]
    top = float(level[-1])
    if chance(rng, 0.75):
        lean = rng.uniform(-0.2, 0.2, 2)
        parts.append(rod([0, 0, top - 0.1], [*lean, top + rng.uniform(0.2, 0.5)],
                         rng.uniform(0.04, 0.1), stalk))
    if chance(rng, 0.35):
        for angle in 2 * math.pi * np.arange(n := int(rng.integers(1, 7))) / n:
            path = smoothed([[0, 0, top - 0.05], [0.3, 0, top + 0.2], [0.6, 0, top + 0.1]], 2)
            blade = swept(path, circle(8) * [0.16, 0.035], leaf,
                          scales=np.sin(np.linspace(0.4, 3, len(path))))
            parts.append(moved(blade, angle=float(angle)))
    return assemble(parts)


def stone(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return a pebble, a rough stone, a crystal or a heap that has grown together."""
    main, second, _, _ = draw_palette(rng)
    grey = main if chance(rng, 0.4) else rng.uniform(40, 210) + rng.normal(0, 10, 3)
    kind = choose(rng, {'rough': 0.4, 'faceted': 0.35, 'grown': 0.25})
    if kind == 'rough':
        body = ball([0, 0, 0], rng.uniform(0.5, 1, 3), grey)
        bumps = waves(rng, rng.uniform(0.5, 1.6), rng.uniform(0.04, 0.17), int(rng.integers(4, 9)))
        return molten([body, limb([0, 0, 0], [0.1, 0, 0], 0.3, grey)], 0.2, bumps=bumps, cells=66)
    if kind == 'faceted':
        points = rng.normal(size=(int(rng.integers(7, 40)), 3))
        points /= np.linalg.norm(points, axis=1, keepdims=True)
        hull = trimesh.convex.convex_hull(points * rng.uniform(0.5, 1, 3))
        shades = rng.uniform(0.85, 1.1, (len(hull.faces), 1))
        return painted(hull, grey * shades)
    parts = []
    for _ in range(int(rng.integers(3, 9))):  # a druse
        tip = rng.normal(size=3) * [0.6, 0.6, 0.3] + [0, 0, 1]
        tip *= rng.uniform(0.7, 1.5) / np.linalg.norm(tip)
        radius = rng.uniform(0.14, 0.3)
        parts += [rod([0, 0, 0], 0.75 * tip, radius, main, radius * 1.1, 6),
                  rod(0.75 * tip, tip, radius * 1.1, second, 0.0, 6)]
    base = trimesh.creation.icosphere(1, 0.5)
    base.apply_transform(np.diag([*rng.uniform(0.8, 1.3, 2), 0.5, 1]))
    return assemble([*parts, painted(base, grey)])


def shoe(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return a shoe, a boot, a slipper or a clog: open above, on a sole, at times with a heel."""
    main, second, accent, detail = draw_palette(rng)
    high, wide = rng.uniform(0.3, 1.3), rng.uniform(0.26, 0.36)
    bodies = [limb([-0.55, 0, 0.3], [0.55, 0, 0.22], wide, main, wide * rng.uniform(0.7, 1)),
              limb([-0.5, 0, 0.25], [-0.5, 0, 0.2 + high], wide * 0.95, main, wide * 0.9),
              limb([-0.3, 0, 0.25 + 0.3 * min(high, 0.7)], [0.3, 0, 0.3], wide * 0.8,
                   accent if chance(rng, 0.4) else main)]
    if chance(rng, 0.3):
        bodies.append(ball([0.75, 0, 0.2], [0.25, wide * 0.9, 0.2], detail))
    inner = wide - 0.1
    cuts = [half_space([0, 0, 0.02], [0, 0, 1], second),
            limb([-0.5, 0, 0.35], [-0.5, 0, 0.6 + 2 * high], inner, second, inner),
            half_space([0, 0, 0.2 + high], [0, 0, -1], second)]
    if chance(rng, 0.6):
        cuts.append(limb([-0.4, 0, 0.33], [0.4, 0, 0.25], inner * 0.8, second))
    upper = molten(bodies, 0.12, cuts, cells=56)
    parts: list[Mesh] = [upper]
    heel = rng.choice([0, rng.uniform(0.05, 0.5)])
    outline = smoothed([[-0.85, 0], [-0.8, -wide], [0.2, -wide * 0.9], [0.6, -wide * 1.1],
                        [0.95, 0], [0.6, wide * 1.1], [0.2, wide * 0.9], [-0.8, wide],
                        [-0.85, 0]], 2)[:-1]
    parts.append(extruded(outline, -rng.uniform(0.05, 0.2), 0.08, second))
    if heel:
        parts.append(rod([-0.55, 0, 0], [-0.55, 0, -0.1 - heel], 0.9 * wide, second,
                         rng.uniform(0.3, 1) * wide, 16))
    return assemble(parts)


def blob(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return balls, bars and rings of wax melted together, at times hollowed or cut off."""
    palette = draw_palette(rng)
    spots = [np.zeros(3)]
    bodies: list[Body] = []
    for i in range(int(rng.integers(2, 9))):
        start = spots[rng.integers(len(spots))]
        way = rng.normal(size=3)
        spot = start + way / np.linalg.norm(way) * rng.uniform(0.3, 1)
        color = palette[rng.integers(4)] if chance(rng, 0.6) else palette[0]
        if chance(rng, 0.5) or i == 0:
            bodies += [ball(spot, rng.uniform(0.25, 0.7, 3), color),
                       limb(start, spot, 0.2, color)]
        else:
            bodies.append(limb(start, spot, rng.uniform(0.12, 0.45), color,
                               rng.uniform(0.12, 0.45)))
        spots.append(spot)
    bodies.append(ball(spots[0], [0.3] * 3, palette[0]))
    cuts = []
    if chance(rng, 0.3):
        cuts.append(half_space(spots[-1] * 0.3, rng.normal(size=3), palette[1]))
        cuts = [] if cuts[0].distance(np.zeros((1, 3), np.float32))[0] < 0.1 else cuts
    return molten(bodies, rng.uniform(0.1, 0.5), cuts, 56)


def cushion_like(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return something stuffed: a cushion, a loaf, a beanbag, a bolster, a sweet."""
    main, second, accent, _ = draw_palette(rng)
    corners = int(choose(rng, {4: 0.5, 3: 0.1, 5: 0.1, 40: 0.3}))
    around = circle(72)
    angles = np.arctan2(around[:, 1], around[:, 0])
    pinch = rng.uniform(0, 0.25) if corners < 10 else 0.0
    power = rng.uniform(3, 8)
    flat = around if corners == 40 else (
        np.sign(around) * np.abs(around) ** (2 / power) if corners == 4 else around)
    flat = flat * (1 + pinch * np.cos(corners * (angles - math.pi / 4)))[:, None]
    t = np.linspace(-math.pi / 2, math.pi / 2, 25)
    thick, flatness = rng.uniform(0.2, 0.7), rng.uniform(0.5, 1.2)
    radius = np.cos(t) ** rng.uniform(0.35, 0.8)
    profile = np.column_stack([radius, thick * np.sign(t) * np.abs(np.sin(t)) ** flatness])
    parts: list[Mesh] = [revolved(profile, np.where((profile[:-1, 1] < 0)[:, None], main, second),
                                  flat)]
    if chance(rng, 0.35):
        rim = np.column_stack([flat * 0.98, np.zeros(72)])
        parts.append(swept(rim, circle(8, 0.05), accent, closed=True))
    if chance(rng, 0.3):
        parts.append(rod([0, 0, -thick], [0, 0, thick], 0.1, accent))
    mesh = assemble(parts)
    mesh.apply_transform(np.diag([1, rng.uniform(0.4, 1), 1, 1.0]))
    return mesh if chance(rng, 0.5) else moved(mesh, axis=[1, 0, 0], angle=rng.uniform(1, 1.6))


SOFT: dict[Generator, float] = {
    beast: 0.27, fruit: 0.17, plush: 0.12, bird: 0.09, blob: 0.12, stone: 0.09, shoe: 0.07,
    fish: 0.04, cushion_like: 0.03}
