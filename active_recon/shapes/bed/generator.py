"""Beds, the foot at +x: singles and doubles, bunks, four-posters, sleighs, cribs, daybeds."""

from active_recon.shapes.bed.frames import base, bedding, board, Livery, Plan, post
from active_recon.shapes.bed.tall import bunk, four_poster
from active_recon.shapes.common import materials
from active_recon.shapes.common.drawing import choose
from active_recon.shapes.common.parts import assemble, box, lathe, Mesh, mirrored, rod
from active_recon.shapes.common.soft_parts import cushion, shell, smoothed, wall
import numpy as np

_BOARDS = ('panel', 'framed', 'slats', 'rails', 'arched', 'spindles', 'padded', 'tufted',
           'winged')
_HARD_BOARDS = _BOARDS[:6]


def bed(rng: np.random.Generator) -> Mesh:
    """Return a random bed about two metres long, standing on z = 0."""
    maker = choose(rng, {
        _standard: 0.58, bunk: 0.13, four_poster: 0.08, _sleigh: 0.05, _crib: 0.06,
        _daybed: 0.05, _hospital: 0.03, _round: 0.02})
    return assemble(maker(rng, _plan(rng), _livery(rng)))


def _plan(rng: np.random.Generator) -> Plan:
    width = rng.choice([0.9, 1.4, 1.6, 1.85], p=[0.33, 0.2, 0.27, 0.2]) * rng.uniform(0.93, 1.08)
    return Plan(length=rng.uniform(1.9, 2.2), width=width, deck=rng.uniform(0.2, 0.42),
                thick=rng.uniform(0.14, 0.3))


def _livery(rng: np.random.Generator) -> Livery:
    frame = (materials.wood, materials.wood, materials.wood, materials.paint,
             materials.metal)[rng.integers(5)](rng)
    linen = rng.uniform(190, 255) * np.array([1, 1, rng.uniform(0.9, 1)])
    panel = frame if rng.random() < 0.5 else (
        materials.fabric, materials.wood, materials.fabric)[rng.integers(3)](rng)
    return Livery(frame=frame, panel=panel, metal=materials.metal(rng), mattress=linen,
                  pillow=linen if rng.random() < 0.5 else materials.fabric(rng),
                  blanket=materials.fabric(rng), throw=materials.fabric(rng))


def _standard(rng: np.random.Generator, plan: Plan, livery: Livery) -> list[Mesh]:
    x, half = plan.length / 2, plan.width / 2
    kind = str(rng.choice(['legs', 'rails', 'box', 'drawers', 'platform'],
                          p=[0.2, 0.37, 0.18, 0.13, 0.12]))
    parts = [*base(rng, kind, plan, livery), *bedding(rng, plan, livery)]
    style = str(rng.choice(_BOARDS))
    reach = half + rng.choice([0.0, 0.03, 0.12])
    if rng.random() < 0.88:
        high = plan.top + rng.uniform(0.2, 0.75)
        low = 0.0 if rng.random() < 0.4 else plan.deck - 0.1
        parts.append(board(rng, style, -x - 0.03, reach, low, high, livery))
        if style in _HARD_BOARDS and rng.random() < 0.4:
            parts += _posts(rng, -x - 0.03, reach, high, livery)
        if reach < half + 0.05 and rng.random() < 0.12:
            parts += _tables(rng, plan, livery)
    if rng.random() < 0.45:
        style = style if rng.random() < 0.7 else str(rng.choice(_HARD_BOARDS))
        style = 'padded' if style == 'winged' else style
        high = plan.top + rng.uniform(-0.08, 0.3)
        low = 0.0 if rng.random() < 0.4 else plan.deck - 0.1
        parts.append(board(rng, style, x + 0.03, half + 0.01, low, high, livery))
        if style in _HARD_BOARDS and rng.random() < 0.4:
            parts += _posts(rng, x + 0.03, half + 0.01, high, livery)
    elif rng.random() < 0.15:  # a bench at the foot
        parts += [cushion((x - 0.02, -0.8 * half, 0.25), (x + 0.4, 0.8 * half, 0.45),
                          livery.throw),
                  mirrored(box((x + 0.3, 0.65 * half, 0), (x + 0.37, 0.75 * half, 0.3),
                               livery.frame)),
                  mirrored(box((x - 0.02, 0.65 * half, 0), (x + 0.06, 0.75 * half, 0.3),
                               livery.frame))]
    return parts


def _posts(rng: np.random.Generator, x: float, half: float, high: float,
           livery: Livery) -> list[Mesh]:
    turned = bool(rng.random() < 0.5)
    one = post(rng, x, half, high + rng.uniform(0.02, 0.15), rng.uniform(0.08, 0.12), turned,
               livery.frame)
    return [mirrored(one)]


def _tables(rng: np.random.Generator, plan: Plan, livery: Livery) -> list[Mesh]:
    """Return night tables against the bed's sides and head."""
    start, inner = -plan.length / 2 - 0.04, plan.width / 2 - 0.01
    high, wide = rng.uniform(0.4, 0.55), rng.uniform(0.35, 0.5)
    drawer = box((start + 0.36, inner + 0.06, 0.6 * high), (start + 0.42, inner + wide - 0.03,
                                                         0.92 * high), livery.panel)
    one = assemble([box((start, inner, 0.12), (start + 0.4, inner + wide, high), livery.frame),
                    box((start, inner + wide - 0.06, 0), (start + 0.4, inner + wide, 0.14),
                        livery.frame), drawer])
    return [mirrored(one)]


def _sleigh(rng: np.random.Generator, plan: Plan, livery: Livery) -> list[Mesh]:
    x, half = plan.length / 2, plan.width / 2
    parts = [*base(rng, 'rails', plan, livery), *bedding(rng, plan, livery)]
    curl = rng.uniform(0.14, 0.24)
    for side, high in ((-1, plan.top + rng.uniform(0.4, 0.65)),
                       (1, plan.top + rng.uniform(0.1, 0.35))):
        profile = smoothed([(0, 0.06), (0.02, 0.5 * high), (0.04, 0.75 * high),
                            (0.5 * curl, 0.96 * high), (curl, high), (curl, 0.92 * high)])
        profile[:, 0] = side * (x + profile[:, 0])
        path = profile if side < 0 else profile[::-1]
        parts.append(shell(path, half + 0.03, 0.0, 0.08, livery.panel))
        parts.append(mirrored(box((side * x - 0.06, half - 0.08, 0),
                                  (side * x + 0.06, half + 0.02, plan.deck), livery.frame)))
        roll = (side * (x + curl), 0.95 * high)
        parts.append(rod((roll[0], -half - 0.05, roll[1]), (roll[0], half + 0.05, roll[1]),
                         0.065, livery.frame))
    return parts


def _crib(rng: np.random.Generator, plan: Plan, livery: Livery) -> list[Mesh]:
    cot = Plan(rng.uniform(1.15, 1.4), rng.uniform(0.6, 0.75), rng.uniform(0.3, 0.5), 0.11)
    x, y, high = cot.length / 2, cot.width / 2, cot.deck + rng.uniform(0.45, 0.6)
    ends = str(rng.choice(['spindles', 'slats', 'panel', 'arched']))
    low = 0.12 if rng.random() < 0.5 else cot.deck - 0.12
    parts = [box((-x, -y, cot.deck - 0.05), (x, y, cot.deck), livery.frame),
             cushion((-x, -y, cot.deck - 0.01), (x, y, cot.top), livery.mattress),
             board(rng, ends, -x, y, low, high + rng.choice([0, 0.15]), livery),
             board(rng, ends, x, y, low, high, livery)]
    rails = [box((-x, y - 0.03, z), (x, y + 0.03, z + 0.06), livery.frame)
             for z in (low, high - 0.08)]
    count = int(rng.integers(8, 13))
    rails += [box((at - 0.018, y - 0.018, low), (at + 0.018, y + 0.018, high - 0.04),
                  livery.panel) for at in np.linspace(-x, x, count + 2)[1:-1]]
    side = assemble(rails)
    if rng.random() < 0.2:  # one side let down
        side.apply_transform(np.diag([1.0, -1.0, 1.0, 1.0]))
        parts += [side, box((-x, y - 0.03, low), (x, y + 0.03, cot.top + 0.02), livery.frame)]
    else:
        parts.append(mirrored(side))
    for at in (-x, x):
        parts += _posts(rng, at, y, high - 0.02, livery)
    if rng.random() < 0.6:
        parts.append(cushion((-x + 0.05, -y + 0.12, cot.top - 0.02), (-x + 0.3, y - 0.12,
                                                                     cot.top + 0.06),
                             livery.pillow))
    if rng.random() < 0.6:
        parts.append(cushion((-0.1, -y + 0.01, cot.top - 0.03), (x - 0.02, y - 0.01,
                                                               cot.top + 0.04), livery.blanket))
    return parts


def _daybed(rng: np.random.Generator, plan: Plan, livery: Livery) -> list[Mesh]:
    day = Plan(plan.length, rng.uniform(0.85, 1.0), plan.deck, plan.thick)
    x, half, high = day.length / 2, day.width / 2, day.top + rng.uniform(0.3, 0.5)
    style = str(rng.choice(['spindles', 'slats', 'framed', 'padded', 'arched']))
    back = board(rng, style, 0, x, day.deck - 0.1, high, livery)
    back.apply_transform(np.array([[0, 1.0, 0, 0], [-1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]))
    back.apply_translation((0, half, 0))
    kind = str(rng.choice(['rails', 'drawers', 'legs']))
    end = high - rng.choice([0.0, 0.15])
    return [*base(rng, kind, day, livery), *bedding(rng, day, livery), back,
            board(rng, style, -x, half + 0.03, day.deck - 0.1, end, livery),
            board(rng, style, x, half + 0.03, day.deck - 0.1, end, livery)]


def _hospital(rng: np.random.Generator, plan: Plan, livery: Livery) -> list[Mesh]:
    """Return a ward's bed: its back raised, rails at its sides, castors."""
    half, x, deck = 0.47, 1.02, rng.uniform(0.45, 0.6)
    lift = rng.uniform(0.2, 0.55)
    knee = (-0.25, deck)
    profile = [(x - 0.05, deck), (0.3, deck + rng.choice([0.0, 0.12])), knee,
               (-x + 0.12, deck + lift)]
    top = [(a, b + 0.16) for a, b in profile]
    high = deck + max(lift, 0.3) + 0.2
    parts = [shell(smoothed(top), half - 0.02, 0.0, 0.2, livery.mattress),
             box((-x, -half + 0.05, deck - 0.16), (x, half - 0.05, deck), livery.metal),
             board(rng, 'panel', -x, half, deck - 0.15, high, livery),
             board(rng, 'panel', x, half, deck - 0.15, deck + 0.35, livery),
             mirrored(box((-0.1, half - 0.03, deck - 0.1), (-0.04, half + 0.03, deck + 0.35),
                          livery.metal)),
             mirrored(box((0.5, half - 0.03, deck - 0.1), (0.56, half + 0.03, deck + 0.35),
                          livery.metal))]
    for z in (0.05, 0.18, 0.3):
        parts.append(mirrored(box((-0.1, half - 0.03, deck + z), (0.56, half + 0.03,
                                                                deck + z + 0.05),
                                  livery.metal)))
    for at in (-x + 0.15, x - 0.15):
        parts.append(mirrored(assemble([
            box((at - 0.04, half - 0.14, 0.08), (at + 0.04, half - 0.06, deck - 0.1),
                livery.metal),
            rod((at, half - 0.14, 0.08), (at, half - 0.06, 0.08), 0.08, (50, 50, 55))])))
    parts.append(cushion((0.05, -half + 0.01, deck + 0.1), (x - 0.06, half - 0.01, deck + 0.22),
                         livery.blanket))
    return parts


def _round(rng: np.random.Generator, plan: Plan, livery: Livery) -> list[Mesh]:
    radius, deck, top = plan.length / 2, plan.deck, plan.top
    low = lathe([(radius, 0.0), (radius + 0.06, deck), (radius - 0.02, deck)], livery.panel,
                sections=32)
    soft = lathe([(radius - 0.05, deck - 0.05), (radius - 0.03, top - 0.04),
                  (radius - 0.09, top)], livery.blanket, sections=32)
    angles = np.linspace(-1, 1, 15) * rng.uniform(0.7, 1.2)
    path = (radius + 0.03) * np.column_stack([-np.cos(angles), np.sin(angles)])
    parts = [low, soft, cushion((-0.85 * radius, -0.65, top - 0.03), (-0.5 * radius, -0.05,
                                                                    top + 0.1), livery.pillow),
             cushion((-0.85 * radius, 0.05, top - 0.03), (-0.5 * radius, 0.65, top + 0.1),
                     livery.pillow)]
    if rng.random() < 0.8:
        rise = rng.uniform(0.2, 0.5) * np.cos(np.linspace(-1, 1, 15) * 1.4)
        parts.append(wall(path, 0.0, top + rise, 0.12, livery.panel))
    return parts
