"""A shape as files: mesh, voxels, a picture, and a description of how it was made."""

from collections.abc import Collection
from dataclasses import asdict
import json
from pathlib import Path

from active_recon import __version__
from active_recon.errors import DataError
from active_recon.meshes.files import MESH_FORMATS, write_mesh
from active_recon.meshes.urdf import write_urdf
from active_recon.photos.picture import shape_picture
from active_recon.photos.shape import Shape
from active_recon.png_files import write_png
from active_recon.volumes.binvox import write_binvox
from active_recon.volumes.voxel_files import write_npz
from active_recon.whole_files import whole_file

FORMATS = (*MESH_FORMATS, 'urdf')
"""Of the mesh; `urdf` is a robot description, see `write_urdf`."""


def save_shape(shape: Shape, folder: Path, mesh_format: str = 'ply'
               ) -> tuple[list[Path], str]:
    """
    Write mesh, voxels.npz, voxels.binvox, picture.png and shape.json.

    Returns their paths, and in words what is missing in a robot description, see `write_urdf`.
    Mesh and voxels are in the object frame in metres; shape.json has the similarity that carries
    them into the world of the camera file. Raises DataError where no cell is occupied or a file
    cannot be written, ConfigError on an unknown format.
    """
    paths = [folder / name for name in (
        f'mesh.{mesh_format}', 'voxels.npz', 'voxels.binvox', 'picture.png', 'shape.json')]
    mesh, voxels, binvox, picture, description = paths
    missing = ''
    try:
        if mesh_format == 'urdf':
            folder.mkdir(parents=True, exist_ok=True)
            missing = write_urdf(shape.mesh(), mesh)
        else:
            write_mesh(shape.mesh(), mesh)
        write_npz(shape.grid, voxels, shape.threshold)
        write_binvox(shape.grid, binvox, shape.threshold)
        write_png(picture, shape_picture(shape)[..., ::-1])
        with whole_file(description) as unfinished:
            unfinished.write_text(json.dumps(described(shape), indent=1) + '\n')
    except OSError as error:
        raise DataError(f'{folder}: not written: expected a folder with room, got: '
                        f'{error}') from error
    return paths, missing


def of_earlier_run(folder: Path, written: Collection[Path]) -> list[Path]:
    """Return what a folder has of an earlier shape, where nothing was `written` in its place."""
    names = [*(f'mesh.{each}' for each in FORMATS), 'bag', 'report.html']
    return [path for name in names if (path := folder / name).exists() and path not in written]


def described(shape: Shape) -> dict[str, object]:
    """Return all about a shape but its cells, ready for JSON."""
    return {
        'version': __version__, 'size_m': shape.size, 'threshold': shape.threshold,
        'world_from_object': shape.world_from_object.tolist(),
        'cube': {'centre': shape.cube.centre.tolist(), 'side': shape.cube.side,
                 'up': shape.cube.up.tolist()},
        'ground': None if shape.ground is None else {
            'normal': shape.ground.normal.tolist(), 'level': shape.ground.level},
        'background': shape.background,
        'views': [{'photo': view.name, 'background': view.background,
                   'depth': view.depth is not None,
                   'azimuth_rad': view.camera.azimuth, 'elevation_rad': view.camera.elevation,
                   'distance_m': view.camera.distance} for view in shape.views],
        'quality': None if shape.quality is None else asdict(shape.quality),
        'warnings': list(shape.warnings), 'left_out': list(shape.left_out),
        'network': shape.provenance}
