"""The true shape of a recorded object, in its place."""

from dataclasses import dataclass
from pathlib import Path

from active_recon.bags.runs.parameters import node_parameters
from active_recon.bags.runs.run import RecordedRun
from active_recon.errors import ConfigError, DataError
from active_recon.objects import find_object, shipped_objects
from active_recon.report.subject import shown_grid
from active_recon.volumes.binvox import read_binvox
from active_recon.volumes.hidden import hidden_cells
from active_recon.volumes.meshes import fit_to_grid, load_mesh, read_mesh
from active_recon.volumes.voxelisation import voxelise
from active_recon.volumes.voxels import RESOLUTION, turned, VoxelGrid
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_erosion
import trimesh

_SAME_SIDE = 0.01  # of a binvox and of the run's cube, as a share
_ROUNDING = 1e-6  # of a file's numbers, in cubes
_SAMPLES = 10_000  # of a surface
_TOLD = 0.005  # share of cells that were filled, of the others


@dataclass(frozen=True, eq=False)
class Truth:
    """The true cells, (X, Y, Z), and how they were placed, in a sentence."""

    cells: NDArray[np.bool_]
    placed: str


@dataclass(frozen=True)
class TruthFile:
    """
    A mesh, a binvox file, or the name of an object that ships.

    A mesh is in metres and in the object's frame. With `fit`, and if it is a shipped object, it is
    centred, scaled until its longest side is the cube's, and turned by the run's `object_yaw`.
    `up` and `front` name the mesh's axes; None: those of its format.
    """

    path: Path
    fit: bool = False
    up: str | None = None
    front: str | None = None

    def read(self, run: RecordedRun, object_size: float | None = None,
             object_yaw: float | None = None) -> Truth:
        """
        Return the true cells of a run's object.

        `object_size` in metres, `object_yaw` in radians; None: the run's.

        Raises MeshError, DataError if the mesh is outside of the run's cube, and ConfigError if a
        binvox has another resolution or size than the run.
        """
        size = object_size or _object_size(run)
        if self.path.suffix.lower() == '.binvox':
            return self._of_binvox(run, size, object_yaw)
        ships = str(self.path) in shipped_objects()
        file = find_object(str(self.path))
        if self.fit or ships:
            cells = _fitted(load_mesh(file, self.up, self.front), run, object_yaw)
            return _filled(cells, f'The true shape is {file.name}, centred, and scaled so that '
                                  "its longest side is the cube's.")
        mesh = read_mesh(file, self.up, self.front)
        low, high = (np.round(bound, 3).tolist() for bound in mesh.bounds)
        mesh.apply_transform(np.diag([1 / size, 1 / size, 1 / size, 1]))
        inside = _share_inside(mesh)
        if inside == 0:
            raise DataError(
                f"{self.path}: outside of the run's cube of {size:g} m about the origin: it "
                f"reaches from {low} to {high} m. Meshes are in metres and in the object's "
                'frame; --fit centres and scales one, --object-size sets the cube')
        outside = f' {100 * (1 - inside):.0f} % of its surface is outside of the cube.'
        truth = _filled(_in_place(mesh, _resolution(run)),
                        f'The true shape is {file.name}, in metres and in the '
                        f"object's frame.{outside if inside < 1 else ''}")
        if mesh.is_watertight or binary_erosion(truth.cells).any():
            return truth
        return Truth(truth.cells, f'{truth.placed} The mesh has holes and encloses nothing: only '
                                  'its surface counts as solid, and the IoU is too low; close its '
                                  'holes.')

    def _of_binvox(self, run: RecordedRun, size: float, object_yaw: float | None) -> Truth:
        grid, resolution = read_binvox(self.path), _resolution(run)
        side = grid.occupancy.shape[0]
        if side != resolution:
            raise ConfigError(f'{self.path}: wrong resolution: expected {resolution} cells a side '
                              f'as in {run.path.name}, got {side}')
        if self.fit:
            return Truth(_turned(grid, run, object_yaw), f'The true shape is {self.path.name}, '
                                                         "its cells taken as the cube's.")
        if abs(grid.size / size - 1) > _SAME_SIDE:
            raise ConfigError(f'{self.path}: wrong size: expected a cube of {size:g} m as in the '
                              f"run, got {grid.size:g} m; --fit uses its cells as the cube's, "
                              '--object-size sets the cube')
        return Truth(grid.occupied(0.5), f'The true shape is {self.path.name}, cell by cell.')


def known_truth(run: RecordedRun) -> Truth | None:
    """
    Return the true cells if the simulated camera showed a shipped object, else None.

    It shows the front at +x, wherever the reconstructor was told that it is.
    """
    camera = node_parameters(run, 'turntable_camera')
    mesh = Path(str(camera.get('mesh', '')))
    ships = mesh.stem in shipped_objects() and (
        mesh.parts == (mesh.stem,) or mesh.parts[-3:-1] == ('active_recon', 'objects'))
    if not ships or camera.get('up') or camera.get('front'):
        return None
    size = _object_size(run)
    shown = float(camera.get('object_size', size))
    if abs(shown / size - 1) < _SAME_SIDE:
        return TruthFile(Path(mesh.stem)).read(run, object_yaw=0.0)
    scaled = load_mesh(find_object(mesh.stem))
    scaled.apply_transform(np.diag([*[shown / size] * 3, 1.0]))
    return _filled(_in_place(scaled, _resolution(run)),
                   f'The true shape is {mesh.stem}, whose longest side was {shown:g} m; the '
                   f"run's cube is {size:g} m.")


def _filled(cells: NDArray[np.bool_], placed: str) -> Truth:
    """Return the true cells and those that no camera can tell: no image says that they are not."""
    hidden = hidden_cells(cells)
    share = hidden.sum() / max(cells.sum(), 1)
    told = (f' The mesh is open where no camera looks in: {100 * share:.0f} % more cells than '
            'its own count as solid, since no camera could see that they are not.')
    return Truth(cells | hidden, f'{placed}{told if share > _TOLD else ""}')


def _fitted(mesh: trimesh.Trimesh, run: RecordedRun, yaw: float | None) -> NDArray[np.bool_]:
    return _turned(voxelise(fit_to_grid(mesh), _resolution(run)), run, yaw)


def _turned(grid: VoxelGrid, run: RecordedRun, yaw: float | None = None) -> NDArray[np.bool_]:
    if yaw is None:
        yaw = node_parameters(run, 'reconstructor').get('object_yaw', 0.0)
    return VoxelGrid(turned(grid.occupancy, yaw)).occupied(0.5)


def _share_inside(mesh: trimesh.Trimesh) -> float:
    """Return the fraction of a mesh's surface in the unit cube about the origin."""
    if np.abs(mesh.bounds).max() <= 0.5 + _ROUNDING:
        return 1.0
    points, _ = trimesh.sample.sample_surface(mesh, _SAMPLES, seed=0)
    return float((np.abs(points) <= 0.5).all(axis=1).mean())


def _in_place(mesh: trimesh.Trimesh, resolution: int) -> NDArray[np.bool_]:
    """Return the cells of a mesh in the unit cube; parts outside of it close the mesh there."""
    third = mesh.copy()
    third.apply_transform(np.diag([1 / 3, 1 / 3, 1 / 3, 1]))
    middle = (slice(resolution, 2 * resolution),) * 3
    return voxelise(third, 3 * resolution).occupied(0.5)[middle]


def _object_size(run: RecordedRun) -> float:
    size = node_parameters(run, 'reconstructor').get('object_size')
    return next((grid.size for episode in run.episodes for view in episode.views
                 if (grid := shown_grid(view)) is not None), size or 1.0)


def _resolution(run: RecordedRun) -> int:
    return next((grid.occupancy.shape[0] for episode in run.episodes for view in episode.views
                 if (grid := shown_grid(view)) is not None), RESOLUTION)
