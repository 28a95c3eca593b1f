"""Lamps: on tables, floors, desks, walls, ceilings and streets; arms reach to the front, +x."""

from active_recon.shapes.common.materials import fabric, glass, metal, paint, plastic, wood
from active_recon.shapes.common.parts import assemble, beam, box, Color, ellipsoid, Mesh, rod
from active_recon.shapes.lamp.hanging import chandelier, pendant, sconce, street_lamp
from active_recon.shapes.lamp.shades import GLOW, HANGING, lantern, shade
from active_recon.shapes.lamp.stands import aim, arc, bent, body, foot, tripod
import numpy as np
from numpy.typing import NDArray


def lamp(rng: np.random.Generator) -> Mesh:
    """Return a random lamp: its kind, then its parts, proportions and colours."""
    kinds = [_table_lamp, _floor_lamp, _desk_lamp, pendant, chandelier, sconce, _lantern,
             street_lamp]
    kind = kinds[rng.choice(len(kinds), p=[0.25, 0.18, 0.14, 0.13, 0.07, 0.07, 0.07, 0.09])]
    cover = [fabric, fabric, plastic, metal][rng.integers(4)](rng)
    if rng.random() < 0.35:
        cover = GLOW * rng.uniform(0.75, 1)  # white and cream shades are the usual ones
    stand = [metal, metal, wood, paint, glass][rng.integers(5)](rng)
    accent = stand if rng.random() < 0.4 else [metal, wood, paint][rng.integers(3)](rng)
    return kind(rng, cover, stand, accent)


def _moved(mesh: Mesh, x: float, y: float, z: float) -> Mesh:
    mesh.apply_translation([x, y, z])
    return mesh


def _table_lamp(rng: np.random.Generator, cover: Color, stand: Color, accent: Color) -> Mesh:
    """Return a body with one shade over it, on a neck."""
    high, reach = rng.uniform(0.2, 0.42), rng.uniform(0.06, 0.14)
    radius, tall = rng.uniform(0.1, 0.22), high * rng.uniform(0.4, 0.95)
    low = high - tall * rng.uniform(-0.1, 0.3)
    parts = [body(rng, reach, high, stand, accent),
             rod([0, 0, high * 0.95], [0, 0, low + tall], 0.012, accent),
             _moved(shade(rng, radius, tall, cover, accent), 0, 0, low)]
    if rng.random() < 0.4:
        parts.append(ellipsoid([0, 0, low + tall], [0.018, 0.018, 0.025], accent, 1))
    return assemble(parts)


def _floor_lamp(rng: np.random.Generator, cover: Color, stand: Color, accent: Color) -> Mesh:
    """Return a tall stand: a pole, a tripod, a bow, a torch, a shelf or several arms."""
    kind = rng.choice(['pole', 'pole', 'tripod', 'bow', 'torch', 'arms', 'column', 'hook',
                       'shelf'])
    high, base = rng.uniform(1.1, 1.6), rng.uniform(0.12, 0.2)
    radius, tall = rng.uniform(0.14, 0.3), rng.uniform(0.18, 0.4)
    thin = rng.uniform(0.014, 0.03)
    if kind == 'column':
        wide = rng.uniform(0.1, 0.2)
        screen = shade(rng, wide, high, cover, accent, ('drum', 'taper', 'waisted'))
        return assemble([_moved(screen, 0, 0, 0.05),
                         box([-wide, -wide, 0], [wide, wide, 0.06], accent)])
    if kind == 'tripod':
        reach = rng.uniform(0.22, 0.4)
        return assemble([tripod(rng, reach, high, thin * 1.6, stand, accent),
                         rod([0, 0, high * 0.9], [0, 0, high + tall * 0.5], thin, accent),
                         _moved(shade(rng, radius, tall, cover, accent), 0, 0, high - 0.04)])
    if kind == 'shelf':
        half = rng.uniform(0.11, 0.17)
        posts = [beam([x, y, 0], [x, y, high], thin * 1.3, stand)
                 for x in (-half, half) for y in (-half, half)]
        boards = [box([-half, -half, z], [half, half, z + 0.03], stand)
                  for z in np.linspace(0.05, high - 0.05, int(rng.integers(2, 5)))]
        block = box([-half * 0.9, -half * 0.9, high - tall], [half * 0.9, half * 0.9, high], cover)
        return assemble([*posts, *boards, block])
    parts = [foot(rng, base, rng.uniform(0.025, 0.05), stand)]
    if kind in ('bow', 'hook'):
        far = rng.uniform(0.5, 1.1) if kind == 'bow' else rng.uniform(0.2, 0.4)
        rise, end = rng.uniform(0.35, 0.6), high * rng.uniform(0.7, 0.95)
        bend = high * (0.3 if kind == 'bow' else 0.85)
        path = np.vstack([[[0, 0, 0.01]], arc([0, 0, bend], [far, 0, end], rise)])
        small = radius * (1 if kind == 'bow' else 0.7)
        parts += [bent(path, thin, stand, 8),
                  _moved(shade(rng, small, small * rng.uniform(0.7, 1.3), cover, accent, HANGING),
                         far, 0, 0)]
        parts[-1].apply_translation([0, 0, end - parts[-1].bounds[1, 2] + thin])
        return assemble(parts)
    parts.append(rod([0, 0, 0.01], [0, 0, high], thin, stand))
    if kind == 'torch':
        bowl = shade(rng, radius, tall * rng.uniform(0.4, 0.8), cover, accent,
                     ('dome', 'cone', 'empire', 'factory'))
        bowl.apply_transform(np.diag([1.0, 1.0, -1.0, 1.0]))
        bowl.invert()
        parts.append(_moved(bowl, 0, 0, high - bowl.bounds[0, 2] - thin))
    elif kind == 'arms':
        for angle in rng.uniform(0, 6.3) + np.arange(rng.integers(2, 6)) * rng.choice([1.26, 2.1]):
            start, far = high * rng.uniform(0.6, 1), rng.uniform(0.2, 0.45)
            tip = np.array([far * np.cos(angle), far * np.sin(angle), start + rng.uniform(0, 0.3)])
            parts.append(rod([0, 0, start], tip, thin * 0.8, stand, sections=8))
            parts.append(_aimed(rng, tip, np.array([tip[0], tip[1], rng.uniform(-0.4, 0.6)]),
                                radius * 0.45, cover, accent))
    else:
        parts += [rod([0, 0, high], [0, 0, high + tall * 0.6], thin, accent),
                  _moved(shade(rng, radius, tall, cover, accent), 0, 0, high - tall * 0.2)]
    return assemble(parts)


def _aimed(rng: np.random.Generator, at: NDArray[np.float64], towards: NDArray[np.float64],
           radius: float, color: Color, trim: Color) -> Mesh:
    """Return a reflector hung by its neck at a point, its mouth turned to a direction."""
    tall = radius * rng.uniform(1, 2.2)
    head = shade(rng, radius, tall, color, trim, ('cone', 'dome', 'factory', 'empire', 'drum'))
    head.apply_translation([0, 0, -tall * 0.97])
    aim(head, -towards)
    head.apply_translation(at)
    return head


def _desk_lamp(rng: np.random.Generator, cover: Color, stand: Color, accent: Color) -> Mesh:
    """Return a foot, a jointed or bent arm in the plane y = 0, and a head over +x."""
    thin = rng.uniform(0.008, 0.016)
    base, radius = rng.uniform(0.07, 0.12), rng.uniform(0.05, 0.11)
    first, second = rng.uniform(0.15, 0.32, 2)
    lean, fold = rng.uniform(-0.6, 0.35), rng.uniform(0.3, 1.9)
    low = np.array([rng.choice([0, -base * 0.6]), 0, 0.025])
    elbow = low + first * np.array([np.sin(lean), 0, np.cos(lean)])
    tip = elbow + second * np.array([np.sin(lean + fold), 0, np.cos(lean + fold)])
    tip[2] = max(tip[2], radius * 2.5)
    parts = [foot(rng, base, rng.uniform(0.02, 0.04), stand)]
    kind = rng.choice(['jointed', 'twin', 'neck', 'bar', 'bankers'])
    if kind in ('jointed', 'twin'):
        gap = np.array([0, 1.8 * thin if kind == 'twin' else 0, 0])
        parts += [rod(a + s * gap, b + s * gap, thin, stand, sections=8)
                  for a, b in ((low - [0, 0, 0.015], elbow), (elbow, tip)) for s in (-1, 1)]
        parts += [rod(p - [0, 2.6 * thin, 0], p + [0, 2.6 * thin, 0], thin * 1.6, accent)
                  for p in (low, elbow, tip)]
    else:
        t = np.linspace(0, 1, 12)[:, None]
        bend = elbow + [0, 0, 0.12]
        path = (1 - t) ** 2 * low + 2 * t * (1 - t) * bend + t ** 2 * tip
        parts.append(bent(path, thin, stand, 8))
    if kind in ('bar', 'bankers'):
        long, wide = rng.uniform(0.1, 0.22), rng.uniform(0.025, 0.05)
        flat = (long, wide) if kind == 'bar' and rng.random() < 0.6 else (wide * 1.4, long)
        tilt = rng.uniform(-0.3, 0.6)
        head = assemble([box([-flat[0] * 0.3, -flat[1], -0.02],
                             [flat[0] * 1.7, flat[1], 0.01], cover),
                         box([-flat[0] * 0.2, -flat[1] * 0.9, -0.026],
                             [flat[0] * 1.6, flat[1] * 0.9, -0.01], GLOW)])
        aim(head, [np.sin(tilt), 0, np.cos(tilt)])
        parts.append(_moved(head, *tip))
    else:
        mouth = np.array([rng.uniform(-0.2, 1.3), 0, -1])
        parts.append(_aimed(rng, tip, mouth, radius, cover, accent))
    return assemble(parts)


def _lantern(rng: np.random.Generator, cover: Color, stand: Color, accent: Color) -> Mesh:
    """Return a lantern to stand or carry, with a ring, a bail or a hook on top."""
    pane = np.array([235.0, 170.0, 60.0]) if rng.random() < 0.5 else cover
    radius, high = rng.uniform(0.09, 0.17), rng.uniform(0.25, 0.42)
    parts = [lantern(rng, radius, high, stand, pane)]
    kind = rng.choice(['none', 'bail', 'ring'])
    thin, loop = 0.011, radius * (1.0 if kind == 'bail' else 0.4)
    if kind != 'none':
        start = high * (0.66 if kind == 'bail' else 0.98)
        path = arc([0, -loop * 0.9, start], [0, loop * 0.9, start], high * 0.6)
        if kind == 'ring':
            path = arc([0, -loop, start], [0, loop, start], loop * 1.5)
            parts.append(rod([0, -loop, start], [0, loop, start], thin, accent, sections=6))
        parts.append(bent(path, thin, accent, 6))
    return assemble(parts)
