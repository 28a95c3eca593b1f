"""Reconstructed shapes as files: coloured meshes, robot descriptions, and voxels."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from active_recon.errors import ConfigError, DataError
import typer

if TYPE_CHECKING:
    from active_recon.bags.runs.run import RecordedView
    from active_recon.volumes.voxels import VoxelGrid

VOXEL_FORMATS = ('binvox', 'npz')


@dataclass(frozen=True)
class ShapeFiles:
    """
    The files for shapes; None: no file. Of several shapes, each file name gets a number.

    A mesh has the colours of the views; as `urdf` it is a robot description, of a solid of
    `density` kg/m^3. A binvox file has the cells above the threshold; an npz file has `occupancy`
    (X, Y, Z) in [0, 1], the cube's side `size` in metres, and the `threshold`. Raises ConfigError
    on any other suffix.
    """

    mesh: Path | None
    voxels: Path | None
    density: float | None = None

    def __post_init__(self) -> None:
        """Reject unknown suffixes, before any work is done."""
        from active_recon.meshes.files import MESH_FORMATS

        if self.density is not None and not (self.mesh and self.mesh.suffix.lower() == '.urdf'):
            raise ConfigError('--density: nothing to weigh: expected it with --mesh NAME.urdf, '
                              f'got {self.mesh or "no --mesh"}')
        for option, path, formats in (('--mesh', self.mesh, (*MESH_FORMATS, 'urdf')),
                                      ('--voxels', self.voxels, VOXEL_FORMATS)):
            if path is not None and path.suffix.lower().lstrip('.') not in formats:
                raise ConfigError(f'{option}: unknown suffix: expected {", ".join(formats)}, got '
                                  f'{path}')

    def write(self, shapes: Sequence[tuple['VoxelGrid', Sequence['RecordedView']]],
              threshold: float) -> None:
        """
        Write shapes, each with the views that it was made from, and print the paths.

        Each file appears whole. Of shapes some of which have no surface those have no mesh, which
        is printed. Raises DataError where none has one, or a file cannot be written.
        """
        from active_recon.volumes.binvox import write_binvox
        from active_recon.volumes.voxel_files import write_npz

        solid = [bool(grid.occupied(threshold).any()) for grid, _ in shapes]
        for number, (grid, views) in enumerate(shapes, 1):
            of_several = number if len(shapes) > 1 else None
            if self.mesh is not None:
                path = _numbered(self.mesh, of_several)
                if any(solid) and not solid[number - 1]:
                    typer.echo(f'{path}: not written: no cell is above the threshold {threshold}')
                else:
                    with _told(path):
                        missing = self._write_mesh(path, grid, views, threshold)
                    if missing:
                        typer.echo(missing)
            if self.voxels is not None:
                path = _numbered(self.voxels, of_several)
                write = write_binvox if path.suffix.lower() == '.binvox' else write_npz
                with _told(path):
                    write(grid, path, threshold)

    def _write_mesh(self, path: Path, grid: 'VoxelGrid', views: Sequence['RecordedView'],
                    threshold: float) -> str:
        """Write a mesh; return in words what is missing, or ''."""
        from active_recon.meshes.coloring import colored
        from active_recon.meshes.files import write_mesh
        from active_recon.meshes.photos import album_of
        from active_recon.meshes.urdf import DENSITY, write_urdf
        from active_recon.volumes.refinement import refined_mesh

        photos = album_of([(view.image, view.camera) for view in views], grid.size).photos
        mesh = colored(refined_mesh(grid, threshold), photos)
        if path.suffix.lower() == '.urdf':
            return write_urdf(mesh, path, DENSITY if self.density is None else self.density)
        write_mesh(mesh, path)
        return ''


@contextmanager
def _told(path: Path) -> Iterator[None]:
    """Print that a file was written once the block has; DataError where it cannot be."""
    try:
        yield
    except OSError as error:
        raise DataError(f'{path}: not written: expected a folder with room, got: '
                        f'{error.strerror}') from error
    typer.echo(f'wrote {path}')


def _numbered(path: Path, number: int | None) -> Path:
    return path if number is None else path.with_stem(f'{path.stem}-{number}')
