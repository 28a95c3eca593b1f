"""Voxels as a file of numpy."""

from io import BytesIO
from pathlib import Path

from active_recon.volumes.voxels import VoxelGrid
from active_recon.whole_files import whole_file
import numpy as np


def write_npz(grid: VoxelGrid, path: Path, threshold: float) -> None:
    """
    Write `occupancy` (X, Y, Z), the cube's side `size` in metres, and the `threshold`.

    The file appears whole, under that name whatever its suffix.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    packed = BytesIO()
    np.savez_compressed(packed, occupancy=grid.occupancy, size=grid.size, threshold=threshold)
    with whole_file(path) as unfinished:
        unfinished.write_bytes(packed.getbuffer())
