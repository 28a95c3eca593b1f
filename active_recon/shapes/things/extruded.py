"""Things cut from a plate or pressed through a die: gears, brackets, letters, stars, gratings."""

from collections.abc import Callable
import math

from active_recon.shapes.common.drawing import choose
from active_recon.shapes.common.parts import assemble, box, Mesh
from active_recon.shapes.things import outlines
from active_recon.shapes.things.colors import draw_palette
from active_recon.shapes.things.drawing import chance, Generator, section
from active_recon.shapes.things.letters import letters
from active_recon.shapes.things.solids import circle, extruded, moved, revolved
import numpy as np
from numpy.typing import NDArray
import trimesh

Points = NDArray[np.float64]


def gear(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return a gear, a pinion, a sprocket or a ratchet: bored, lightened, helical or doubled."""
    main, second, accent, _ = draw_palette(rng)
    teeth = int(rng.integers(6, 33))
    root = rng.uniform(0.72, 0.9)
    outline = outlines.gear(rng, teeth, root)
    thick = rng.uniform(0.1, 0.8)
    bore = rng.uniform(0.1, 0.3)
    holes: list[Points] = [outlines.bore(rng, bore)]
    if chance(rng, 0.5):
        count = int(rng.integers(3, 8))
        ring = (bore * 1.25 + root * 0.9) / 2
        size = min(0.8 * (root * 0.9 - bore * 1.25) / 2, 0.7 * math.pi * ring / count)
        holes += [circle(18, size) + ring * np.array([math.cos(a), math.sin(a)])
                  for a in 2 * math.pi * np.arange(count) / count]
    elif chance(rng, 0.3):
        holes = [circle(40, rng.uniform(0.4, 0.85) * root)]
    twist = rng.uniform(-0.6, 0.6) if chance(rng, 0.3) else 0.0
    taper = rng.uniform(0.5, 0.9) if chance(rng, 0.2) else 1.0
    side = second if chance(rng, 0.3) else main
    parts = [extruded(outline, 0, thick, main, holes, side, twist, taper)]
    if len(holes[0]) != 40 and chance(rng, 0.5):
        hub = bore * 1.3
        parts.append(extruded(circle(32, hub), -rng.uniform(0, 0.4), thick + rng.uniform(0, 0.6),
                              second, [holes[0] * 0.98]))
    if twist == 0 and taper == 1 and len(holes) == 1 and chance(rng, 0.3):
        small = extruded(outlines.gear(rng, teeth // 2 + 3, root) * rng.uniform(0.45, 0.8)
                         if bore < 0.3 else circle(40, 0.8), thick - 0.02,
                         thick + rng.uniform(0.15, 0.6), accent,
                         [holes[0]] if holes[0].max() < 0.3 else ())
        parts.append(small)
    return assemble(parts)


def star(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return a star, heart, moon, arrow, cross or flower made solid, or tapered to a top."""
    main, second, _, _ = draw_palette(rng)
    outline = outlines.figure(rng)
    holes = []
    if chance(rng, 0.3):
        holes = [0.45 * outline] if chance(rng, 0.4) else [circle(24, rng.uniform(0.08, 0.2))]
    if holes and not outlines.holds(outline, holes[0]):
        holes = []
    thick = rng.choice([rng.uniform(0.12, 0.4), rng.uniform(0.4, 2)])
    twist = rng.uniform(-1.5, 1.5) if chance(rng, 0.25) and thick > 0.3 else 0.0
    taper = rng.uniform(0.05, 0.9) if chance(rng, 0.3) else 1.0
    body = extruded(outline, 0, thick, main, holes, second if chance(rng, 0.5) else main, twist,
                    taper)
    if taper < 1 and chance(rng, 0.4):  # the same on the other side: a jewel
        other = extruded(outline, 0, thick, main, holes, second, twist, taper)
        other.apply_transform(np.diag([1, 1, -1, 1.0]))
        body = assemble([body, other])
    return body if chance(rng, 0.5) else moved(body, axis=[1, 0, 0], angle=math.pi / 2)


def grating(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return a plate with cut-outs: rows or rings of round, square or long holes."""
    main, second, accent, _ = draw_palette(rng)
    half = np.array([1, rng.uniform(0.3, 1)])
    thick = rng.choice([rng.uniform(0.06, 0.2), rng.uniform(0.2, 0.7)])
    round_plate = chance(rng, 0.3)
    outline = outlines.rounded(2 * half, rng.uniform(0, 0.3) * half.min()) if not round_plate \
        else circle(48) * half
    columns, rows = int(rng.integers(1, 6)), int(rng.integers(1, 4))
    pitch = 2 * half * (0.62 if round_plate else 0.88) / [columns, rows]
    hole = outlines.cutout(rng, pitch * rng.uniform(0.4, 0.75, 2))
    centers = [(np.array([i, j]) - [(columns - 1) / 2, (rows - 1) / 2]) * pitch
               for i in range(columns) for j in range(rows)]
    if len(centers) > 3 and chance(rng, 0.4):
        centers = [center for center in centers if chance(rng, 0.7)] or centers
    body = extruded(outline, 0, thick, main, [hole + center for center in centers],
                    second if chance(rng, 0.3) else main)
    parts = [body]
    if chance(rng, 0.3) and not round_plate:
        for sign in (-1, 1):
            rib = rng.uniform(0.1, 0.5)
            parts.append(box([-half[0], sign * half[1] - 0.05 - 0.04 * sign, 0],
                             [half[0], sign * half[1] + 0.05 - 0.04 * sign, thick + rib], accent))
    mesh = assemble(parts)
    return mesh if chance(rng, 0.5) else moved(mesh, axis=[1, 0, 0], angle=math.pi / 2)


def profile_bar(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return a length of an L, U, T, I, Z or hollow profile, or of any stepped outline."""
    main, second, _, _ = draw_palette(rng)
    outline, holes = outlines.profile(rng)
    long = rng.choice([rng.uniform(0.3, 1.2), rng.uniform(1.2, 5)])
    bar = extruded(outline, 0, long, second if chance(rng, 0.4) else main, holes, main)
    return bar if chance(rng, 0.4) else moved(bar, axis=[0, 1, 0], angle=math.pi / 2)


def bracket(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return plates with screw holes that stand on each other: angles, shoes, hinges, shelves."""
    main, second, accent, _ = draw_palette(rng)
    thick, wide = rng.uniform(0.07, 0.22), rng.uniform(0.5, 1.6)
    base, rise = rng.uniform(0.8, 2), rng.uniform(0.6, 2)

    def drilled(long: float) -> Mesh:
        """Return a plate from x = 0 to long, z = 0 to thick, with a few holes."""
        count, radius = int(rng.integers(0, 4)), rng.uniform(0.08, 0.18) * wide
        across = rng.uniform(0.2, 0.28) * wide * rng.choice([0, 1])
        rows = [-across, across] if across else [0.0]
        room = long - thick
        pitch = room / max(count, 1)
        hole = circle(18, min(radius, 0.35 * pitch, 0.16 * wide))
        holes = [hole + [thick + (i + 0.5) * pitch, y]
                 for i in range(count) for y in rows]
        corner = [[0, -wide / 2], [long, -wide / 2], [long, wide / 2], [0, wide / 2]]
        if chance(rng, 0.3):
            cut = 0.3 * wide
            corner = [[0, -wide / 2], [long - cut / 2, -wide / 2], [long, -wide / 2 + cut],
                      [long, wide / 2 - cut], [long - cut / 2, wide / 2], [0, wide / 2]]
        return extruded(corner, 0, thick, main, holes, second)

    def standing(at: float) -> Mesh:
        return moved(drilled(rise), [at, 0, 0.97 * thick], [0, 1, 0], -math.pi / 2)

    kind = choose(rng, {'L': 0.35, 'U': 0.2, 'T': 0.15, 'Z': 0.15, 'corner': 0.15})
    parts = [drilled(base)]
    foot = thick  # where what stands ends
    if kind in ('L', 'Z', 'corner'):
        parts.append(standing(thick))
    if kind == 'U':
        parts += [standing(thick), standing(base)]
    if kind == 'T':
        foot = base * rng.uniform(0.4, 0.7)
        parts.append(standing(foot))
    if kind == 'Z':
        parts.append(moved(drilled(base), [thick, 0, rise + 0.94 * thick], [0, 0, 1], math.pi))
    if kind == 'corner':
        parts.append(box([0, wide / 2 - thick, 0], [base, wide / 2, rise], main))
    if kind in ('L', 'T') and chance(rng, 0.6):
        reach = rng.uniform(0.4, 0.9) * (base - foot)
        gusset = np.array([[0, 0], [reach, 0], [0, rng.uniform(0.4, 0.9) * rise]])
        for y in ([0.0] if chance(rng, 0.5) else [-0.4 * wide, 0.4 * wide - thick]):
            rib = moved(extruded(gusset, 0, thick, accent), axis=[1, 0, 0], angle=math.pi / 2)
            parts.append(moved(rib, [foot - 0.1 * thick, y + thick, 0.9 * thick]))
    return assemble(parts)


def layered(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return slabs of different outlines on each other: a badge, a cake, a stepped pyramid."""
    palette = draw_palette(rng)
    level, scale = 0.0, 1.0
    parts = []
    shape: Callable[[], Points] = (lambda: outlines.figure(rng)) if chance(rng, 0.5) else (
        lambda: section(rng, 0.3))
    outline = shape()
    same = chance(rng, 0.6)
    for i in range(int(rng.integers(2, 6))):
        thick = rng.uniform(0.08, 0.5)
        flat = scale * (outline if same else shape())
        hole = [circle(20, 0.1 * scale)] if chance(rng, 0.2) else []
        hole = hole if hole and outlines.holds(flat, hole[0]) else []
        parts.append(extruded(flat, level - 0.02, level + thick, palette[i % 4], hole))
        parts.append(revolved([[0.16 * scale, level - 0.03], [0.16 * scale, level + thick]],
                              palette[i % 4]))
        level += thick
        scale *= rng.uniform(0.6, 1.1)
    return assemble(parts)


EXTRUDED: dict[Generator, float] = {
    gear: 0.23, bracket: 0.19, letters: 0.16, star: 0.13, profile_bar: 0.11, grating: 0.12,
    layered: 0.06}
