"""Watercraft, from canoes and rafts to container ships and submarines."""

from collections.abc import Callable

from active_recon.shapes import (
    watercraft_cargo,
    watercraft_floats,
    watercraft_historic,
    watercraft_liners,
    watercraft_motor,
    watercraft_navy,
    watercraft_sailing,
    watercraft_small,
    watercraft_submarine,
    watercraft_working,
)
from active_recon.shapes.parts import assemble, Mesh
from active_recon.shapes.watercraft_hull import Livery, livery
import numpy as np

# How often, in which colours, and what
_KINDS: list[tuple[float, str, Callable[[np.random.Generator, Livery], list[Mesh]]]] = [
    (11, 'yacht', watercraft_sailing.sailing_yacht),
    (10, 'yacht', watercraft_motor.motor_yacht),
    (10, 'yacht', watercraft_motor.speedboat),
    (12, 'navy', watercraft_navy.warship),
    (9, 'ship', watercraft_cargo.cargo_ship),
    (8, 'wood', watercraft_historic.galleon),
    (6, 'wood', watercraft_small.rowboat),
    (6, 'ship', watercraft_liners.cruise_liner),
    (5, 'navy', watercraft_submarine.submarine),
    (5, 'ship', watercraft_working.fishing_boat),
    (4, 'ship', watercraft_working.tug),
    (4, 'ship', watercraft_liners.ferry),
    (4, 'ship', watercraft_cargo.tanker),
    (3, 'wood', watercraft_small.canoe),
    (3, 'yacht', watercraft_sailing.catamaran),
    (3, 'ship', watercraft_floats.inflatable),
    (3, 'ship', watercraft_working.patrol_boat),
    (2, 'wood', watercraft_historic.longship),
    (2, 'navy', watercraft_navy.carrier),
    (1.5, 'wood', watercraft_floats.raft),
    (1, 'navy', watercraft_navy.landing_craft),
    (1, 'yacht', watercraft_motor.hydrofoil),
]


def watercraft(rng: np.random.Generator) -> Mesh:
    """Return a random boat or ship, its bow at +x."""
    weights = np.array([weight for weight, _, _ in _KINDS])
    _, style, kind = _KINDS[rng.choice(len(_KINDS), p=weights / weights.sum())]
    if rng.random() < {'yacht': 0.15, 'wood': 0.2}.get(style, 0):
        style = 'ship'
    return assemble(kind(rng, livery(rng, style)))
