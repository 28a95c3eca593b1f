"""The demo's object, which is known: its true cells, and the picture of a run that it ends."""

from collections.abc import Sequence
from functools import cache
from pathlib import Path

from active_recon.demo.picture import run_picture, voxel_tile
from active_recon.png_files import write_png
from active_recon.viewer.view_result import ViewResult
from active_recon.volumes.boxes import height_range
from active_recon.volumes.hidden import filled
from active_recon.volumes.meshes import load_mesh
from active_recon.volumes.voxelisation import voxelise
import numpy as np
from numpy.typing import NDArray

_LIKELY_RESOLUTION = 64


class KnownObject:
    """
    The object of a mesh file, in voxels of whatever resolution is asked for, see `filled`.

    What it has voxelised and drawn it keeps. Raises MeshError where the file is no mesh.
    """

    def __init__(self, mesh_file: Path) -> None:
        self._mesh = load_mesh(mesh_file)
        self._voxels = cache(lambda resolution: filled(voxelise(self._mesh, resolution)))
        self._tile = cache(voxel_tile)
        self._voxels(_LIKELY_RESOLUTION)  # later it would delay the loop's messages

    def occupied(self, resolution: int) -> NDArray[np.bool_]:
        """Return the true cells, (N, N, N), for N cells a side."""
        return self._voxels(resolution).occupied(0.5)

    def draw(self, view: ViewResult) -> None:
        """Draw a view's cells, so that its picture takes less time later."""
        if view.occupied is not None:
            truth = self._voxels(len(view.occupied.occupancy))
            self._tile(view.occupied, height_range(truth))

    def save_picture(self, file: Path, title: str, views: Sequence[ViewResult]) -> None:
        """Write the picture of a run that has a view."""
        if views and views[-1].occupied is not None:
            truth = self._voxels(len(views[-1].occupied.occupancy))
            picture = run_picture(f'active_recon: {title}', views, self._mesh, truth, self._tile)
            write_png(file, picture[..., ::-1])
