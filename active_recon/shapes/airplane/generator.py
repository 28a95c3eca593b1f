"""Aeroplanes, from gliders to jumbo jets."""

from active_recon.shapes.airplane.jets import airliner, transport
from active_recon.shapes.airplane.military import fighter, flying_wing
from active_recon.shapes.airplane.parts import Livery
from active_recon.shapes.airplane.props import biplane, glider, light, twin, warbird
from active_recon.shapes.common import materials
from active_recon.shapes.common.drawing import choose
from active_recon.shapes.common.parts import assemble
import numpy as np
import trimesh

_KINDS = {airliner: 0.33, fighter: 0.21, flying_wing: 0.04, transport: 0.06, biplane: 0.06,
          glider: 0.04, light: 0.11, twin: 0.08, warbird: 0.07}


def airplane(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return a random aeroplane, its nose at +x."""
    kind = choose(rng, _KINDS)
    mesh = assemble(kind(rng, _livery(rng, military=kind in (fighter, flying_wing, warbird))))
    # Toys are stubbier than what they are modelled on.
    mesh.apply_transform(np.diag([1, rng.uniform(0.85, 1.2), rng.uniform(0.9, 1.35), 1]))
    return mesh


def _livery(rng: np.random.Generator, military: bool) -> Livery:
    white = np.full(3, rng.uniform(200, 255))
    if rng.random() < 0.12:  # an untextured model
        return Livery(*[white * rng.uniform(0.5, 1)] * 9)
    color, second = materials.paint(rng), materials.paint(rng)
    if military and rng.random() < 0.7:
        drab = rng.uniform((60, 65, 50), (150, 155, 150))
        color, white = drab, drab * rng.uniform(0.8, 1.3)
    style = rng.integers(4)
    top = (white, color, white, color)[style]
    belly = (white, color, materials.metal(rng), second)[style]
    wing = (materials.metal(rng), top, belly, white)[rng.integers(4)]
    return Livery(
        top=top, belly=belly, stripe=second if rng.random() < 0.5 else color, wing=wing,
        tail=(color, top, second)[rng.integers(3)],
        engine=(white, materials.metal(rng), color, wing)[rng.integers(4)],
        glass=materials.glass(rng), tyre=materials.rubber(rng), metal=materials.metal(rng))
