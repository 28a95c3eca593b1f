"""Watercraft, from canoes and rafts to container ships and submarines."""

from collections.abc import Callable

from active_recon.shapes.common.drawing import choose
from active_recon.shapes.common.parts import assemble, Mesh
from active_recon.shapes.watercraft import cargo as watercraft_cargo
from active_recon.shapes.watercraft import floats as watercraft_floats
from active_recon.shapes.watercraft import historic as watercraft_historic
from active_recon.shapes.watercraft import liners as watercraft_liners
from active_recon.shapes.watercraft import motor as watercraft_motor
from active_recon.shapes.watercraft import navy as watercraft_navy
from active_recon.shapes.watercraft import sailing as watercraft_sailing
from active_recon.shapes.watercraft import small as watercraft_small
from active_recon.shapes.watercraft import submarine as watercraft_submarine
from active_recon.shapes.watercraft import working as watercraft_working
from active_recon.shapes.watercraft.hull import Livery, livery
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
    style, kind = choose(rng, {(style, kind): weight for weight, style, kind in _KINDS})
    if rng.random() < {'yacht': 0.15, 'wood': 0.2}.get(style, 0):
        style = 'ship'
    return assemble(kind(rng, livery(rng, style)))
