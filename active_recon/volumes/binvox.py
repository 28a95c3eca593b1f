"""Binvox files: voxel grids on disk, as R2N2 has them."""

from pathlib import Path

from active_recon.errors import DataError
from active_recon.volumes.voxels import VoxelGrid
from active_recon.whole_files import whole_file
import numpy as np


def read_binvox(path: Path) -> VoxelGrid:
    """
    Read a binvox file as R2N2 writes it, turned upright: z up, front +x.

    The data are ordered x, z, y, and (x, y, z) -> (x, -z, y) turns the model upright. The grid is
    centred at the origin with the header's scale as its side; the header's translate is ignored.
    Raises DataError on an incomplete binvox file.
    """
    try:
        raw = path.read_bytes()
        header, _, data = raw.partition(b'\ndata\n')
        lines = header.split(b'\n')
        if not lines[0].startswith(b'#binvox'):
            raise ValueError('another first line than #binvox')
        fields = {line.split()[0]: line.split()[1:] for line in lines if line.strip()}
        dims = tuple(int(n) for n in fields[b'dim'])
        scale = float(fields[b'scale'][0])
        values, counts = np.frombuffer(data, np.uint8).reshape(-1, 2).T
        cells = np.repeat(values, counts)
        if len(dims) != 3 or cells.size != np.prod(dims) or cells.max() > 1:
            raise ValueError(f'{cells.size} cells for the dimensions {dims}')
        file_order = cells.reshape(dims)  # [x, z, y] of the file's own axes: y is up
        occupancy = file_order[:, ::-1, :]  # (x, y, z) -> (x, -z, y)
        return VoxelGrid(np.ascontiguousarray(occupancy, np.float32), scale)
    except OSError as error:
        raise DataError(f'{path}: cannot be read: {error.strerror}') from error
    except KeyError as error:
        raise DataError(f'{path}: no whole binvox file: its header lacks '
                        f'{error.args[0].decode()}') from error
    except (ValueError, IndexError, DataError) as error:
        raise DataError(f'{path}: no whole binvox file: {error}') from error


def binvox_side(path: Path) -> float:
    """Return the side of a binvox file's grid; raises DataError where its header has none."""
    try:
        with path.open('rb') as file:
            header = file.read(1024).partition(b'\ndata\n')[0]
        side = [float(line.split()[1]) for line in header.split(b'\n')
                if line.startswith(b'scale')][0]
        return VoxelGrid(np.zeros((1, 1, 1), np.float32), side).size
    except (OSError, ValueError, IndexError, DataError) as error:
        raise DataError(f'{path}: no readable scale: expected a binvox file with one, got: '
                        f'{error}') from error


def write_binvox(grid: VoxelGrid, path: Path, threshold: float = 0.5) -> None:
    """
    Write the occupied cells as binvox, as `read_binvox` reads them; the file appears whole.

    For other programs, its translate puts the cube's centre at the origin.

    Not by trimesh: it writes other bytes, and its run lengths overflow for grids that it has read.
    """
    cells = grid.occupied(threshold)[:, ::-1, :].reshape(-1).astype(np.uint8)
    starts = np.flatnonzero(np.r_[True, cells[1:] != cells[:-1]])
    runs = bytearray()
    for value, length in zip(cells[starts], np.diff(np.r_[starts, cells.size]), strict=True):
        whole, rest = divmod(int(length), 255)
        runs += bytes((value, 255)) * whole + (bytes((value, rest)) if rest else b'')
    dims = ' '.join(map(str, grid.occupancy.shape))
    corner = f'{-grid.size / 2:.9g}'  # the cube's lowest, along each axis
    header = (f'#binvox 1\ndim {dims}\ntranslate {corner} {corner} {corner}\n'
              f'scale {grid.size:.9g}\ndata\n')
    path.parent.mkdir(parents=True, exist_ok=True)
    with whole_file(path) as unfinished:
        unfinished.write_bytes(header.encode() + runs)
