"""Monitors: flat screens and televisions on stands or none, curved ones, all-in-ones, CRTs."""

import math

from active_recon.shapes.common.materials import glass, metal, paint, plastic
from active_recon.shapes.common.parts import (
    assemble,
    box,
    Color,
    ellipsoid,
    loft,
    Mesh,
    mirrored,
    rod,
)
from active_recon.shapes.monitor.stands import Screen, stand
import numpy as np


def monitor(rng: np.random.Generator) -> Mesh:
    """Return a random monitor; its screen faces +x."""
    kind = rng.choice(['flat', 'television', 'curved', 'one', 'crt', 'wall', 'pair'],
                      p=[0.36, 0.2, 0.07, 0.1, 0.17, 0.07, 0.03])
    case = [plastic, plastic, metal, paint][rng.integers(4)](rng)
    if kind == 'crt':
        return _tube_monitor(rng, case)
    ratio = rng.choice([4 / 3, 16 / 10, 16 / 9, 21 / 9], p=[0.2, 0.25, 0.45, 0.1])
    width = 1.0
    height = width / ratio
    if kind == 'flat' and rng.random() < 0.06:
        width, height = height, width  # turned upright
    screen = Screen(width, height, rng.uniform(0.035, 0.11))
    if kind == 'curved':
        return assemble([_curved(rng, screen, case), stand(rng, screen, case)])
    panel = _panel(rng, screen, case)
    if kind == 'wall':
        return panel
    if kind == 'one':
        panel = assemble([panel, _chin(rng, screen, case)])
    if kind == 'pair':
        return _pair(rng, screen, panel, case)
    parts = [panel, stand(rng, screen, case, tall=kind == 'flat')]
    if kind == 'television' and rng.random() < 0.25:
        parts.append(_speakers(rng, screen, case))
    return assemble(parts)


def _face(rng: np.random.Generator, screen: Screen, front: float, border: float) -> Mesh:
    """Return the glass, let into a frame whose front stands at x = front."""
    y, z = screen.width / 2 - border, screen.height / 2 - border
    low = border * rng.choice([0, 0, 0.5, 1.2])
    return box([front - 0.02, -y, low - z], [front + 0.004, y, z], glass(rng))


def _panel(rng: np.random.Generator, screen: Screen, case: Color) -> Mesh:
    """Return the flat panel about the origin: a frame, the glass, and what bulges behind."""
    border = rng.uniform(0.012, 0.06)
    x, y, z = screen.depth / 2, screen.width / 2, screen.height / 2
    frame = box([-x, -y, -z], [x, y, z], case)
    parts = [frame, _face(rng, screen, x, border)]
    behind = rng.choice(['plain', 'bulge', 'box', 'slope'], p=[0.35, 0.25, 0.25, 0.15])
    share = rng.uniform(0.45, 0.85)
    back = -x - screen.depth * rng.uniform(0.4, 1.4)
    color = case if rng.random() < 0.6 else plastic(rng)
    if behind == 'bulge':
        rings = [_rectangle(-x + 0.01, y * 0.97, z * 0.97), _rectangle(back, y * share, z * share)]
        parts.append(loft(rings, color))
    elif behind == 'box':
        parts.append(box([back, -y * share, -z * share * 0.8], [0, y * share, z * share * 0.8],
                         color))
    elif behind == 'slope':
        lower = _rectangle(back, y * share, z * 0.45) - [0, 0, z * 0.5]
        parts.append(loft([_rectangle(-x + 0.01, y * 0.95, z * 0.95), lower], color))
    if rng.random() < 0.3:
        parts.append(box([x - 0.01, -0.03, -z + 0.004], [x + 0.008, 0.03, -z + border],
                         metal(rng)))
    return assemble(parts)


def _rectangle(x: float, y: float, z: float) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    return np.array([[x, -y, -z], [x, y, -z], [x, y, z], [x, -y, z]], np.float64)


def _curved(rng: np.random.Generator, screen: Screen, case: Color) -> Mesh:
    """Return a panel bent about an axis in front of it, so that its ends come forward."""
    radius = rng.uniform(0.9, 1.8)
    half = screen.width / 2 / radius
    angles = np.linspace(-half, half, 11)
    x, z = screen.depth / 2, screen.height / 2
    border = rng.uniform(0.015, 0.03)

    def slab(back: float, front: float, high: float, ends: float, color: Color) -> Mesh:
        loops = []
        for angle in angles * ends:
            inner, outer = radius - front, radius - back
            place = [(radius - r * math.cos(angle), r * math.sin(angle)) for r in (outer, inner)]
            (xo, yo), (xi, yi) = place
            loops.append([[xo, yo, -high], [xi, yi, -high], [xi, yi, high], [xo, yo, high]])
        return loft(loops, color)

    return assemble([slab(-x, x, z, 1.0, case),
                     slab(0.0, x + 0.004, z - border, 1 - border / half, glass(rng))])


def _chin(rng: np.random.Generator, screen: Screen, case: Color) -> Mesh:
    """Return the strip below an all-in-one's screen."""
    x, y, z = screen.depth / 2, screen.width / 2, screen.height / 2
    deep = rng.uniform(0.08, 0.2) * screen.height
    color = case if rng.random() < 0.6 else metal(rng)
    return box([-x, -y, -z - deep], [x, y, -z + 0.01], color)


def _speakers(rng: np.random.Generator, screen: Screen, case: Color) -> Mesh:
    """Return loudspeakers at both sides of the screen."""
    x, y, z = screen.depth / 2, screen.width / 2, screen.height / 2
    wide = rng.uniform(0.06, 0.16)
    color = case if rng.random() < 0.5 else plastic(rng)
    side = box([-x * 1.2, y - 0.01, -z], [x * rng.uniform(0.7, 1.3), y + wide, z], color)
    return mirrored(side)


def _pair(rng: np.random.Generator, screen: Screen, panel: Mesh, case: Color) -> Mesh:
    """Return two screens side by side on one bar and foot."""
    turn = rng.uniform(0.1, 0.35)
    away = screen.width / 2 * math.cos(turn) + 0.01
    one = panel.copy()
    matrix = np.eye(4)
    matrix[:2, :2] = [[math.cos(turn), math.sin(turn)], [-math.sin(turn), math.cos(turn)]]
    matrix[:3, 3] = [screen.width / 2 * math.sin(turn), away, 0]
    one.apply_transform(matrix)
    back = -screen.depth
    bar = rod([back, -away, 0], [back, away, 0], 0.03, case)
    links = mirrored(rod([back, away, 0], [screen.width / 2 * math.sin(turn), away, 0], 0.035,
                         case))
    return assemble([mirrored(one), bar, links, stand(rng, screen, case, tall=True)])


def _tube_monitor(rng: np.random.Generator, case: Color) -> Mesh:
    """Return a screen with a tube behind it: a deep case that narrows to the back."""
    width, height = 0.5, 0.5 * rng.uniform(0.72, 0.95)
    depth = rng.uniform(0.35, 0.55)
    shoulder = depth * rng.uniform(0.15, 0.55)
    share = rng.uniform(0.45, 0.85)
    drop = height * rng.uniform(-0.05, 0.12)
    front, back = depth / 2, -depth / 2
    sections = [_rectangle(front, width / 2, height / 2),
                _rectangle(front - shoulder, width / 2, height / 2),
                _rectangle(back, width / 2 * share, height / 2 * share) - [0, 0, drop]]
    parts = [loft(sections, case)]
    y, z = width / 2 * rng.uniform(0.78, 0.92), height / 2 * rng.uniform(0.74, 0.9)
    lift = rng.uniform(0, 0.04)
    bulge = ellipsoid([front - 0.01, 0, lift], [0.03, y * 1.05, z * 1.05], glass(rng))
    pane = box([front - 0.02, -y, lift - z], [front + 0.006, y, lift + z], glass(rng))
    parts.append(pane if rng.random() < 0.6 else bulge)
    if rng.random() < 0.45:
        knobs = rng.integers(2, 6)
        for place in np.linspace(0.1, 0.8, knobs):
            parts.append(rod([front - 0.01, width / 2 * place, -height / 2 * 0.93],
                             [front + 0.015, width / 2 * place, -height / 2 * 0.93], 0.009,
                             plastic(rng)))
    under = -height / 2
    if rng.random() < 0.7:  # a swivel foot; televisions stand on their case
        reach = rng.uniform(0.12, 0.2)
        neck = rng.uniform(0.02, 0.06)
        parts += [rod([0, 0, under + 0.02], [0, 0, under - neck], reach * 0.6, case),
                  rod([0, 0, under - neck + 0.005], [0, 0, under - neck - 0.025], reach, case,
                      end_radius=reach * 1.1, sections=20)]
    elif rng.random() < 0.5:  # rabbit's ears
        for side in (-1, 1):
            parts.append(rod([-0.05, side * 0.01, height / 2 - 0.01],
                             [-0.05, side * rng.uniform(0.1, 0.25),
                              height / 2 + rng.uniform(0.15, 0.3)], 0.008, metal(rng)))
    return assemble(parts)
