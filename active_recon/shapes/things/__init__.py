"""Things of every kind that a robot meets: many generators, many poses, many colours."""

from collections.abc import Mapping

from active_recon.shapes.common.drawing import choose
from active_recon.shapes.common.parts import assemble
from active_recon.shapes.things.assembled import ASSEMBLED
from active_recon.shapes.things.colors import draw_palette
from active_recon.shapes.things.drawing import chance, Generator
from active_recon.shapes.things.extruded import EXTRUDED
from active_recon.shapes.things.lathed import LATHED
from active_recon.shapes.things.machined import MACHINED
from active_recon.shapes.things.patterns import decorated
from active_recon.shapes.things.poses import laid, stretched
from active_recon.shapes.things.shells import SHELLS
from active_recon.shapes.things.soft import SOFT
from active_recon.shapes.things.swept import SWEPT
import numpy as np
import trimesh

KINDS: dict[str, tuple[float, Mapping[Generator, float]]] = {
    'lathed': (0.17, LATHED), 'extruded': (0.13, EXTRUDED), 'swept': (0.12, SWEPT),
    'machined': (0.13, MACHINED), 'assembled': (0.19, ASSEMBLED), 'soft': (0.14, SOFT),
    'shells': (0.12, SHELLS)}
"""The kinds: each one's share of all things, and the shares of its generators in it."""

GENERATORS: dict[Generator, float] = {
    generator: share * part / sum(parts.values())
    for share, parts in KINDS.values() for generator, part in parts.items()}

_DECORATED = 0.3


def thing(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return a thing of any kind, patterned or not, stretched or not, upright or lying, z up."""
    mesh = assemble([choose(rng, GENERATORS)(rng)])
    if chance(rng, _DECORATED):
        mesh = decorated(rng, mesh, draw_palette(rng))
    mesh = laid(rng, stretched(rng, mesh))
    mesh.update_faces(mesh.area_faces > 1e-12 * float(mesh.extents.max()) ** 2)
    mesh.remove_unreferenced_vertices()
    return mesh
