"""Lofts painted quad by quad: windows, stripes and panels that lie in the surface itself."""

from collections.abc import Sequence

from active_recon.shapes.common.parts import Color, loft, Mesh
import numpy as np
from numpy.typing import ArrayLike
import trimesh


def painted_loft(loops: Sequence[ArrayLike], colors: ArrayLike,
                 caps: tuple[Color, Color]) -> Mesh:
    """
    Return a loft over S + 1 loops of N points with a colour for each quad, (S, N, 3).

    Quad (s, n) lies between loops s and s + 1 and points n and n + 1; caps are the colours of
    the first and the last end.
    """
    quads = np.asarray(colors, np.float64).reshape(-1, 3)
    size = len(np.asarray(loops[0]))
    mesh = loft(loops, (0, 0, 0))
    # A loft's faces: one triangle of every quad, the other of every quad, then both caps.
    faces = np.vstack([quads, quads, np.tile(caps[0], (size, 1)), np.tile(caps[1], (size, 1))])
    rgba = np.column_stack([np.clip(np.rint(faces), 0, 255), np.full(len(faces), 255)])
    mesh.visual = trimesh.visual.ColorVisuals(mesh, face_colors=rgba.astype(np.uint8))
    return mesh
