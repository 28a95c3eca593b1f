"""The surface after the last view in the colours of the views, as JSON values."""

from base64 import b64encode
from typing import Any

from active_recon.meshes.photos import album_of
from active_recon.report.subject import shown_grid, Subject
import numpy as np

_STEPS = 65535


def colored_surface(subject: Subject) -> dict[str, str] | None:
    """
    Return the corners, faces and colours of an episode's surface in base64; None without one.

    `corners` are little-endian uint16, three a corner, from 0 to 65535 across two sides of the
    cube; `faces` uint32, three a face; `colors` uint8, red, green and blue of a corner.
    """
    # Rays and marching cubes are slow to import, and a page of figures alone needs neither
    from active_recon.meshes.coloring import surface_colors

    grid = shown_grid(subject.views[-1])
    if grid is None or not grid.occupied(subject.threshold).any():
        return None
    mesh = grid.mesh(subject.threshold)
    found = surface_colors(mesh, album_of(
        [(view.image, view.camera) for view in subject.views], grid.size).photos)
    if found is None:
        return None
    corners = np.rint((np.asarray(mesh.vertices) / (2 * grid.size) + 0.5) * _STEPS)
    return {'corners': _packed(corners, '<u2'), 'faces': _packed(mesh.faces, '<u4'),
            'colors': _packed(found.colors, 'u1')}


def _packed(values: Any, kind: str) -> str:
    return b64encode(np.ascontiguousarray(values, kind).tobytes()).decode()
