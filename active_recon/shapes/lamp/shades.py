"""What lamps shine through: shades of many silhouettes, globes, wire cages, lanterns."""

import math

from active_recon.shapes.common.parts import (
    assemble,
    beam,
    Color,
    ellipsoid,
    lathe,
    Mesh,
    prism,
    rod,
    superellipse,
)
from active_recon.shapes.lamp.stands import bent
import numpy as np
from numpy.typing import ArrayLike

GLOW = np.array([255.0, 244.0, 214.0])  # a bulb's or a milk glass's colour

# Silhouettes: (radius, level) from the bottom rim, level 0, to the top, level 1.
_SHADES: dict[str, list[tuple[float, float]]] = {
    'drum': [(1, 0), (1, 1)],
    'taper': [(1, 0), (0.8, 1)],
    'empire': [(1, 0), (0.55, 1)],
    'cone': [(1, 0), (0.22, 1)],
    'bell': [(1, 0), (0.85, 0.15), (0.66, 0.45), (0.55, 0.75), (0.5, 1)],
    'pagoda': [(1, 0), (0.72, 0.2), (0.5, 0.5), (0.36, 0.8), (0.3, 1)],
    'dome': [(1, 0), (0.96, 0.25), (0.82, 0.55), (0.55, 0.82), (0.2, 1)],
    'onion': [(0.55, 0), (0.9, 0.25), (1, 0.45), (0.85, 0.7), (0.45, 1)],
    'tulip': [(0.6, 0), (0.9, 0.25), (1, 0.5), (0.82, 0.8), (0.35, 1)],
    'factory': [(1, 0), (0.9, 0.25), (0.45, 0.5), (0.22, 0.7), (0.2, 1)],
    'waisted': [(1, 0), (0.6, 0.5), (0.85, 1)],
}
HANGING = ('cone', 'dome', 'factory', 'tulip', 'bell', 'empire', 'drum', 'onion', 'pagoda')


def _spin(mesh: Mesh, angle: float) -> None:
    turn = np.eye(4)
    turn[:2, :2] = [[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]]
    mesh.apply_transform(turn)


def shell(profile: ArrayLike, wall: float, color: Color, sections: int = 24) -> Mesh:
    """Revolve a line of (radius, z), (N, 2), into a wall of some thickness, open at both ends."""
    outer = np.asarray(profile, np.float64)
    inner = outer[::-1] - [wall, 0]
    inner[:, 0] = np.maximum(inner[:, 0], outer[::-1, 0] * 0.2)
    mesh = lathe(np.vstack([outer, inner, outer[:1]]), color, sections=sections)
    mesh.update_faces(np.arange(len(mesh.faces)) < len(mesh.faces) - 2 * sections)  # no caps
    mesh.merge_vertices()
    return mesh


def shade(rng: np.random.Generator, radius: float, height: float, color: Color, trim: Color,
          kinds: tuple[str, ...] = tuple(_SHADES)) -> Mesh:
    """Return a lamp shade with its bulb and holder on the z axis, from z = 0 up to height."""
    kind = str(rng.choice([*kinds, 'globe']))
    if kind == 'globe':
        return _globe(rng, radius, height, color, trim)
    line = np.array(_SHADES[kind]) * [radius, height]
    sections = int(rng.choice([4, 6, 8, 12, 24], p=[0.13, 0.08, 0.07, 0.12, 0.6]))
    wall = max(radius, height) * rng.uniform(0.03, 0.06)
    top, thin = line[-1, 0], wall * 0.7
    holder = [rod([0, 0, height * 0.35], [0, 0, height], thin * 1.2, trim, sections=8),
              ellipsoid([0, 0, height * 0.35], [min(radius * 0.25, height * 0.2)] * 3, GLOW, 1)]
    end = rng.random()
    if end < 0.35 or top < 0.4 * radius:  # a lid carries the shade
        holder.append(lathe([[top, height - wall], [top, height]], color, sections=sections))
    elif end < 0.85:  # a spider of bars does
        level = height * 0.93
        reach = np.interp(level, line[:, 1], line[:, 0]) - wall * 0.4
        holder += [rod([-reach * c, -reach * s, level], [reach * c, reach * s, level], thin * 0.6,
                       trim, sections=6)
                   for c, s in ((1, 0), (0, 1))[:1 if sections == 6 else 2]]
    else:  # a diffuser closes both ends
        holder += [lathe([[r * 0.98, z], [r * 0.98, z + wall]], GLOW, sections=sections)
                   for r, z in ((line[0, 0], height * 0.02), (top, height - wall))]
    parts = [shell(line, wall, color, sections), *holder]
    if rng.random() < 0.35:
        band = height * rng.uniform(0.05, 0.14)
        for at in ([0.0], [0.0, height - band])[rng.integers(2)]:
            levels = np.array([at, at + band])
            radii = np.interp(levels, line[:, 1], line[:, 0]) * 1.02
            parts.append(shell(np.column_stack([radii, levels]), wall * 0.8, trim, sections))
    mesh = assemble(parts)
    if sections == 4:
        _spin(mesh, math.pi / 4)
    return mesh


def _globe(rng: np.random.Generator, radius: float, height: float, color: Color,
           trim: Color) -> Mesh:
    """Return a closed lantern of paper or milk glass: round, long or flat, or with corners."""
    half, kind = height / 2, rng.choice(['ball', 'ball', 'block', 'gem', 'cage'])
    if kind == 'block':
        outline = superellipse(2 * radius, 2 * radius, rng.uniform(3, 12))
        body = prism(outline, 0, height, 'z', color)
    elif kind == 'gem':
        body = lathe([[radius * 0.4, 0], [radius, half * rng.uniform(0.5, 1.4)],
                      [radius * 0.4, height]], color, sections=int(rng.choice([5, 6, 8])))
    elif kind == 'cage':
        return _cage(rng, radius, height, trim)
    else:
        body = ellipsoid([0, 0, half], [radius, radius, half], color,
                         1 if rng.random() < 0.3 else 2)
    cap = min(radius, half) * 0.3
    return assemble([body, lathe([[cap, -0.02 * height], [cap, height * 0.1]], trim, sections=10),
                     lathe([[cap, height * 0.9], [cap, height * 1.0]], trim, sections=10)])


def _cage(rng: np.random.Generator, radius: float, height: float, color: Color) -> Mesh:
    """Return a bulb inside a wire frame, its ribs bent outward."""
    count, thin = int(rng.integers(3, 9)), max(radius, height) * rng.uniform(0.025, 0.05)
    belly = radius * rng.uniform(0.6, 1)
    foot = radius * rng.uniform(0.2, 1)
    profile = np.array([[foot, thin], [radius, height * rng.uniform(0.2, 0.5)],
                        [belly, height * 0.7], [thin, height - thin]])
    parts = [rod([0, 0, height * 0.5], [0, 0, height], thin, color, sections=8),
             ellipsoid([0, 0, height * 0.42], [radius * 0.3, radius * 0.3, height * 0.16], GLOW)]
    angles = np.arange(count) * 2 * math.pi / count
    for angle in angles:
        out = np.array([math.cos(angle), math.sin(angle)])
        parts.append(bent([[*(out * r), z] for r, z in profile], thin, color, sections=5))
    for r, z in profile[:2]:
        parts += [rod([r * math.cos(a), r * math.sin(a), z], [r * math.cos(b), r * math.sin(b), z],
                      thin, color, sections=5)
                  for a, b in zip(angles, np.roll(angles, -1), strict=True)]
    return assemble(parts)


def lantern(rng: np.random.Generator, radius: float, height: float, frame: Color,
            pane: Color) -> Mesh:
    """Return a box lantern from z = 0 up: a floor, panes between posts, a roof, a finial."""
    sections = int(rng.choice([4, 4, 4, 6, 8]))
    base, eave = height * rng.uniform(0.06, 0.12), height * rng.uniform(0.6, 0.75)
    narrow = rng.uniform(0.55, 1)
    reach = radius * rng.uniform(0.75, 0.9)
    post = radius * rng.uniform(0.06, 0.12)
    parts = [lathe([[reach * narrow * 1.05, 0], [reach * narrow * 1.15, base]], frame,
                   sections=sections)]
    if rng.random() < 0.75:
        parts.append(lathe([[reach * narrow * 0.9, base * 0.9], [reach * 0.9, eave * 1.01]], pane,
                           sections=sections))
    else:
        parts.append(rod([0, 0, base * 0.9], [0, 0, eave * 0.75], radius * 0.22, GLOW))
    for angle in np.arange(sections) * 2 * math.pi / sections:
        c, s = reach * math.cos(angle), reach * math.sin(angle)
        parts.append(beam([c * narrow, s * narrow, base * 0.8], [c, s, eave * 1.02], post * 2,
                          frame))
    roof = {'pyramid': [[1, eave], [1.05, eave * 1.04], [0.12, height * 0.95]],
            'flat': [[1, eave], [1, eave * 1.1], [0.5, eave * 1.16]],
            'pagoda': [[1, eave], [1.1, eave * 1.03], [0.5, height * 0.82], [0.3, height * 0.95]],
            'dome': [[1, eave], [0.95, height * 0.8], [0.6, height * 0.92], [0.1, height * 0.98]],
            }[str(rng.choice(['pyramid', 'flat', 'pagoda', 'dome']))]
    parts.append(lathe(np.array(roof) * [radius, 1], frame, sections=sections))
    parts.append(rod([0, 0, eave], [0, 0, height], radius * 0.1, frame, sections=8))
    mesh = assemble(parts)
    if sections == 4:
        _spin(mesh, math.pi / 4)
    return mesh
