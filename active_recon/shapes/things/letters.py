"""Letters and digits from strokes of their own: one of them, or a word on a board."""

import math

from active_recon.shapes.common.parts import assemble, box, Mesh
from active_recon.shapes.things.colors import draw_palette
from active_recon.shapes.things.drawing import arc, chance
from active_recon.shapes.things.solids import circle, moved, swept
import numpy as np
from numpy.typing import NDArray
import trimesh

Points = NDArray[np.float64]
_PI = math.pi


def _bow(x: float, y: float, rx: float, ry: float, start: float, end: float) -> Points:
    return arc(start, end, 1, 14) * [rx, ry] + [x, y]


# Strokes in a box of 1 x 2: straight ones by their corners, bows by an ellipse's arc
_STROKES: dict[str, list[object]] = {
    'A': [[[0, 0], [0.5, 2], [1, 0]], [[0.2, 0.7], [0.8, 0.7]]],
    'B': [[[0, 0], [0, 2]], _bow(0, 1.5, 0.9, 0.5, _PI / 2, -_PI / 2),
          _bow(0, 0.5, 1, 0.5, _PI / 2, -_PI / 2)],
    'C': [_bow(0.5, 1, 0.5, 1, 0.9, 2 * _PI - 0.9)],
    'D': [[[0, 0], [0, 2]], _bow(0, 1, 1, 1, _PI / 2, -_PI / 2)],
    'E': [[[1, 2], [0, 2], [0, 0], [1, 0]], [[0, 1], [0.8, 1]]],
    'F': [[[1, 2], [0, 2], [0, 0]], [[0, 1], [0.8, 1]]],
    'G': [_bow(0.5, 1, 0.5, 1, 0.9, 2 * _PI - 0.3), [[0.98, 0.7], [0.98, 0.9], [0.5, 0.9]]],
    'H': [[[0, 0], [0, 2]], [[1, 0], [1, 2]], [[0, 1], [1, 1]]],
    'J': [[[0.8, 2], [0.8, 0.4]], _bow(0.4, 0.4, 0.4, 0.4, 0, -_PI)],
    'K': [[[0, 0], [0, 2]], [[1, 2], [0, 0.9]], [[0.35, 1.2], [1, 0]]],
    'L': [[[0, 2], [0, 0], [1, 0]]],
    'M': [[[0, 0], [0, 2], [0.6, 0.7], [1.2, 2], [1.2, 0]]],
    'N': [[[0, 0], [0, 2], [1, 0], [1, 2]]],
    'O': [_bow(0.5, 1, 0.5, 1, 0, 2 * _PI)],
    'P': [[[0, 0], [0, 2]], _bow(0, 1.45, 0.9, 0.55, _PI / 2, -_PI / 2)],
    'R': [[[0, 0], [0, 2]], _bow(0, 1.45, 0.9, 0.55, _PI / 2, -_PI / 2),
          [[0.4, 0.95], [1, 0]]],
    'S': [_bow(0.5, 1.5, 0.5, 0.5, 0.4, 1.5 * _PI),
          _bow(0.5, 0.5, 0.5, 0.5, _PI / 2, -0.87 * _PI)],
    'T': [[[0.5, 0], [0.5, 2]], [[0, 2], [1, 2]]],
    'U': [[[0, 2], [0, 0.5]], _bow(0.5, 0.5, 0.5, 0.5, _PI, 2 * _PI), [[1, 0.5], [1, 2]]],
    'V': [[[0, 2], [0.5, 0], [1, 2]]],
    'W': [[[0, 2], [0.35, 0], [0.7, 1.4], [1.05, 0], [1.4, 2]]],
    'X': [[[0, 0], [1, 2]], [[0, 2], [1, 0]]],
    'Y': [[[0, 2], [0.5, 1], [1, 2]], [[0.5, 1], [0.5, 0]]],
    'Z': [[[0, 2], [1, 2], [0, 0], [1, 0]]],
    '1': [[[0.1, 1.5], [0.6, 2], [0.6, 0]]],
    '2': [_bow(0.5, 1.5, 0.5, 0.5, _PI, -0.6), [[0.9, 1.2], [0, 0], [1, 0]]],
    '3': [_bow(0.4, 1.5, 0.5, 0.5, 2.4, -_PI / 2), _bow(0.4, 0.5, 0.6, 0.5, _PI / 2, -2.4)],
    '4': [[[0.7, 0], [0.7, 2], [0, 0.6], [1, 0.6]]],
    '5': [[[0.9, 2], [0.1, 2], [0.1, 1.1]], _bow(0.4, 0.6, 0.6, 0.6, 2, -2.5)],
    '6': [_bow(0.5, 0.55, 0.5, 0.55, 0, 2 * _PI), _bow(1, 0.6, 1, 1.4, _PI, 0.65 * _PI)],
    '7': [[[0, 2], [1, 2], [0.3, 0]]],
    '8': [_bow(0.5, 1.5, 0.42, 0.5, 0, 2 * _PI), _bow(0.5, 0.5, 0.5, 0.5, 0, 2 * _PI)],
    '9': [_bow(0.5, 1.45, 0.5, 0.55, 0, 2 * _PI), _bow(0, 1.4, 1, 1.4, 0, -0.35 * _PI)],
}


def _written(sign: str, section: Points, color: Points, at: float) -> list[Mesh]:
    """Return a sign's strokes in the x, z plane, beginning at x = at."""
    strokes = []
    for stroke in _STROKES[sign]:
        flat = np.asarray(stroke, np.float64)
        closed = len(flat) > 4 and bool(np.allclose(flat[0], flat[-1]))
        flat = flat[:-1] if closed else flat
        path = np.column_stack([flat[:, 0] + at, np.zeros(len(flat)), flat[:, 1]])
        strokes.append(swept(path, section, color, closed, up=[0, 1, 0]))
    return strokes


def letters(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return a letter or a digit, or a word whose signs stand on a bar or before a board."""
    main, second, accent, _ = draw_palette(rng)
    thick, deep = rng.uniform(0.1, 0.24), rng.uniform(0.12, 0.6)
    profile = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) * [thick, deep]
    if chance(rng, 0.25):
        profile = circle(12) * [thick, max(thick, 0.5 * deep)]
    count = int(rng.integers(2, 5)) if chance(rng, 0.35) else 1
    parts = []
    at = 0.0
    for _ in range(count):
        sign = str(rng.choice([*_STROKES]))
        strokes = _written(sign, profile, main if chance(rng, 0.7) else second, at)
        parts += strokes
        at = max(float(stroke.vertices[:, 0].max()) for stroke in strokes) + 2 * thick
    if count > 1 or chance(rng, 0.25):
        low, high = -1.2 * thick, 2 + 1.2 * thick
        if chance(rng, 0.5):
            parts.append(box([-thick, 0.6 * deep, low], [at - thick, 1.1 * deep + 0.06, high],
                             accent))
        else:
            parts.append(box([-thick, -1.3 * deep, low - 0.1], [at - thick, 1.3 * deep, 0.0],
                             accent))
    mesh = assemble(parts)
    return mesh if chance(rng, 0.7) else moved(mesh, axis=[1, 0, 0], angle=-_PI / 2)
