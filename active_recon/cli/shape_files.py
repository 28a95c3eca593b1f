"""Reconstructed shapes as files: meshes, and voxels with or without their probabilities."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from active_recon.errors import ConfigError
import typer

if TYPE_CHECKING:
    from active_recon.volumes.voxels import VoxelGrid

VOXEL_FORMATS = ('binvox', 'npz')


@dataclass(frozen=True)
class ShapeFiles:
    """
    The files for shapes; None: no file. Of several shapes, each file name gets a number.

    A binvox file has the cells above the threshold; an npz file has `occupancy` (X, Y, Z) in
    [0, 1], the cube's side `size` in metres, and the `threshold`. Raises ConfigError on any other
    suffix.
    """

    mesh: Path | None
    voxels: Path | None

    def __post_init__(self) -> None:
        """Reject unknown suffixes, before any work is done."""
        from active_recon.volumes.voxels import MESH_FORMATS

        for option, path, formats in (('--mesh', self.mesh, MESH_FORMATS),
                                      ('--voxels', self.voxels, VOXEL_FORMATS)):
            if path is not None and path.suffix.lower().lstrip('.') not in formats:
                raise ConfigError(f'{option}: unknown suffix: expected {", ".join(formats)}, got '
                                  f'{path}')

    def write(self, grids: Sequence['VoxelGrid'], threshold: float) -> None:
        """Write the shapes and print the paths; raises DataError where there is no surface."""
        from active_recon.volumes.binvox import write_binvox
        from active_recon.volumes.refinement import refined_mesh
        from active_recon.volumes.voxels import write_mesh
        import numpy as np

        for number, grid in enumerate(grids, 1):
            of_several = number if len(grids) > 1 else None
            if self.mesh is not None:
                path = _numbered(self.mesh, of_several)
                write_mesh(refined_mesh(grid, threshold), path)
                typer.echo(f'wrote {path}')
            if self.voxels is not None:
                path = _numbered(self.voxels, of_several)
                path.parent.mkdir(parents=True, exist_ok=True)
                if path.suffix.lower() == '.binvox':
                    write_binvox(grid, path, threshold)
                else:
                    np.savez_compressed(path, occupancy=grid.occupancy, size=grid.size,
                                        threshold=threshold)
                typer.echo(f'wrote {path}')


def _numbered(path: Path, number: int | None) -> Path:
    return path if number is None else path.with_stem(f'{path.stem}-{number}')
