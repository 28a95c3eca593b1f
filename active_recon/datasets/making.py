"""Make a dataset from meshes: render and voxelise every object, in parallel."""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
import math
import os
from pathlib import Path

from active_recon.cluster import Crew
from active_recon.cluster.local import LocalCrew
from active_recon.cluster.results import is_no_room
from active_recon.datasets.drawn_cameras import TURNTABLE, Viewing
from active_recon.datasets.layout import (
    ObjectFolder,
    write_depths,
    write_object,
    write_voxels,
)
from active_recon.errors import ActiveReconError, DataError
from active_recon.geometry.cameras import Camera
from active_recon.shapes import check_category, make_shape
from active_recon.volumes.meshes import file_rotation, fit_to_grid, load_mesh
from active_recon.volumes.rendering import Renderer
from active_recon.volumes.voxelisation import voxelise
from active_recon.volumes.voxels import FINE_RESOLUTION, iou
import numpy as np
from numpy.typing import NDArray
import trimesh

_ALIKE = 1e-5  # difference of poses by which files round them
_SAME_SHAPE = 0.98
MESH_SUFFIXES = {'.glb', '.gltf', '.obj', '.ply', '.stl', '.off', '.3mf', '.dae'}


@dataclass(frozen=True)
class Job:
    """
    An object to render and voxelise.

    Its destination folder, and a function that builds its mesh (called in a worker process).
    """

    folder: ObjectFolder
    make_mesh: Callable[[], trimesh.Trimesh]


@dataclass(frozen=True)
class Outcome:
    """Result of a job: made, kept as it was, or rejected with a reason (`refusal`)."""

    folder: ObjectFolder
    refusal: str = ''
    kept: bool = False


def yawed(mesh: trimesh.Trimesh, yaw: float) -> trimesh.Trimesh:
    """Return the mesh rotated by `yaw` about +z, radians, and fitted to the grid again."""
    turned = mesh.copy()
    cosine, sine = math.cos(yaw), math.sin(yaw)
    turn = np.eye(4)
    turn[:2, :2] = [[cosine, -sine], [sine, cosine]]
    turned.apply_transform(turn)
    return fit_to_grid(turned)  # a rotation can enlarge the bounding box


def mesh_files(folder: Path) -> list[Path]:
    """Return the mesh files in a folder and those below it, without hidden ones, as of macOS."""
    return sorted(path for path in folder.rglob('*') if path.suffix.lower() in MESH_SUFFIXES
                  and not path.name.startswith('.'))


def mesh_jobs(meshes: Path, out: Path, up: str | None, front: str | None) -> list[Job]:
    """
    Return a job for one mesh file, or for each mesh file in a folder `<category>/<mesh>`.

    The names of folders below the category become part of the object's name; where several files
    have the same name, their suffixes do too. Raises DataError where there is no mesh,
    ConfigError on invalid axes.
    """
    if meshes.is_file():
        files, top = [meshes], meshes.parent
    elif meshes.is_dir():
        files, top = mesh_files(meshes), meshes
    else:
        raise DataError(f'{meshes}: no such file or folder: expected a mesh file or a folder of '
                        '<category>/<mesh>')
    if not files:
        raise DataError(f'{meshes}: no meshes there: expected files '
                        f'({", ".join(sorted(MESH_SUFFIXES))}), found none')
    for path in files:
        file_rotation(path, up, front)  # an invalid option is rejected once, before any work
    folders = [_mesh_folder(out, top, path) for path in files]
    alike = Counter(folders)
    return [Job(folder if alike[folder] == 1 else
                replace(folder, name=f'{folder.name}{path.suffix}'),
                partial(load_mesh, path, up, front))
            for folder, path in zip(folders, files, strict=True)]


def _mesh_folder(out: Path, top: Path, path: Path) -> ObjectFolder:
    *folders, name = path.relative_to(top).with_suffix('').parts
    category = folders[0] if folders else top.resolve().name
    return ObjectFolder(out, category or 'object', '-'.join([*folders[1:], name]))


def shape_jobs(category: str, seeds: Iterable[int], out: Path) -> list[Job]:
    """Return a job for each seed of a parametric category; raises ConfigError if unknown."""
    check_category(category)
    return [Job(ObjectFolder(out, category, f'{category}-{seed:06d}'),
                partial(make_shape, category, seed)) for seed in seeds]


def make_object(job: Job, samples: int, fine: bool = False, viewing: Viewing = TURNTABLE,
                depth: bool = False) -> Outcome:
    """
    Render and voxelise one object at 32 cells a side, with `fine` also at 64.

    Each image pixel averages `samples` x `samples` rays. With `depth` there is a depth image,
    without noise, beside each image. Existing files are kept, if they are of the same cameras;
    where some are lacking, of the same shape, too. Errors become the outcome's `refusal`; raises
    OSError where there is no room to write.
    """
    try:
        finished = job.folder.complete
        # What lies beside one that is not finished is made anew
        lacks_fine = fine and not (finished and job.folder.voxels_path(FINE_RESOLUTION).is_file())
        lacks_depth = depth and not (finished and job.folder.has_depth)
        if finished:
            _check_cameras(job.folder, viewing)
            if not (lacks_fine or lacks_depth):
                return Outcome(job.folder, kept=True)
        mesh = job.make_mesh()
        yaw = viewing.yaw(job.folder.full_name)
        if yaw:
            mesh = yawed(mesh, yaw)
        if finished:
            _check_shape(job.folder, mesh)
        else:
            _render(job.folder, mesh, samples, viewing)
        if lacks_fine:
            write_voxels(job.folder, voxelise(mesh, FINE_RESOLUTION))
        if lacks_depth:
            renderer = Renderer(mesh)
            write_depths(job.folder, [renderer.depth(camera) for camera in job.folder.cameras()])
    except (ActiveReconError, OSError) as error:
        if is_no_room(error):
            raise
        return Outcome(job.folder, str(error))
    return Outcome(job.folder)


def _check_cameras(folder: ObjectFolder, viewing: Viewing) -> None:
    """Raise DataError where a finished object was rendered from other cameras."""
    found, asked = folder.cameras(), viewing.of(folder.full_name)[0]
    if len(found) != len(asked) or any(
            there.intrinsics != here.intrinsics
            or not np.allclose(there.pose, here.pose, rtol=0, atol=_ALIKE)
            for there, here in zip(found, asked, strict=True)):
        raise DataError(f'finished from other cameras: expected the {len(asked)} of these '
                        f'options, found {len(found)} others; choose another folder')


def _check_shape(folder: ObjectFolder, mesh: trimesh.Trimesh) -> None:
    """Raise DataError where a finished object is turned otherwise, or another one."""
    share = float(iou(folder.voxels().occupied(0.5), voxelise(mesh).occupied(0.5)))
    if share < _SAME_SHAPE:
        raise DataError(f'finished as another shape (IoU {share:.2f}): expected the same mesh and '
                        '--turned, --up and --front as before; choose another folder')


def _render(folder: ObjectFolder, mesh: trimesh.Trimesh, samples: int, viewing: Viewing) -> None:
    cameras, lights = viewing.of(folder.full_name)
    images = rendered(mesh, cameras, lights, samples)
    write_object(folder, images, cameras, voxelise(mesh))


def rendered(mesh: trimesh.Trimesh, cameras: Sequence[Camera],
             lights: Sequence[NDArray[np.float64] | None],
             samples: int) -> list[NDArray[np.uint8]]:
    """
    Return the RGBA images of a mesh from cameras, each under its light; see `Viewing.of`.

    Raises DataError where none of them shows a surface.
    """
    renderer = Renderer(mesh)
    images = [renderer.render(camera, samples, light)
              for camera, light in zip(cameras, lights, strict=True)]
    if not np.any(images):
        raise DataError('no visible surface: expected one in at least one image, got none')
    return images


def make_dataset(jobs: list[Job], samples: int = 2, workers: int = 1, fine: bool = False,
                 viewing: Viewing = TURNTABLE, depth: bool = False, crew: Crew | None = None,
                 reads: Sequence[Path] = ()) -> Iterator[Outcome]:
    """
    Make all objects in `workers` processes; yield each one's outcome as it is finished.

    `crew` makes them instead, where it is given; its machines must see the paths in `reads`.
    Raises DataError where two jobs would write the same object, WorkError where nothing can be
    written.
    """
    for folder, count in Counter(job.folder for job in jobs).most_common(1):
        if count > 1:
            raise DataError('several meshes of one name: expected each object once, got '
                            f'{count} meshes for {folder.full_name}; rename their '
                            'files')
    out = Path(os.path.commonpath([job.folder.root for job in jobs])) if jobs else None
    make = partial(make_object, samples=samples, fine=fine, viewing=viewing,
                   depth=depth)
    for result in (crew or LocalCrew(workers)).map(make, jobs, out, reads):
        outcome: Outcome | None = result.value
        yield outcome or Outcome(jobs[result.index].folder, result.refusal)
