"""Things off a lathe or a potter's wheel: vases, bowls, plates, glasses, bottles, knobs."""

import math

from active_recon.shapes.common.drawing import choose
from active_recon.shapes.common.parts import assemble, box
from active_recon.shapes.things.colors import draw_palette
from active_recon.shapes.things.drawing import (
    chance,
    Generator,
    globe,
    random_profile,
    section,
    smooth_profile,
)
from active_recon.shapes.things.solids import hollow, moved, revolved, torus
from active_recon.shapes.things.vessels import bucket, jug, mug, pan
import numpy as np
import trimesh


def vase(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return a hollow vase of any outline, fluted, twisted or square at times."""
    main, second, accent, _ = draw_palette(rng)
    height = rng.uniform(1.4, 5)
    outer = random_profile(rng, height, 0.35, 1.1, int(rng.integers(3, 7)))
    outer[-1, 0] = max(outer[-1, 0], 0.3)
    profile = hollow(np.vstack([[0, 0], outer]), rng.uniform(0.06, 0.12))
    colors = np.tile(main, (len(profile) - 1, 1))
    colors[len(profile) // 2:] = second
    if chance(rng, 0.5):
        start = rng.integers(1, len(outer) - 3)
        colors[start:start + rng.integers(2, 8)] = accent
    twist = rng.uniform(-1.2, 1.2) if chance(rng, 0.4) else 0.0
    return revolved(profile, colors, section(rng, 0.45), twist=twist)


def bowl(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return an open bowl, round or flared, on a foot or not, at times with something in it."""
    main, second, accent, _ = draw_palette(rng)
    height, foot = rng.uniform(0.35, 1.1), rng.uniform(0.25, 0.6)
    flare = rng.uniform(-0.1, 0.35)
    corners = [[0, 0], [foot, 0], [0.85 + flare / 3, 0.25 * height], [1, 0.7 * height],
               [1 + flare, height]]
    outer = smooth_profile(corners, int(rng.integers(0, 4)))
    parts = [revolved(hollow(outer, wall := rng.uniform(0.05, 0.12)),
                      np.vstack([np.tile(main, (len(outer), 1)),
                                 np.tile(second, (len(outer) - 1, 1))]), around := section(rng))]
    if chance(rng, 0.4):  # a foot, low or as high as a goblet's
        rise = rng.uniform(0.08, 0.8)
        stem = foot * rng.uniform(0.3, 1)
        parts.append(revolved([[foot * 1.1, -rise], [stem, -0.6 * rise], [stem, 0.1 * wall]],
                              main, around))
    if chance(rng, 0.3):
        count = int(rng.integers(3, 9))
        for i in range(count):
            size = rng.uniform(0.22, 0.38)
            angle, off = 2 * math.pi * i / count, 0.45 if i else 0
            parts.append(revolved(globe(size), rng.choice([accent, second, main]) * 0.9))
            moved(parts[-1], [off * math.cos(angle), off * math.sin(angle),
                              wall + 0.12 * height + size * rng.uniform(0.8, 1)])
    return assemble(parts)


def plate(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return a flat plate, dish or saucer, or a stack of them."""
    main, second, accent, _ = draw_palette(rng)
    rise, flat = rng.uniform(0.06, 0.3), rng.uniform(0.45, 0.8)
    corners = [[0, 0], [flat, 0], [flat + 0.05, rise * rng.uniform(0.3, 1)], [1, rise]]
    outer = smooth_profile(corners, int(rng.integers(0, 3)))
    around, wall = section(rng, 0.6), rng.uniform(0.05, 0.09)
    profile = hollow(outer, wall)
    colors = np.tile(main, (len(profile) - 1, 1))
    colors[len(outer):] = second if chance(rng, 0.5) else main
    if chance(rng, 0.5):
        colors[len(outer) - 2:len(outer) + 1] = accent
    count = int(rng.integers(2, 7)) if chance(rng, 0.3) else 1
    parts = []
    for i in range(count):
        one = revolved(profile * ([rng.uniform(0.93, 1), 1] if i else [1, 1]), colors, around)
        parts.append(moved(one, [*rng.normal(0, 0.01, 2), i * wall * 1.02]))
    return assemble(parts)


def glass(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return a stemmed glass, its bowl open, or a goblet, an egg cup, a sundae dish."""
    main, second, _, _ = draw_palette(rng)
    deep, stem = rng.uniform(0.5, 1.9), rng.uniform(0.2, 1.6)
    thin, foot = rng.uniform(0.07, 0.2), rng.uniform(0.45, 0.95)
    shapes = {'tulip': [[0, 0], [0.55, 0.1], [0.85, 0.5], [rng.uniform(0.5, 0.8), 1]],
              'flute': [[0, 0], [0.3, 0.1], [0.5, 0.5], [0.48, 1]],
              'cone': [[0, 0], [rng.uniform(0.7, 1.1), 1]],
              'coupe': [[0, 0], [0.6, 0.1], [1, 0.6], [1.05, 1]]}
    cup = np.array(shapes[str(rng.choice([*shapes]))]) * [1, deep]
    cup = smooth_profile(cup, 2)
    wall = rng.uniform(0.05, 0.09)
    around = section(rng, 0.8)
    parts = [moved(revolved(hollow(cup, wall), main, around), [0, 0, stem])]
    knots = [[foot, 0], [foot, 0.05], [thin * 1.4, 0.12 + 0.1 * stem],
             [thin * rng.uniform(0.8, 2), 0.5 * stem + 0.1], [thin, stem + wall / 2]]
    parts.append(revolved(knots, second if chance(rng, 0.4) else main))
    if chance(rng, 0.25):
        parts.append(moved(torus(thin + 0.05, 0.07, second), [0, 0, stem * 0.6]))
    return assemble(parts)


def bottle(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return a bottle, jar, can or flask with a cap, a cork, a pump or an open neck."""
    main, second, accent, detail = draw_palette(rng)
    body, shoulder = rng.uniform(1.1, 3.4), rng.uniform(0.1, 1.1)
    neck, rise = rng.uniform(0.2, 0.85), rng.uniform(0.1, 1.2)
    waist = rng.uniform(0.75, 1.05) if chance(rng, 0.4) else 1
    corners = [[0.94, 0], [1, 0.08], [waist, 0.5 * body], [1, body], [neck, body + shoulder],
               [neck, body + shoulder + rise]]
    outer = smooth_profile(corners, int(rng.integers(0, 3)))
    profile = hollow(np.vstack([[0, 0], outer]), 0.08)
    label = (profile[:-1, 1] > 0.15 * body) & (profile[:-1, 1] < rng.uniform(0.5, 0.95) * body)
    label &= chance(rng, 0.6)
    colors = np.where(label[:, None], accent, main)
    around = section(rng, 0.65)
    parts = [revolved(profile, colors, around)]
    top = body + shoulder + rise
    cap = choose(rng, {'screw': 0.4, 'open': 0.25, 'pump': 0.15, 'ball': 0.1, 'cone': 0.1})
    wide = neck * rng.uniform(1.03, 1.3)
    high = rng.uniform(0.15, 0.5)
    if cap == 'screw':
        parts.append(revolved([[wide, top - high * 0.6], [wide, top + high * 0.4]], second,
                              around))
    elif cap == 'ball':
        parts.append(moved(revolved(globe(wide * 1.1), second), [0, 0, top + 0.5 * wide]))
    elif cap == 'cone':
        parts.append(revolved([[wide, top - 0.1], [wide, top], [0.12, top + rng.uniform(0.3, 1)]],
                              second))
    elif cap == 'pump':
        parts += [revolved([[wide, top - 0.2], [wide, top + 0.1]], second),
                  revolved([[0.12, top], [0.12, top + 0.6]], detail),
                  box([-0.2, -0.16, top + 0.5], [rng.uniform(0.5, 1.1), 0.16, top + 0.68], second)]
    return assemble(parts)


def turned(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return something solid off a lathe: a chessman, a knob, a spindle, a top, a skittle."""
    main, second, accent, _ = draw_palette(rng)
    parts = []
    level = 0.0
    around = section(rng, 0.8)
    for i in range(int(rng.integers(3, 9))):
        radius, high = rng.uniform(0.25, 1), rng.uniform(0.15, 0.9)
        color = [main, main, second, accent][rng.integers(4)]
        kind = choose(rng, {'drum': 0.35, 'ball': 0.25, 'cone': 0.2, 'cove': 0.2})
        if kind == 'drum':
            piece = [[radius, 0], [radius, high]]
        elif kind == 'ball':
            piece = list(globe(1) * [radius, high / 2] + [0, high / 2])
        elif kind == 'cone':
            piece = [[radius, 0], [radius * rng.uniform(0.1, 0.9), high]]
        else:
            piece = list(smooth_profile([[radius, 0], [0.2 * radius, 0.2 * high],
                                         [0.2 * radius, 0.8 * high],
                                         [radius * rng.uniform(0.3, 1), high]]))
        one = revolved(np.asarray(piece) * [1, 1.04] + [0, level - 0.02], color,
                       around if kind != 'ball' else None)
        parts.append(one)
        level += high
        if i == 0 and chance(rng, 0.5):
            parts.append(revolved([[1.1, -0.15], [1.1, 0.02]], main, around))
    return assemble(parts)


def ringed(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return a wheel, a tyre, a pulley or a reel: a closed profile carried about the axis."""
    main, second, accent, _ = draw_palette(rng)
    bore, wide = rng.uniform(0.1, 0.75), rng.uniform(0.12, 0.9)
    knots = int(rng.integers(3, 7))
    x = np.linspace(0, wide, knots)
    outer = np.column_stack([rng.uniform(bore + 0.15, 1, knots), x])
    if chance(rng, 0.6):  # the same on both faces
        outer[:, 0] = (outer[:, 0] + outer[::-1, 0]) / 2
    outer = smooth_profile(outer, int(rng.integers(0, 3)))
    profile = np.vstack([outer, [[bore, wide], [bore, 0]]])
    colors = np.tile(main, (len(profile), 1))
    colors[len(outer) - 1:] = second
    parts = [revolved(profile, colors, closed=True)]
    if bore > 0.4 and chance(rng, 0.6):
        count = int(rng.integers(3, 9))
        for angle in math.pi * np.arange(count) * 2 / count:
            spoke = box([0, -0.07, 0.3 * wide], [bore + 0.05, 0.07, 0.7 * wide], accent)
            parts.append(moved(spoke, angle=float(angle)))
        parts.append(revolved([[0.18, 0], [0.18, wide]], accent))
    return assemble(parts)


LATHED: dict[Generator, float] = {
    mug: 0.24, vase: 0.14, bottle: 0.15, bowl: 0.1, glass: 0.08, jug: 0.09, bucket: 0.05,
    pan: 0.05, plate: 0.05, turned: 0.06, ringed: 0.05}
