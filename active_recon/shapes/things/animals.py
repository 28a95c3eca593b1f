"""Animals of melted bodies: on four legs, sitting plush, birds, fish."""


import math

from active_recon.shapes.common.drawing import choose
from active_recon.shapes.common.parts import Color
from active_recon.shapes.things.colors import draw_palette, furry
from active_recon.shapes.things.drawing import chance
from active_recon.shapes.things.fields import ball, Body, limb, molten
import numpy as np
from numpy.typing import NDArray
import trimesh

Points = NDArray[np.float64]


def _head(rng: np.random.Generator, at: Points, size: float, coat: Points) -> list[Body]:
    """Return a head looking to +x: skull, muzzle or beak, ears or horns, eyes."""
    main, second, dark, black = coat
    long = rng.uniform(0.4, 1.3)
    bodies = [ball(at, np.array([1, rng.uniform(0.75, 1), rng.uniform(0.8, 1.1)]) * size, main),
              limb(at, at + size * np.array([0.6 + long, 0, -0.35]), 0.6 * size, second,
                   rng.uniform(0.25, 0.55) * size),
              ball(at + size * np.array([1 + long, 0, -0.3]), [0.2 * size] * 3, black)]
    ear = choose(rng, {'round': 0.3, 'pointed': 0.25, 'long': 0.2, 'hanging': 0.15, 'horns': 0.1})
    for sign in (-1, 1):
        root = at + size * np.array([-0.2, sign * 0.6, 0.65])
        bodies.append(ball(at + size * np.array([0.75, sign * 0.5, 0.35]), [0.16 * size] * 3,
                           black))
        if ear == 'round':
            bodies.append(ball(root + [0, sign * 0.2 * size, 0.2 * size],
                               size * np.array([0.2, 0.42, 0.42]), dark))
        elif ear == 'pointed':
            bodies.append(limb(root, root + size * np.array([0, sign * 0.25, 0.8]), 0.3 * size,
                               main, 0.08 * size))
        elif ear == 'long':
            bodies.append(limb(root, root + size * np.array([-0.3, sign * 0.3, 1.6]), 0.25 * size,
                               main, 0.2 * size))
        elif ear == 'hanging':
            bodies.append(limb(root, root + size * np.array([0, sign * 0.6, -1.1]), 0.24 * size,
                               dark, 0.3 * size))
        else:
            middle = root + size * np.array([-0.2, sign * 0.5, 0.5])
            bodies += [limb(root, middle, 0.17 * size, second, 0.14 * size),
                       limb(middle, middle + size * np.array([0.2, 0, 0.6]), 0.14 * size, second,
                            0.1 * size)]
    return bodies


def beast(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return an animal on its legs: stout or slender, long- or short-necked, with a tail."""
    coat = furry(rng)
    main, second, dark, _ = coat
    long, thick = rng.uniform(0.35, 1), rng.uniform(0.25, 0.5)
    leg = rng.uniform(0.1, 0.3) if chance(rng, 0.2) else rng.uniform(0.35, 1.2)
    high = leg + thick * 0.6
    bodies = [limb([-long, 0, high], [long, 0, high + rng.uniform(-0.1, 0.25)],
                   thick * rng.uniform(0.8, 1.1), main, thick * rng.uniform(0.7, 1.1))]
    if chance(rng, 0.4):
        bodies.append(ball([0, 0, high - 0.1 * thick], [long * 0.8, thick, thick], second))
    slim = rng.uniform(0.09, 0.17) + 0.1 * max(0.0, thick - 0.3)
    stride = rng.uniform(-0.25, 0.25, 4)
    for i, (x, y) in enumerate(((-1, -1), (-1, 1), (1, -1), (1, 1))):
        hip = np.array([x * 0.85 * long, y * 0.55 * thick, high])
        foot = hip * [1, 1.15, 0] + [stride[i] * leg, 0, slim]
        bodies += [limb(hip, foot, slim * 1.5, main, slim),
                   ball(foot + [0.05, 0, 0], [slim * 1.5, slim * 1.1, slim], dark)]
    size = rng.uniform(0.2, 0.45)
    neck = np.array([rng.uniform(0.15, 0.5), 0, rng.uniform(0, 0.4) if chance(rng, 0.7)
                     else rng.uniform(0.5, 1.6)])
    shoulder = np.array([0.9 * long, 0, high + 0.2 * thick])
    head = shoulder + neck + [0.2, 0, 0.1]
    bodies += [limb(shoulder, head, thick * 0.75, main, 0.6 * size),
               *_head(rng, head, size, coat)]
    root = np.array([-long - 0.7 * thick, 0, high + 0.15])
    tail = choose(rng, {'long': 0.35, 'bushy': 0.25, 'stub': 0.25, 'up': 0.15})
    if tail == 'stub':
        bodies.append(ball(root, [0.16] * 3, second))
    else:
        ways = {'long': [-0.6, 0, -0.3], 'bushy': [-0.55, 0, 0.2], 'up': [-0.1, 0, 0.8]}
        end = root + ways[tail]
        bodies.append(limb(root + [0.15, 0, 0], end, 0.09, main, 0.2 if tail == 'bushy' else 0.07))
    if chance(rng, 0.15):  # a shell, a hump or wool
        bodies.append(ball([0, 0, high + 0.3 * thick], [long * 0.9, thick * 1.2, thick * 1.2],
                           dark))
    return molten(bodies, rng.uniform(0.06, 0.16), cells=72)


def plush(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return a stuffed animal or a doll that sits or stands, its head and paws large."""
    coat = furry(rng) if chance(rng, 0.5) else draw_palette(rng)
    main, second, dark, black = coat
    wide, high = rng.uniform(0.4, 0.6), rng.uniform(0.5, 0.75)
    bodies = [ball([0, 0, high], [wide * 0.85, wide, high], main),
              ball([0.25 * wide, 0, high * 0.9], [wide * 0.72, wide * 0.75, high * 0.75], second)]
    size = rng.uniform(0.32, 0.52)
    head = np.array([0.05, 0, 2 * high + 0.6 * size])
    bodies += [limb([0, 0, high], head, 0.25, main), *_head(rng, head, size, coat)]
    sits = chance(rng, 0.6)
    for sign in (-1, 1):
        shoulder = np.array([0, sign * 0.75 * wide, 1.5 * high])
        hand = shoulder + [rng.uniform(0, 0.5), sign * rng.uniform(0.1, 0.5),
                           rng.uniform(-0.6, 0.4)]
        hip = np.array([0.1, sign * 0.55 * wide, 0.25 * high])
        foot = hip + ([0.75, sign * 0.25, 0] if sits else [0.05, sign * 0.1, -0.7])
        bodies += [limb(shoulder, hand, 0.17, main, 0.19), limb(hip, foot, 0.22, main, 0.2),
                   ball(hand, [0.2] * 3, dark if chance(rng, 0.5) else main),
                   ball(foot, [0.26, 0.24, 0.26], dark)]
    if chance(rng, 0.3):
        bodies.append(ball([0.35, 0, 2 * high - 0.1], [0.12, 0.3, 0.12], black))
    return molten(bodies, rng.uniform(0.04, 0.12), cells=68)


def bird(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return a bird, standing or swimming, its wings folded or spread."""
    coat = furry(rng) if chance(rng, 0.4) else draw_palette(rng)
    main, second, dark, black = coat
    long, thick = rng.uniform(0.5, 0.8), rng.uniform(0.3, 0.45)
    tilt = rng.uniform(-0.1, 0.6)
    bodies = [limb([-long * 0.6, 0, 0], [long * 0.5, 0, tilt], thick * 0.8, main, thick)]
    neck = np.array([rng.uniform(0.1, 0.4), 0, rng.uniform(0.3, 1.2)])
    chest = np.array([long * 0.6, 0, tilt])
    head, size = chest + neck, rng.uniform(0.2, 0.32)
    bodies += [limb(chest, head, thick * 0.6, main, size * 0.7), ball(head, [size] * 3, second),
               limb(head, head + [size + rng.uniform(0.15, 0.6), 0, rng.uniform(-0.15, 0.05)],
                    0.6 * size, dark, 0.06)]
    spread = chance(rng, 0.35)
    for sign in (-1, 1):
        bodies.append(ball(head + size * np.array([0.6, sign * 0.65, 0.35]), [0.06] * 3, black))
        if spread:
            bodies.append(ball([0, sign * (thick + 0.4), 0.1 + 0.4 * tilt], [0.35, 0.75, 0.1],
                               second))
        else:
            bodies.append(ball([-0.1, sign * thick * 0.85, 0.1], [0.55, 0.15, 0.28], second))
    tail = np.array([-long - rng.uniform(0.2, 0.7), 0, rng.uniform(-0.2, 0.5)])
    bodies.append(limb([-long * 0.5, 0, 0], tail, thick * 0.55, dark, 0.1))
    if chance(rng, 0.65):
        leg = rng.uniform(0.3, 1)
        for sign in (-1, 1):
            hip = np.array([0, sign * 0.5 * thick, 0])
            foot = hip - [0, 0, thick + leg]
            bodies += [limb(hip, foot, 0.07, dark), ball(foot + [0.12, 0, 0], [0.24, 0.13, 0.07],
                                                         dark)]
    return molten(bodies, 0.1, cells=68)


def fish(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return a fish or a whale, slim or deep, with its fins, its tail upright or flat."""
    main, second, dark, black = draw_palette(rng)
    thick, high = rng.uniform(0.12, 0.45), rng.uniform(0.2, 0.85)
    bodies: list[Body] = [ball([0, 0, 0], [1, thick, high], main),
                          limb([-0.5, 0, 0], [-1.2, 0, 0], 0.7 * min(thick, high), main, 0.1)]
    if chance(rng, 0.4):
        bodies.append(ball([0.2, 0, -0.1], [0.7, thick * 0.95, high], second))

    def fin(at: Points, reach: Points, color: Color) -> Body:
        tip = at + reach
        return limb(at * [1, 0.8, 0.8], tip, 0.14, color, rng.uniform(0.05, 0.12))

    flat = chance(rng, 0.25)
    reach = rng.uniform(0.25, 0.7)
    for sign in (-1, 1):
        across = np.array([0, sign, 0]) if flat else np.array([0, 0, sign])
        bodies.append(limb([-1.15, 0, 0], np.array([-1.5, 0, 0]) + across * reach, 0.12, second,
                           0.09))
        bodies.append(fin(np.array([0.3, sign * thick, -0.1]),
                          np.array([-0.3, sign * rng.uniform(0.2, 0.5), -0.2]), dark))
        bodies.append(ball([0.75, sign * thick * 0.6, 0.1], [0.08] * 3, black))
    for x in np.linspace(0.4, -0.5, int(rng.integers(1, 5))):
        bodies.append(fin(np.array([x, 0, high * math.sqrt(1 - x**2)]),
                          np.array([-0.25, 0, rng.uniform(0.1, 0.4)]), second))
    if chance(rng, 0.3):
        bodies.append(limb([0.8, 0, 0], [rng.uniform(1.2, 1.7), 0, 0], 0.15, dark, 0.06))
    return molten(bodies, 0.08, cells=68)
