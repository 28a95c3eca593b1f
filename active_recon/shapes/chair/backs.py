"""Backs of chairs, from boards and slats to hoops and thrones."""

from collections.abc import Callable
import math

from active_recon.shapes.chair.bases import Seat
from active_recon.shapes.common.parts import (
    assemble,
    beam,
    Color,
    ellipsoid,
    loft,
    Mesh,
    mirrored,
    prism,
    rod,
    superellipse,
    tube,
)
from active_recon.shapes.common.soft_parts import cushion
import numpy as np

Back = Callable[[np.random.Generator, Seat, float, Color, Color], list[Mesh]]


def leaned(back: list[Mesh], seat: Seat, lean: float, bow: float) -> list[Mesh]:
    """Return a back built on x = 0 from the seat's level, set in place: leaned and bowed."""
    placed = []
    for part in back:
        x, y, z = part.vertices.T
        bowed = bow * (1 - np.square(2 * y / seat.back_span)) * np.clip(z / 0.15, 0, 1)
        moved = assemble([part])
        moved.vertices = np.column_stack([
            x + seat.back_x - bowed - math.tan(lean) * np.maximum(z, 0), y, z + seat.top])
        placed.append(moved)
    return placed


def rail(width: float, low: float, high: float, thickness: float, color: Color,
         arch: float = 0.0, power: float = 2.0) -> Mesh:
    """Return a board across the back, its upper edge arched by arch in the middle."""
    loops = []
    for s in np.linspace(-1, 1, 9):
        top = high + arch * (1 - abs(s) ** power)
        x = thickness / 2
        loops.append([[-x, s * width / 2, low], [x, s * width / 2, low],
                      [x, s * width / 2, top], [-x, s * width / 2, top]])
    return loft(loops, color)


def _posts(rng: np.random.Generator, seat: Seat, height: float, color: Color) -> list[Mesh]:
    size = rng.uniform(0.024, 0.036) * seat.stoutness
    y = seat.back_span / 2
    bar = beam if rng.random() < 0.6 else rod
    return [mirrored(bar([0, y, -seat.thickness], [0, y, height],
                         size if bar is beam else size / 2, color))]


def solid(rng: np.random.Generator, seat: Seat, height: float, frame: Color,
          cover: Color) -> list[Mesh]:
    """Return one board from the seat up, its top straight, arched or pointed."""
    arch = rng.choice([0, rng.uniform(0.03, 0.1), -0.03])
    return [rail(seat.back_span + 0.03, -0.01, height - arch, rng.uniform(0.02, 0.045)
                 * seat.stoutness, frame, arch, rng.choice([1, 2, 4]))]


def slats(rng: np.random.Generator, seat: Seat, height: float, frame: Color,
          cover: Color) -> list[Mesh]:
    """Return vertical slats between a crest and the seat or a lower rail."""
    count, crest = int(rng.integers(2, 7)), rng.uniform(0.05, 0.12)
    low = 0.0 if rng.random() < 0.5 else rng.uniform(0.06, 0.14)
    span = seat.back_span
    width = rng.uniform(0.35, 0.65) * span / count
    parts = [*_posts(rng, seat, height - 0.01, frame),
             rail(span + 0.03, height - crest, height, 0.026 * seat.stoutness, frame,
                  rng.choice([0, 0.03]))]
    if low:
        parts.append(rail(span, low, low + 0.04, 0.026, frame))
    for y in (np.arange(count) + 0.5) / count * span - span / 2:
        parts.append(beam([0, y, low - 0.005], [0, y, height - crest + 0.01], width, frame, 0.016)
                     if width > 0.05 else
                     rod([0, y, low - 0.005], [0, y, height - crest + 0.01], 0.011, frame))
    return parts


def ladder(rng: np.random.Generator, seat: Seat, height: float, frame: Color,
           cover: Color) -> list[Mesh]:
    """Return level rails between two posts: from one crest rail to a ladder."""
    count = int(rng.integers(1, 6))
    size = rng.uniform(0.4, 0.7) * (0.75 * height / count if count > 1 else 0.5 * height)
    parts = _posts(rng, seat, height, frame)
    for top in np.linspace(height, 0.25 * height + size, count):
        parts.append(rail(seat.back_span + 0.01, top - size, top, 0.022 * seat.stoutness,
                          cover if count == 1 else frame, rng.choice([0, 0.02])))
    return parts


def spindles(rng: np.random.Generator, seat: Seat, height: float, frame: Color,
             cover: Color) -> list[Mesh]:
    """Return thin rods that fan out to a hoop or to a crest."""
    half, fan = seat.back_span / 2, rng.uniform(0.9, 1.15)
    radius = rng.uniform(0.008, 0.012)
    count = int(rng.integers(4, 8))
    places = np.linspace(-0.8, 0.8, count)
    if rng.random() < 0.5:
        angles = np.linspace(0, math.pi, 13)
        power = rng.uniform(0.5, 1)
        hoop = np.column_stack([0 * angles, half * np.sign(np.cos(angles))
                                * np.abs(np.cos(angles)) ** power,
                                height * np.sin(angles) ** power - 0.01])
        tops = [np.interp(abs(s * half), hoop[6::-1, 1], hoop[6::-1, 2]) for s in places]
        return [tube(hoop, 0.014 * seat.stoutness, frame, sections=6),
                *[rod([0, s * half, -0.01], [0, s * half, top], radius, frame, sections=6)
                  for s, top in zip(places, tops, strict=True)]]
    crest = rng.uniform(0.05, 0.1)
    ends = np.array([-1, *places, 1])
    return [rail(2 * fan * half + 0.05, height - crest, height, 0.024, frame, 0.02),
            *[rod([0, s * half, -0.01], [0, s * fan * half, height - crest + 0.01],
                  0.015 if abs(s) == 1 else radius, frame, sections=6) for s in ends]]


def padded(rng: np.random.Generator, seat: Seat, height: float, frame: Color,
           cover: Color) -> list[Mesh]:
    """Return an upholstered panel, framed by posts or bare, from the seat or above it."""
    thickness = rng.uniform(0.03, 0.1)
    gap = rng.choice([-0.01, rng.uniform(0.06, 0.5 * height)])
    width = seat.back_span / 2 + rng.choice([0.02, -0.01])
    pad = cushion([-thickness / 2, -width, gap], [thickness / 2, width, height], cover,
                  rng.uniform(0.015, 0.05))
    if gap < 0 and rng.random() < 0.5:
        return [pad]
    return [pad, *_posts(rng, seat, rng.choice([height - 0.03, height + 0.03]), frame)]


def crossed(rng: np.random.Generator, seat: Seat, height: float, frame: Color,
            cover: Color) -> list[Mesh]:
    """Return posts and two rails with an X or a splat between them."""
    low, crest, span = rng.uniform(0.05, 0.2) * height, rng.uniform(0.05, 0.1), seat.back_span
    parts = [*_posts(rng, seat, height - 0.01, frame),
             rail(span + 0.02, height - crest, height, 0.028, frame, rng.choice([0, 0.03])),
             rail(span, low, low + 0.035, 0.024, frame)]
    high = height - crest + 0.01
    if rng.random() < 0.5:
        return parts + [beam([0, s * span / 2, low + 0.02], [0, -s * span / 2, high], 0.022,
                             frame, 0.03) for s in (-1, 1)]
    shares = np.array([1, 0.6, 0.8, 1.2, 0.9]) if rng.random() < 0.5 else np.ones(5)
    widths = rng.uniform(0.12, 0.25) * span * shares
    heights = np.linspace(low + 0.02, high, 5)
    return parts + [loft([[[-0.01, -w, z], [0.01, -w, z], [0.01, w, z], [-0.01, w, z]]
                          for w, z in zip(widths, heights, strict=True)], frame)]


def medallion(rng: np.random.Generator, seat: Seat, height: float, frame: Color,
              cover: Color) -> list[Mesh]:
    """Return an oval, a round or a blunt panel on two struts or on one."""
    tall, wide = rng.uniform(0.5, 0.8) * height, rng.uniform(0.8, 1.1) * seat.back_span
    outline = superellipse(wide, tall, rng.uniform(2, 5)) + [0, height - tall / 2]
    y = rng.choice([0.0, 0.25 * wide])
    strut = beam([0, y, -0.02], [0, y, height - 0.6 * tall], 0.03 if y else 0.07, frame, 0.022)
    return [prism(outline, -0.022, 0.012, 'x', frame),
            prism((outline - outline.mean(0)) * 0.85 + outline.mean(0), 0, 0.03, 'x', cover),
            mirrored(strut)]


def throne(rng: np.random.Generator, seat: Seat, height: float, frame: Color,
           cover: Color) -> list[Mesh]:
    """Return a tall arched or pointed panel with a cover, between posts with finials."""
    arch = rng.uniform(0.05, 0.2)
    base = 1.25 * height - arch
    size = 0.045 * seat.stoutness
    y = seat.back_span / 2
    return [rail(2 * y, -0.01, base, 0.035, frame, arch, rng.choice([1, 2])),
            rail(1.5 * y, 0.08, base - 0.03, 0.06, cover, 0.8 * arch),
            mirrored(beam([0, y, -seat.thickness], [0, y, base], size, frame)),
            mirrored(ellipsoid([0, y, base], [0.7 * size] * 3, frame, 1))]


BACKS: tuple[Back, ...] = (solid, slats, ladder, spindles, padded, crossed, medallion, throne)
