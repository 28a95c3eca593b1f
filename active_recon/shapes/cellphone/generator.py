"""Cellphones: bars with keys, smartphones, sliders, folding ones, bricks with an aerial."""

import math

from active_recon.shapes.common.materials import glass, metal, paint, plastic
from active_recon.shapes.common.parts import (
    assemble,
    box,
    Color,
    loft,
    Mesh,
    prism,
    rod,
    superellipse,
)
import numpy as np


def cellphone(rng: np.random.Generator) -> Mesh:
    """Return a random phone that stands upright, its screen and keys facing +x."""
    kind = rng.choice(['smart', 'bar', 'slider', 'folding', 'wide', 'brick', 'swivel'],
                      p=[0.34, 0.25, 0.11, 0.13, 0.09, 0.06, 0.02])
    case = [plastic, paint, metal, plastic][rng.integers(4)](rng)
    height = 1.0
    width = height * {'smart': rng.uniform(0.46, 0.58), 'wide': rng.uniform(0.5, 0.66),
                      'brick': rng.uniform(0.28, 0.4)}.get(kind, rng.uniform(0.38, 0.5))
    depth = height * {'smart': rng.uniform(0.06, 0.12), 'brick': rng.uniform(0.16, 0.3),
                      'folding': rng.uniform(0.06, 0.12)}.get(kind, rng.uniform(0.09, 0.18))
    if kind == 'folding':
        return _folding(rng, width, height, depth, case)
    if kind in ('slider', 'swivel'):
        return _sliding(rng, width, height, depth, case, kind == 'swivel')
    parts = [_body(rng, width, 0.0, height, -depth / 2, depth / 2, case)]
    front = depth / 2
    if kind == 'smart':
        parts.append(_screen(rng, width, height * rng.uniform(0.08, 0.16), height * 0.93, front))
        if rng.random() < 0.6:
            parts.append(_button(rng, height * 0.045, front, width * rng.uniform(0.07, 0.12)))
        parts += _camera(rng, width, height, -depth / 2)
    else:
        split = height * {'wide': rng.uniform(0.42, 0.52)}.get(kind, rng.uniform(0.45, 0.62))
        parts += [_screen(rng, width, split, height * rng.uniform(0.86, 0.94), front),
                  *_keys(rng, width, height * 0.05, split * 0.93, front, kind == 'wide')]
        if kind == 'brick' or rng.random() < 0.22:
            parts.append(_aerial(rng, width, height, depth, case))
    if rng.random() < 0.5:
        parts.append(_side_key(rng, width, height, depth))
    return assemble(parts)


def _body(rng: np.random.Generator, width: float, low: float, high: float, back: float,
          front: float, color: Color) -> Mesh:
    """Return a slab with square, rounded or bellied corners, from back to front."""
    power = rng.choice([4.5, 7, 14, 40], p=[0.2, 0.35, 0.3, 0.15])
    outline = superellipse(width, high - low, power, 32) + [0, (low + high) / 2]
    if rng.random() < 0.4:
        return prism(outline, back, front, 'x', color)
    edge = (front - back) * rng.uniform(0.15, 0.4)
    center = outline.mean(axis=0)
    inner = center + (outline - center) * (1 - edge / width)
    loops = [np.insert(flat, 0, x, axis=1) for flat, x in (
        (inner, back), (outline, back + edge), (outline, front - edge), (inner, front))]
    return loft(loops, color)


def _screen(rng: np.random.Generator, width: float, low: float, high: float,
            front: float) -> Mesh:
    """Return the pane, proud of the front by a hair, and sometimes a frame about it."""
    half = width / 2 * rng.uniform(0.8, 0.94)
    pane = box([front - 0.012, -half, low], [front + 0.006, half, high], glass(rng))
    if rng.random() < 0.3:
        rim = box([front - 0.012, -half * 1.05, low - 0.012], [front + 0.003, half * 1.05,
                                                             high + 0.012], plastic(rng))
        return assemble([pane, rim])
    return pane


def _keys(rng: np.random.Generator, width: float, low: float, high: float, front: float,
          many: bool) -> list[Mesh]:
    """Return rows of keys, and a pad to steer by above them."""
    rows, columns = (4, 9) if many else (4, 3)
    color, rise = plastic(rng), rng.uniform(0.006, 0.02)
    pad = low + (high - low) * rng.uniform(0.66, 0.82)
    half = width / 2 * 0.86
    y = np.linspace(-half, half, columns + 1)
    z = np.linspace(low, pad, rows + 1)
    gap = rng.choice([0.06, 0.15, 0.3])
    keys = []
    for left, right in zip(y[:-1], y[1:], strict=True):
        for bottom, top in zip(z[:-1], z[1:], strict=True):
            dy, dz = (right - left) * gap / 2, (top - bottom) * gap / 2
            keys.append(box([front - 0.01, left + dy, bottom + dz],
                            [front + rise, right - dy, top - dz], color))
    middle, reach = (pad + high) / 2, (high - pad) / 2 * 0.8
    wheel = (rod([front - 0.01, 0, middle], [front + rise, 0, middle], reach, metal(rng))
             if rng.random() < 0.5 else
             box([front - 0.01, -reach * 1.3, middle - reach],
                 [front + rise, reach * 1.3, middle + reach], metal(rng)))
    sides = [box([front - 0.01, side * half * 0.95 - 0.035, middle - reach * 0.6],
                 [front + rise, side * half * 0.95 + 0.035, middle + reach * 0.6], color)
             for side in (-0.85, 0.85)]
    return [*keys, wheel, *sides]


def _button(rng: np.random.Generator, z: float, front: float, reach: float) -> Mesh:
    if rng.random() < 0.5:
        return rod([front - 0.01, 0, z], [front + 0.008, 0, z], min(reach, 0.035), metal(rng),
                   sections=16)
    return box([front - 0.01, -reach, z - 0.014], [front + 0.008, reach, z + 0.014], metal(rng))


def _camera(rng: np.random.Generator, width: float, height: float, back: float) -> list[Mesh]:
    """Return a lens, or an island of lenses, on the back."""
    if rng.random() < 0.3:
        return []
    y = width * rng.choice([-0.3, 0, 0.3])
    z, rise = height * rng.uniform(0.84, 0.92), rng.uniform(0.01, 0.03)
    if rng.random() < 0.4:
        return [box([back - rise, y - 0.07, z - 0.08], [back + 0.01, y + 0.07, z + 0.05],
                    plastic(rng))]
    return [rod([back + 0.01, y, z], [back - rise, y, z], rng.uniform(0.03, 0.05), glass(rng))]


def _aerial(rng: np.random.Generator, width: float, height: float, depth: float,
            case: Color) -> Mesh:
    """Return a stub or a rod on top, to one side."""
    radius = depth * rng.uniform(0.18, 0.35)
    y = (width / 2 - radius * 1.3) * rng.choice([-1, 1])
    return rod([0, y, height - 0.05], [0, y, height * rng.uniform(1.06, 1.35)],
               max(radius, 0.024), case, end_radius=max(radius * 0.7, 0.02))


def _side_key(rng: np.random.Generator, width: float, height: float, depth: float) -> Mesh:
    z, side = height * rng.uniform(0.5, 0.8), rng.choice([-1, 1])
    return box([-depth * 0.15, side * (width / 2 - 0.02), z], [depth * 0.15,
               side * (width / 2 + 0.012), z + 0.1], metal(rng))


def _folding(rng: np.random.Generator, width: float, height: float, depth: float,
             case: Color) -> Mesh:
    """Return a phone that folds at its middle: shut, or open by so much."""
    half, hinge = height / 2, depth / 2
    keys = assemble([_body(rng, width, 0, half, -hinge, hinge, case),
                     *_keys(rng, width, half * 0.06, half * 0.94, hinge, many=False)])
    lid = assemble([_body(rng, width, half, height, -hinge * 0.8, hinge * 0.8, case),
                    _screen(rng, width, half * 1.15, height * 0.94, hinge * 0.8)])
    if rng.random() < 0.25:  # shut: the lid lies before the keys
        fold = math.pi * 0.999
        pivot_x = hinge
    else:
        fold, pivot_x = rng.uniform(0, 0.75), 0.0
    pivot = np.array([pivot_x, 0, half])
    cosine, sine = math.cos(fold), math.sin(fold)
    turn = np.eye(4)
    turn[:3, :3] = np.array([[cosine, 0, sine], [0, 1, 0], [-sine, 0, cosine]])
    turn[:3, 3] = pivot - turn[:3, :3] @ pivot
    lid.apply_transform(turn)
    barrel = rod([pivot_x, -width * 0.4, half], [pivot_x, width * 0.4, half], hinge * 1.05, case)
    parts = [keys, lid, barrel]
    if rng.random() < 0.35:
        parts.append(rod([-hinge * 0.5, width * 0.35, half - 0.04],
                         [-hinge * 0.5, width * 0.35, half + 0.14], 0.03, case))
    return assemble(parts)


def _sliding(rng: np.random.Generator, width: float, height: float, depth: float, case: Color,
             swivel: bool) -> Mesh:
    """Return two slabs, one before the other, the front one pushed up or turned aside."""
    length = height * rng.uniform(0.62, 0.8)
    lower = assemble([_body(rng, width, 0, length, -depth / 2, 0.01, case),
                      *_keys(rng, width, 0.04, height - length + 0.02, 0.0, many=False)])
    other = case if rng.random() < 0.5 else plastic(rng)
    upper = assemble([_body(rng, width, 0, length, 0, depth / 2, other),
                      _screen(rng, width, length * rng.uniform(0.1, 0.3), length * 0.94,
                              depth / 2)])
    if swivel:
        angle = rng.uniform(0.5, 1.6)
        turn = np.eye(4)
        turn[1:3, 1:3] = [[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]]
        pivot = np.array([0, 0, length * 0.85])
        turn[:3, 3] = pivot - turn[:3, :3] @ pivot
        upper.apply_transform(turn)
    else:
        upper.apply_translation([0, 0, (height - length) * rng.choice([0, 0.6, 1],
                                                                     p=[0.2, 0.2, 0.6])])
    return assemble([lower, upper])
