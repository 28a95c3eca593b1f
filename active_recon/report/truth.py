"""The true shape of a recorded object, and the shape where a bag holds none."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from active_recon.bags.parameters import node_parameters
from active_recon.bags.recorded_object import seen_again
from active_recon.bags.run import RecordedEpisode, RecordedRun
from active_recon.errors import ConfigError
from active_recon.meshes import load_mesh
from active_recon.objects import find_object, shipped_objects
from active_recon.report.subject import shown_grid
from active_recon.voxelise import voxelise
from active_recon.voxels import read_binvox, RESOLUTION, turned, VoxelGrid
import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from active_recon.reconstructor import Reconstructor


def read_truth(path: Path, run: RecordedRun) -> NDArray[np.bool_]:
    """
    Return the true cells of a run's object, (X, Y, Z), from a mesh or a binvox file.

    The name of an object that ships is a mesh too. The cells stand as the run's object stood, by
    the reconstructor's `object_yaw`. Raises MeshError,
    DataError, and ConfigError where a binvox has another number of cells than the run.
    """
    resolution = _resolution(run)
    if path.suffix.lower() == '.binvox':
        grid = read_binvox(path)
    else:
        grid = voxelise(load_mesh(find_object(str(path))), resolution)
    side = grid.occupancy.shape[0]
    if side != resolution:
        raise ConfigError(f'{path}: expected {resolution} cells a side, as {run.path.name} has, '
                          f'got {side}')
    yaw = node_parameters(run, 'reconstructor').get('object_yaw', 0.0)
    return VoxelGrid(turned(grid.occupancy, yaw)).occupied(0.5)


def known_truth(run: RecordedRun) -> NDArray[np.bool_] | None:
    """Return the true cells where the camera says that it showed an object that ships."""
    camera = node_parameters(run, 'turntable_camera')
    mesh = Path(str(camera.get('mesh', '')))
    ships = mesh.stem in shipped_objects() and (
        mesh.parts == (mesh.stem,) or mesh.parts[-3:-1] == ('active_recon', 'objects'))
    if not ships or camera.get('up') or camera.get('front'):
        return None
    return read_truth(find_object(mesh.stem), run)


def with_reconstruction(run: RecordedRun, reconstructor: 'Reconstructor') -> RecordedRun:
    """Return the run with the shapes that its images give where the bag holds none."""
    told = {'needs_front': reconstructor.provenance['needs_front']}
    return replace(run, provenance={**run.provenance, **told},
                   episodes=[_reconstructed(episode, reconstructor) for episode in run.episodes])


def lacks_reconstruction(run: RecordedRun) -> bool:
    """Return whether there is a view after which no shape was recorded."""
    return any(shown_grid(view) is None for episode in run.episodes for view in episode.views)


def _reconstructed(episode: RecordedEpisode, reconstructor: 'Reconstructor') -> RecordedEpisode:
    views = []
    for step in seen_again(episode.views, reconstructor):
        grid = step.known.grid
        views.append(replace(step.view, reconstruction=grid, entropy=grid.entropy(),
                             occupied=grid.above(reconstructor.threshold)))
    return replace(episode, views=views)


def _resolution(run: RecordedRun) -> int:
    return next((grid.occupancy.shape[0] for episode in run.episodes for view in episode.views
                 if (grid := shown_grid(view)) is not None), RESOLUTION)
