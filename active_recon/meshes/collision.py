"""Convex parts of a shape, for simulators: contacts with them are fast and sure."""

from collections.abc import Sequence

import numpy as np
import trimesh

_CONCAVITY = 0.05
"""Depth, in sizes of the shape, of what the parts may fill; CoACD's own default."""
_MOST_PARTS = 32
_MOST_CORNERS = 64
_CELLS = 30
"""Cells a side in which CoACD makes the shape simple first: of 100,000 faces it takes minutes."""
_SEARCH = {'mcts_nodes': 10, 'mcts_iterations': 30, 'resolution': 1000}
"""Half of CoACD's own search for good cuts, or less: some 10 s of one thread."""
NO_COACD = ('no coacd here: the collision shape is one convex hull for each body; for convex '
            'parts: pip install active_recon[coacd]')


def convex_parts(mesh: trimesh.Trimesh) -> tuple[Sequence[trimesh.Trimesh], str]:
    """
    Return convex meshes that together are about the shape, and in words what is missing, or ''.

    By CoACD (Wei et al. 2022), seeded; where it is not installed the hulls of the bodies.
    """
    try:
        import coacd
    except ImportError:
        return [body.convex_hull for body in mesh.split(only_watertight=False)], NO_COACD
    coacd.set_log_level('error')
    found = coacd.run_coacd(
        coacd.Mesh(np.asarray(mesh.vertices), np.asarray(mesh.faces)), threshold=_CONCAVITY,
        max_convex_hull=_MOST_PARTS, preprocess_mode='on', preprocess_resolution=_CELLS,
        decimate=True, max_ch_vertex=_MOST_CORNERS, seed=0, **_SEARCH)
    # The hulls again: parts are convex up to rounding only
    return [trimesh.Trimesh(vertices, faces, process=False).convex_hull
            for vertices, faces in found], ''
