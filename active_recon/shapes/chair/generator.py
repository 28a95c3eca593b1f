"""Chairs: what people sit on alone, from stools to tub chairs."""

from collections.abc import Callable
import math

from active_recon.shapes.chair.backs import BACKS, leaned
from active_recon.shapes.chair.bases import (
    Base,
    block,
    cantilever,
    hairpins,
    legs,
    rockers,
    scissors,
    Seat,
    sled,
    tripod,
)
from active_recon.shapes.chair.columns import foot_ring, pedestal, star
from active_recon.shapes.chair.easy import draw_colors, lounge, sling, tub
from active_recon.shapes.chair.parts import arms, seat_parts
from active_recon.shapes.common import materials
from active_recon.shapes.common.drawing import choose
from active_recon.shapes.common.parts import assemble, beam, box, Mesh
from active_recon.shapes.common.soft_parts import cushion, shell, smoothed
from active_recon.shapes.sofa.generator import armchair
import numpy as np
import trimesh


def chair(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return a chair of any kind, its front at +x, z up."""
    kinds: dict[Callable[[np.random.Generator], list[Mesh]], float] = {
        _side_chair: 0.34, _stool: 0.15, armchair: 0.11, tub: 0.1, _moulded: 0.08,
        _office: 0.07, lounge: 0.07, sling: 0.08}
    return assemble(choose(rng, kinds)(rng))


def _seat(rng: np.random.Generator, round_share: float = 0.15) -> Seat:
    width = rng.uniform(0.36, 0.54)
    is_round = bool(rng.random() < round_share)
    soft = rng.random() < 0.5
    stout = rng.uniform(1.4, 2.4) if rng.random() < 0.2 else rng.uniform(0.85, 1.2)
    return Seat(width, width * (1 if rng.random() < 0.5 else rng.uniform(0.78, 1)),
                width if is_round else width * rng.uniform(0.85, 1.12), rng.uniform(0.4, 0.5),
                rng.uniform(0.05, 0.12) if soft else rng.uniform(0.022, 0.048), is_round, stout)


def _side_chair(rng: np.random.Generator) -> list[Mesh]:
    """Return a seat on any base with any back, with arms or without: also rocking chairs."""
    frame, cover = draw_colors(rng)
    seat = _seat(rng)
    bases: list[Base] = [legs, rockers, sled, cantilever, pedestal, hairpins, scissors, block]
    base = bases[rng.choice(8, p=[0.6, 0.1, 0.07, 0.07, 0.03, 0.04, 0.03, 0.06])]
    base_color = materials.metal(rng) if base in (sled, cantilever, hairpins) else frame
    lean = rng.uniform(0, 0.28)
    height = rng.uniform(0.26, 0.42) if rng.random() < 0.3 else rng.uniform(0.4, 0.65)
    back = BACKS[rng.choice(len(BACKS), p=[0.16, 0.15, 0.17, 0.13, 0.17, 0.11, 0.06, 0.05])]
    bow = rng.choice([0, rng.uniform(0.02, 0.08)])
    parts = [*seat_parts(rng, seat, frame, cover), *base(rng, seat, base_color),
             *leaned(back(rng, seat, height, frame, cover), seat, lean, bow)]
    if rng.random() < 0.33 and not seat.is_round:
        parts += arms(rng, seat, lean, frame, cover)
    return parts


def _stool(rng: np.random.Generator) -> list[Mesh]:
    """Return a stool, low or of a bar's height, without a back or with a low one."""
    frame, cover = draw_colors(rng)
    width = rng.uniform(0.28, 0.5)
    high = bool(rng.random() < 0.45)
    is_round = bool(rng.random() < 0.55)
    seat = Seat(width, width, width if is_round or rng.random() < 0.5 else width
                * rng.uniform(0.6, 1), rng.uniform(0.6, 0.85) if high else rng.uniform(0.2, 0.5),
                rng.uniform(0.025, 0.16) if rng.random() < 0.6 else rng.uniform(0.025, 0.05),
                is_round, rng.uniform(0.8, 1.3 if high else 1.8))
    bases: list[Base] = [legs, tripod, pedestal, star, scissors, block, hairpins]
    base = bases[rng.choice(7, p=[0.4, 0.1, 0.22, 0.05, 0.06, 0.12, 0.05])]
    parts = [*seat_parts(rng, seat, frame, cover), *base(rng, seat, frame)]
    if base is legs and high and is_round and rng.random() < 0.4:
        parts += foot_ring(0.36 * width, 0.02, 0.35 * seat.top, frame)
    if high and rng.random() < 0.4:
        back = BACKS[rng.choice(5)]
        parts += leaned(back(rng, seat, rng.uniform(0.15, 0.35), frame, cover), seat, 0.1,
                        rng.choice([0, 0.05]))
    return parts


def _moulded(rng: np.random.Generator) -> list[Mesh]:
    """Return a bent shell of plastic or plywood on a light base."""
    color = materials.plastic(rng) if rng.random() < 0.6 else materials.wood(rng)
    frame = materials.metal(rng) if rng.random() < 0.6 else materials.wood(rng)
    top = rng.uniform(0.62, 0.8) if rng.random() < 0.15 else rng.uniform(0.36, 0.47)
    depth, width, rise = rng.uniform(0.4, 0.5), rng.uniform(0.4, 0.52), rng.uniform(0.25, 0.55)
    lean = rng.uniform(0.06, 0.25)
    corners = [[depth / 2, top - 0.02], [0.35 * depth, top + 0.005], [-0.35 * depth, top - 0.02],
               [-0.5 * depth, top + 0.06], [-0.5 * depth - lean * rise, top + rise]]
    profile = smoothed(corners)
    share = np.linspace(0, 1, len(profile))
    hollow = rng.uniform(0, 0.16)
    half = width / 2 * (1 - rng.uniform(0, 0.3) * share**4)
    sheet = shell(profile, half, hollow * np.sin(math.pi * share) ** 0.7, rng.uniform(0.018, 0.03),
                  color)
    seat = Seat(width, width, 0.9 * depth, top, 0.03)
    bases: list[Base] = [legs, sled, hairpins, pedestal, star, cantilever]
    parts = [sheet, *bases[rng.choice(6)](rng, seat, frame),
             box([-0.3 * depth, -0.35 * width, top - 0.045],
                 [0.3 * depth, 0.35 * width, top - 0.01], frame)]
    if rng.random() < 0.3:
        parts += arms(rng, seat, lean, frame, color)
    return parts


def _office(rng: np.random.Generator) -> list[Mesh]:
    """Return a swivel chair, its back on a spine, often with arms and a head rest."""
    frame = materials.metal(rng) if rng.random() < 0.6 else materials.plastic(rng)
    cover = materials.fabric(rng) if rng.random() < 0.7 else materials.rubber(rng)
    width = rng.uniform(0.44, 0.54)
    seat = Seat(width, width * rng.uniform(0.85, 1), width * rng.uniform(0.9, 1.05),
                rng.uniform(0.42, 0.55), rng.uniform(0.06, 0.12))
    height, gap = rng.uniform(0.32, 0.75), rng.choice([-0.03, rng.uniform(0.06, 0.16)])
    thickness, half = rng.uniform(0.035, 0.11), rng.uniform(0.38, 0.5) * width
    back = [cushion([-thickness / 2, -half, gap], [thickness / 2, half, height], cover, 0.05),
            beam([-0.02, 0, -seat.thickness], [-0.02, 0, max(gap, 0) + 0.2], 0.08, frame, 0.03)]
    if rng.random() < 0.3 and height > 0.5:
        back += [cushion([-0.03, -0.13, height + 0.04], [0.05, 0.13, height + 0.2], cover, 0.03),
                 beam([0, 0, height - 0.05], [0, 0, height + 0.1], 0.06, frame, 0.025)]
    lean = rng.uniform(0.05, 0.22)
    parts = [*seat_parts(rng, seat, frame, cover), *star(rng, seat, frame),
             *leaned(back, seat, lean, rng.uniform(-0.02, 0.05))]
    return parts + (arms(rng, seat, lean, frame, cover) if rng.random() < 0.65 else [])


