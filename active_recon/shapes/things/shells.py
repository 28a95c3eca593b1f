"""Thin walls about a room: trays, crates, baskets, cartons, bags."""

import math

from active_recon.shapes.common.parts import assemble, beam, box, Mesh
from active_recon.shapes.common.soft_parts import smoothed
from active_recon.shapes.things.bent import shade, sheet
from active_recon.shapes.things.colors import draw_palette
from active_recon.shapes.things.drawing import (
    arc,
    chance,
    Generator,
    section,
    smooth_profile,
)
from active_recon.shapes.things.outlines import rounded
from active_recon.shapes.things.solids import (
    circle,
    hollow,
    moved,
    revolved,
    skin,
    swept,
)
import numpy as np
import trimesh


def tray(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return an open box, a tray, a drawer or a sorting box, with compartments or handles."""
    main, second, accent, _ = draw_palette(rng)
    half = np.array([1, rng.uniform(0.4, 1)])
    high = rng.choice([rng.uniform(0.12, 0.35), rng.uniform(0.35, 1.3)])
    flat = rounded(2 * half, rng.uniform(0, 0.5) * half[1], 7) if chance(rng, 0.7) else (
        circle(48) * half)
    foot = rng.uniform(0.7, 1) if chance(rng, 0.5) else 1.0
    wall = rng.uniform(0.05, 0.1)
    levels = [[foot, 0], [1, high]]
    if chance(rng, 0.3):
        levels += [[1.12, high], [1.14, high + 0.04]]
    profile = hollow(np.vstack([[0, 0], levels]), wall)
    colors = np.tile(main, (len(profile) - 1, 1))
    colors[len(levels) + 1:] = second if chance(rng, 0.5) else main
    parts = [revolved(profile, colors, flat)]
    square = len(flat) != 48
    if square and chance(rng, 0.4):
        thin, rise = 0.03, high * rng.uniform(0.5, 0.95)
        for x in np.linspace(-1, 1, int(rng.integers(2, 6)))[1:-1]:
            parts.append(box([x - thin, -half[1] * foot * 0.97, 0],
                             [x + thin, half[1] * foot * 0.97, rise], accent))
        if chance(rng, 0.5):
            parts.append(box([-0.97 * foot, -thin, 0], [0.97 * foot, thin, rise], accent))
    if chance(rng, 0.35):
        for sign in (-1, 1):
            path = smoothed([[sign * 0.97, -0.25, high], [sign * 1.02, -0.25, high + 0.25],
                             [sign * 1.02, 0.25, high + 0.25], [sign * 0.97, 0.25, high]], 1)
            path[[0, -1], 2] -= 0.1
            parts.append(swept(path, circle(8, 0.05), accent))
    return assemble(parts)


def crate(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return a crate of slats and posts, open above, its gaps wide or narrow."""
    main, second, _, _ = draw_palette(rng)
    half, high = np.array([1, rng.uniform(0.5, 1)]), rng.uniform(0.3, 1.5)
    thin, count = rng.uniform(0.03, 0.06), int(rng.integers(2, 6))
    parts: list[Mesh] = []
    wide = high / count * rng.uniform(0.25, 0.45)
    for z in (np.arange(count) + 0.5) * high / count:
        for sign in (-1, 1):
            parts += [box([-half[0], sign * half[1] - thin, z - wide],
                          [half[0], sign * half[1] + thin, z + wide], main),
                      box([sign * half[0] - thin, -half[1], z - wide],
                          [sign * half[0] + thin, half[1], z + wide], main)]
    parts += [box([x * half[0] - 0.08, y * half[1] - 0.08, 0],
                  [x * half[0] + 0.08, y * half[1] + 0.08, high * 1.03], second)
              for x in (-1, 1) for y in (-1, 1)]
    if chance(rng, 0.5):
        parts.append(box([-half[0], -half[1], 0], [half[0], half[1], 2 * thin], main))
    else:
        count = int(rng.integers(3, 7))
        pitch = 2 * half[1] / count
        for y in -half[1] + (np.arange(count) + 0.5) * pitch:
            parts.append(box([-half[0], y - 0.38 * pitch, 0],
                             [half[0], y + 0.38 * pitch, 2 * thin], main))
        parts += [box([x - 0.08, -half[1], -0.06], [x + 0.08, half[1], 0.02], second)
                  for x in (-0.92, 0.92)]
    if chance(rng, 0.25):
        bow = arc(0, math.pi, 1, 20) * [half[0], rng.uniform(0.6, 1.2)]
        parts.append(swept(np.column_stack([bow[:, 0], np.zeros(20), bow[:, 1] + high * 0.8]),
                           circle(8, 0.06), second))
        parts += [beam([x, 0, 0], [x, 0, high], 0.14, second) for x in (-half[0], half[0])]
    return assemble(parts)


def basket(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return a basket woven of hoops and ribs, a bin or a cage, with a closed or an open floor."""
    main, second, accent, _ = draw_palette(rng)
    flat, high = section(rng, 0.5), rng.uniform(0.5, 2)
    outer = smooth_profile([[rng.uniform(0.55, 0.95), 0], [rng.uniform(0.8, 1.15), 0.5 * high],
                            [1, high]], 2)
    thin, hoops = rng.uniform(0.04, 0.07), int(rng.integers(3, 9))
    parts: list[Mesh] = []
    for z in np.linspace(0, high, hoops):
        radius = float(np.interp(z, outer[:, 1], outer[:, 0]))
        ring = np.column_stack([radius * flat, np.full(len(flat), z)])
        parts.append(swept(ring, circle(8, thin * (1.5 if z in (0, high) else 1)), main,
                           closed=True))
    ribs = int(rng.integers(6, 19))
    for corner in flat[np.linspace(0, len(flat), ribs, endpoint=False).astype(int)]:
        path = np.column_stack([outer[:, :1] * corner, outer[:, 1]])
        parts.append(swept(path, circle(6, thin), second))
    parts.append(revolved([[outer[0, 0], -thin], [outer[0, 0], thin]], second, flat))
    if chance(rng, 0.4):
        reach = float(np.abs(flat[:, 0]).max())
        bow = arc(0, math.pi, 1, 24) * [reach, rng.uniform(0.6, 1.3)]
        parts.append(swept(np.column_stack([bow[:, 0], np.zeros(24), bow[:, 1] + high - 0.03]),
                           circle(8, 1.4 * thin), accent))
    return assemble(parts)


def carton(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return a box of card with its flaps up, out or closed, or a chest with its lid open."""
    main, second, accent, _ = draw_palette(rng)
    half = rng.uniform([0.5, 0.4, 0.25], [1, 0.9, 1])
    thin = rng.uniform(0.03, 0.06)
    x, y, high = half[0], half[1], 2 * half[2]
    parts: list[Mesh] = [box([-x, -y, 0], [x, y, 2 * thin], main)]
    for sign in (-1, 1):
        parts += [box([-x, sign * y - thin, 0], [x, sign * y + thin, high], main),
                  box([sign * x - thin, -y, 0], [sign * x + thin, y, high], main)]
    inside = second if chance(rng, 0.5) else main
    if chance(rng, 0.35):  # one lid on a hinge
        angle = rng.uniform(0.3, 2)
        lid = box([0, -y, -thin], [2 * x, y, thin], accent)
        parts.append(moved(lid, [-x, 0, high], [0, 1, 0], -angle))
    else:
        for sign in (-1, 1):
            long = rng.uniform(0.5, 1) * y
            for axis, reach, width in ((0, x, y), (1, y, x)):
                if chance(rng, 0.15):
                    continue
                flap = box([0, -width, -thin], [long, width, thin], inside)
                moved(flap, axis=[0, 1, 0], angle=-rng.uniform(-0.9, 2.2))
                turn = math.pi / 2 * axis + (math.pi if sign < 0 else 0)
                moved(flap, angle=turn)
                offset = np.zeros(3)
                offset[axis], offset[2] = sign * reach, high
                parts.append(moved(flap, offset))
    if chance(rng, 0.35):
        wide = rng.uniform(0.1, 0.25)
        parts.append(box([-wide, -y - 1.4 * thin, 0], [wide, -y, high], accent))
        parts.append(box([-wide, y, 0], [wide, y + 1.4 * thin, high], accent))
    return assemble(parts)


def bag(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return a bag: a tote, a sack, a paper bag, a handbag or a rucksack, open or tied."""
    main, second, accent, _ = draw_palette(rng)
    half = np.array([1, rng.uniform(0.25, 0.8)])
    high, wall = rng.uniform(1, 2.4), 0.06
    foot = rounded(2 * half, 0.4 * half[1], 6)
    tied = chance(rng, 0.3)
    levels = [0, 0.15, 0.4, 0.7, 0.88, 1]
    sizes = np.array([0.9, 1, rng.uniform(0.95, 1.15), rng.uniform(0.85, 1.05),
                      rng.uniform(0.75, 1.0), rng.uniform(0.75, 1.05)])
    if tied:
        sizes[-2:] = [0.25, rng.uniform(0.3, 0.6)]
    squash = np.linspace(1, rng.uniform(0.5, 1), 6)
    crease = rng.normal(0, 0.025, (6, len(foot), 2))
    crease[0] = 0
    rings = [np.column_stack([foot * size * [1, thin] + wrinkle, np.full(len(foot), level * high)])
             for level, size, thin, wrinkle in zip(levels, sizes, squash, crease, strict=True)]
    inner = [ring * [1 - wall, 1 - 1.6 * wall, 1] + [0, 0, 0] for ring in rings[::-1]]
    inner[-1][:, 2] = wall
    parts: list[Mesh] = [skin([*rings, *inner], np.vstack([np.tile(main, (6, 1)),
                                                           np.tile(second, (5, 1))]))]
    top = rings[-1]
    reach = float(np.abs(top[:, 1]).max()) * 0.97
    if not tied and chance(rng, 0.75):
        wide, rise = rng.uniform(0.25, 0.6), rng.uniform(0.3, 1)
        for sign in (-1, 1) if chance(rng, 0.8) else (1,):
            y = sign * reach
            path = smoothed([[-wide, y, high - 0.3], [-wide, y * 0.9, high + rise],
                             [wide, y * 0.9, high + rise], [wide, y, high - 0.3]], 2)
            path[:, 1] = np.where(path[:, 2] < high, y * np.interp(
                path[:, 2], [high - 0.3, high], [1.04 / 0.97, 1]), path[:, 1])
            parts.append(swept(path, circle(8) * [0.045, rng.uniform(0.045, 0.1)], accent))
    if chance(rng, 0.3):
        parts.append(box([-0.5, -half[1] - 0.12, 0.2 * high], [0.5, -0.8 * half[1], 0.6 * high],
                         accent))
    return assemble(parts)


SHELLS: dict[Generator, float] = {
    tray: 0.2, carton: 0.17, sheet: 0.17, bag: 0.13, shade: 0.15, crate: 0.1, basket: 0.08}
