"""Bookshelves without walls: étagères, ladders, zigzags, corner and wall shelves, spines."""

import math

from active_recon.shapes.bookshelf.loads import draw_load, fill
from active_recon.shapes.cabinet.bays import Bay, niche
from active_recon.shapes.cabinet.style import draw_style
from active_recon.shapes.common.materials import metal, wood
from active_recon.shapes.common.parts import beam, box, lathe, Mesh, mirrored, prism, rod
from active_recon.shapes.table.legs import fourfold
import numpy as np


def etagere(rng: np.random.Generator) -> list[Mesh]:
    """Return shelves between four posts: of wood, of pipes, or a rack for stores."""
    width, height, depth = rng.uniform(0.4, 1.5), rng.uniform(0.7, 2.1), rng.uniform(0.28, 0.5)
    style, load = draw_style(rng, max(width, height)), draw_load(rng)
    frame = metal(rng) if rng.random() < 0.6 else style.body
    thick = style.board * rng.uniform(1, 1.5)
    x, y = depth / 2 - thick / 2, width / 2 - thick / 2
    if rng.random() < 0.4:
        post = rod([x, y, 0], [x, y, height], thick / 2, frame, sections=8)
    else:
        post = box([x - thick / 2, y - thick / 2, 0], [x + thick / 2, y + thick / 2, height],
                   frame)
    parts = [fourfold(post)]
    count = int(np.clip(round(height / rng.uniform(0.28, 0.5)), 2, 6))
    levels = np.linspace(rng.uniform(0.04, 0.16), rng.choice([0.98, 0.98, 0.85]), count) * height
    half = style.board / 2
    for low, high in zip(levels, [*levels[1:], None], strict=True):
        parts.append(box([-x, -y, low - half], [x, y, low + half], style.top))
        if high is not None:
            inner = Bay(thick / 2 - y, y - thick / 2, float(low), float(high))
            parts += fill(rng, load, inner, -x, x, style.board)
    brace = rng.choice(['none', 'sides', 'cross', 'back', 'rims'])
    slim = 0.8 * style.board
    if brace == 'cross':
        parts.append(mirrored(beam([-x, -y, levels[0]], [-x, y, levels[-1]], slim, frame)))
    elif brace == 'sides':
        parts += [mirrored(beam([-x, y, low], [x, y, high], slim, frame))
                  for low, high in zip(levels[:-1], levels[1:], strict=True)]
    elif brace == 'back':
        parts.append(box([-x - slim / 2, -y, levels[0]], [-x + slim / 2, y, levels[-1]],
                         style.inside))
    elif brace == 'rims':
        lip = style.board * rng.uniform(1.5, 3)
        parts += [mirrored(box([-x, y - half, z], [x, y + half, z + lip], frame)) for z in levels]
        parts += [box([-x - half, -y, z], [-x + half, y, z + lip], frame) for z in levels]
    return parts


def ladder(rng: np.random.Generator) -> list[Mesh]:
    """Return shelves that grow shallower upwards on leaning rails, or in a folding frame."""
    width, height, depth = rng.uniform(0.4, 0.9), rng.uniform(1.3, 2.0), rng.uniform(0.4, 0.6)
    style, load = draw_style(rng, height), draw_load(rng)
    board, x, y = style.board, depth / 2, width / 2
    wide, head = board * rng.uniform(1.2, 2), -x + depth * rng.uniform(0.06, 0.3)
    kind = rng.choice(['leaning', 'backed', 'easel'])
    parts = [mirrored(beam([x, y, 0], [head, y, height], board, style.body, wide))]
    if kind == 'backed':
        parts.append(mirrored(beam([-x, y, 0], [-x, y, height], board, style.body, wide)))
    elif kind == 'easel':
        parts = [mirrored(beam([s * x, y, 0], [s * depth * 0.06, y, height], board, style.body,
                               wide)) for s in (-1, 1)]
        head = depth * 0.06
    count = int(rng.integers(3, 6))
    levels = np.linspace(rng.uniform(0.06, 0.25), rng.uniform(0.88, 0.96), count)
    if kind == 'backed':
        parts.append(box([-x - board / 2, -y, height * levels[-1] - board],
                         [-x + board / 2, y, height * levels[-1] + board], style.body))
    for index, level in enumerate(levels):
        rail, z = x + (head - x) * level, height * level
        rear = -rail if kind == 'easel' else -x
        over = wide if rng.random() < 0.5 else 0.0
        parts.append(box([rear - over * (kind == 'easel'), -y, z - board / 2],
                         [rail + over, y, z + board / 2], style.top))
        rim = rng.uniform(1, 2.5) * board
        if kind == 'leaning':
            parts += [mirrored(box([rear, y - board / 2, z - board / 2],
                                   [rail, y + board / 2, z + rim], style.top)),
                      box([rear, -y, z - board / 2], [rear + board, y, z + rim], style.top)]
        if index + 1 < count:
            bay = Bay(board / 2 - y, y - board / 2, z, height * float(levels[index + 1]))
            parts += fill(rng, load, bay, rear, rail - 0.25 * (rail - rear), board)
    return parts


def zigzag(rng: np.random.Generator) -> list[Mesh]:
    """Return a band folded into shelves, or boxes set to the left and right by turns."""
    width, depth = rng.uniform(0.5, 1.0), rng.uniform(0.22, 0.35)
    count, rise = int(rng.integers(3, 7)), rng.uniform(0.25, 0.36)
    style, load = draw_style(rng, max(width, count * rise)), draw_load(rng)
    board, x, y = style.board, depth / 2, width / 2
    half, parts = board / 2, []
    shift = rng.uniform(0.1, 0.3) * width if rng.random() < 0.5 else 0.0
    slant = rng.choice([0, 0, 0.35]) * width
    for index in range(count):
        sign, low = (-1) ** index, half + index * rise
        bay = Bay(sign * shift - y, sign * shift + y, low, low + rise)
        if shift:
            parts += niche(bay, -x, x, board, style.body, None)
        else:
            parts += [box([-x, -y, z - half], [x, y, z + half], style.body)
                      for z in (low, low + rise)]
            foot = np.array([0, sign * (y - half), low])
            parts.append(beam(foot, foot + [0, -sign * slant, rise], board, style.top, depth)
                         if slant else box([-x, foot[1] - half, low],
                                           [x, foot[1] + half, low + rise], style.body))
        if not slant:
            parts += fill(rng, load, bay, -x, x, board)
    return parts


def corner(rng: np.random.Generator) -> list[Mesh]:
    """Return quarter-round or square shelves for a room's corner, which is at -x."""
    reach, height = rng.uniform(0.3, 0.55), rng.uniform(0.7, 1.9)
    style = draw_style(rng, height)
    board = style.board
    turn = np.linspace(-math.pi / 4, math.pi / 4, 9)
    bulge = rng.choice([1.0, 1.0, 1.3])  # 1.3: rounded towards a square
    edge = np.column_stack([np.cos(turn), np.sin(turn)]) * (
        1 + (bulge - 1) * np.cos(2 * turn)[:, None])
    outline = reach * np.vstack([[0, 0], edge])
    walled = rng.random() < 0.6
    count = int(np.clip(round(height / rng.uniform(0.25, 0.4)), 2, 6))
    low = 0.0 if walled else rng.uniform(0.02, 0.1)
    levels = np.linspace(low, height - board, count + 1)
    shrink = np.linspace(1, rng.choice([1, 1, 0.6]), count + 1)
    parts = [prism(outline * scale, z, z + board, 'z', style.top)
             for z, scale in zip(levels, shrink, strict=True)]
    along = reach * np.array([1, 1]) / math.sqrt(2)
    if walled:
        z = height / 2
        parts += [beam([0, 0, z], [along[0], sign * along[1], z], board, style.body, height)
                  for sign in (-1, 1)]
    else:
        spots = [outline[0] + [board, 0], outline[1] * 0.9 * shrink[-1],
                 outline[-1] * 0.9 * shrink[-1]]
        parts += [rod([*spot, 0], [*spot, height], board * 0.55, metal(rng), sections=8)
                  for spot in spots]
    if rng.random() < 0.3:
        parts += [lathe(np.array([[0.6, 0], [1, 0.8], [0.5, 2]]) * reach * 0.2, style.handle,
                        [0.5 * reach, 0, z + board / 2], 12) for z in levels[:-1:2]]
    return parts


def wall_shelves(rng: np.random.Generator) -> list[Mesh]:
    """Return boards on brackets that hang on upright rails or on a panel."""
    width, depth = rng.uniform(0.6, 1.6), rng.uniform(0.2, 0.32)
    count, rise = int(rng.integers(2, 6)), rng.uniform(0.26, 0.4)
    height = count * rise
    style, load = draw_style(rng, max(width, height)), draw_load(rng)
    board, y = style.board, width / 2
    frame = metal(rng) if rng.random() < 0.6 else wood(rng)
    panelled = rng.random() < 0.3
    arm = y - board if panelled else y * rng.uniform(0.6, 1) - board
    parts = [box([-board, -y, 0], [0, y, height], style.inside) if panelled else
             mirrored(box([-board, arm - board, 0], [0, arm + board, height], frame))]
    stepped = rng.random() < 0.25
    for index in range(count):
        z, reach = rise * (index + 0.3), depth * (1 - 0.12 * index * stepped)
        parts.append(box([-board / 2, -y, z - board / 2], [reach, y, z + board / 2], style.top))
        parts.append(mirrored(prism([[-board / 2, z], [reach * 0.8, z],
                                     [-board / 2, z - 0.3 * rise]], arm - board / 2,
                                    arm + board / 2, 'y', frame)))
        if index + 1 < count:
            bay = Bay(-y, y, z, z + 0.8 * rise)
            parts += fill(rng, load, bay, -board / 2, reach, board)
    return parts


def spine(rng: np.random.Generator) -> list[Mesh]:
    """Return a post or a board on a foot that bears shelves to both sides by turns."""
    height, width, depth = rng.uniform(1.2, 2.0), rng.uniform(0.35, 0.8), rng.uniform(0.22, 0.35)
    style, load = draw_style(rng, height), draw_load(rng)
    board, x = style.board, depth / 2
    half = width * rng.uniform(0.12, 0.3)
    parts = [box([-x, -half, 0], [-x + board * 1.3, half, height], style.body),
             box([-x, -width * 0.4, 0], [x, width * 0.4, board * 1.4], style.body)]
    count = int(rng.integers(4, 8))
    shift = rng.choice([0, 0.3, 0.5]) * (width / 2)
    levels = np.linspace(height * 0.12, height * 0.97, count)
    boxed = rng.random() < 0.3
    for index, (low, high) in enumerate(zip(levels[:-1], levels[1:], strict=True)):
        middle = shift * (-1) ** index
        bay = Bay(middle - width / 2, middle + width / 2, float(low),
                  float(low + (high - low) * (0.75 if boxed else 0.9)))
        if boxed:
            parts += niche(bay, -x, x, board, style.top, None)
        else:
            parts.append(box([-x, bay.left, low - board / 2], [x, bay.right, low + board / 2],
                             style.top))
        parts += fill(rng, load, bay, -x + board, x, board)
    return parts
