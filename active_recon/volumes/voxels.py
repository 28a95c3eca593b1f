"""The voxel grid: a cube of occupancy probabilities, its measures, and its forms on disk."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, TYPE_CHECKING

from active_recon.errors import ConfigError, DataError
import numpy as np
from numpy.typing import NDArray
from scipy.special import xlogy

if TYPE_CHECKING:
    import trimesh

RESOLUTION = 32
FINE_RESOLUTION = 64
_MOST_CELLS = 256  # a side
# Centres of cells of different powers of two never coincide: where one fits, no other does
_RESOLUTIONS = sorted(range(1, _MOST_CELLS + 1), key=lambda side: (side & (side - 1) > 0, side))
_FEW = 300  # points tested before all of them
_TELLING = 8  # this many cells of an object are never all a multiple of 3 apart by chance
_OFF_CENTRE = 1e-3  # in cells: above float32's rounding, below the differences between grids
MESH_FORMATS = ('ply', 'obj', 'stl')
PUBLISHED_FLOOR = 0.02
"""Cells up to this occupancy are left out of the published probabilities and their entropy."""


def iou(predicted: Any, truth: Any, axes: tuple[int, ...] = (-3, -2, -1)) -> Any:
    """
    Return intersection over union of two boolean arrays or tensors of one shape, in [0, 1].

    The measure of the paper's section 3.3, over the last three axes (voxels) or those given
    (silhouettes: the last two); the other axes stay. The IoU of two empty shapes is 1.
    """
    intersection, union = _count(predicted & truth, axes), _count(predicted | truth, axes)
    empty = union == 0
    return (intersection + empty) / (union + empty)


def entropy(occupancy: Any) -> Any:
    """
    Return the entropy in nats, -sum(p log p + (1 - p) log(1 - p)), of occupancies in [0, 1].

    Arrays or tensors, (..., X, Y, Z) to (...).
    """
    return paper_entropy(occupancy) + paper_entropy(1 - occupancy)


def paper_entropy(occupancy: Any) -> Any:
    """Return -sum(p log p) in nats, the paper's section 4.6: `entropy` without its second term."""
    if isinstance(occupancy, np.ndarray):
        return -xlogy(occupancy, occupancy).sum((-3, -2, -1))
    return -occupancy.xlogy(occupancy).sum((-3, -2, -1))


def _count(cells: Any, axes: tuple[int, ...]) -> Any:
    if isinstance(cells, np.ndarray):
        return cells.sum(axes)
    return cells.float().sum(axes)  # torch is ten times slower at booleans; exact up to 256^3


@dataclass(frozen=True, eq=False)
class VoxelGrid:
    """
    A cube of voxels in the object frame, centred at its origin.

    `occupancy` is (X, Y, Z) float32 in [0, 1], indexed [x, y, z]; `size` is the cube's side in
    metres. Raises DataError where the shape is not a cube or the size not finite and above 0.
    """

    occupancy: NDArray[np.float32]
    size: float = 1.0

    def __post_init__(self) -> None:
        """Reject other shapes and sizes."""
        shape = self.occupancy.shape
        if len(shape) != 3 or len(set(shape)) != 1:
            raise DataError('not a cube: expected as many voxels along every axis, got the shape '
                            f'{shape}')
        if not 0 < self.size < np.inf:
            raise DataError('invalid size: expected a finite side of the cube above 0 m, got '
                            f'{self.size}')

    @property
    def cell_size(self) -> float:
        """Side of one cell, metres."""
        return float(self.size / self.occupancy.shape[0])

    def occupied(self, threshold: float) -> NDArray[np.bool_]:
        """Return which cells are above the threshold, (X, Y, Z)."""
        above: NDArray[np.bool_] = self.occupancy > threshold
        return above

    def above(self, threshold: float) -> 'VoxelGrid':
        """Return the grid with all cells up to the threshold set to 0, as in its point cloud."""
        occupancy = np.where(self.occupied(threshold), self.occupancy, np.float32(0))
        return VoxelGrid(np.ascontiguousarray(occupancy), self.size)

    def as_fine_as(self, other: 'VoxelGrid') -> 'VoxelGrid':
        """Return this grid; if it has no cell above 0, an empty one at the other's resolution."""
        return self if self.occupancy.any() else VoxelGrid(
            np.zeros_like(other.occupancy), self.size)

    def entropy(self) -> float:
        """
        Return the entropy in nats, -sum(p log p + (1 - p) log(1 - p)), of the published cells.

        Those are the cells above PUBLISHED_FLOOR, so a grid and its point cloud have exactly the
        same entropy.
        """
        cells = self.occupancy[self.occupied(PUBLISHED_FLOOR)].astype(np.float64)
        return float(entropy(cells[None, None]))

    def points(self, threshold: float) -> NDArray[np.float32]:
        """Return x, y, z (metres) and occupancy of the cells above the threshold, (N, 4)."""
        index = np.argwhere(self.occupied(threshold))
        centers = (index + 0.5) * self.cell_size - self.size / 2
        return np.column_stack([centers, self.occupancy[tuple(index.T)]]).astype(np.float32)

    def mesh(self, threshold: float) -> 'trimesh.Trimesh':
        """
        Return the isosurface at the threshold by marching cubes, in metres, closed at the border.

        Raises DataError where no cell is above the threshold.
        """
        from skimage.measure import marching_cubes  # slow to import, and only meshes need them
        import trimesh

        if not self.occupied(threshold).any():
            raise DataError(f'no cell is above the threshold {threshold}: there is no surface yet')
        # A margin of empty cells closes the surface of an object that touches the border.
        padded = np.pad(self.occupancy, 1)
        vertices, faces, _, _ = marching_cubes(  # type: ignore[no-untyped-call]
            padded, threshold)
        # Sample (i, j, k) of the padded array is the centre of cell (i - 1, j - 1, k - 1).
        placed = (vertices - 0.5) * self.cell_size - self.size / 2
        mesh = trimesh.Trimesh(placed, faces, process=False)
        if mesh.volume < 0:
            mesh.invert()
        return mesh


def grid_from_points(points: NDArray[np.float32], size: float = 1.0,
                     resolution: int = RESOLUTION) -> VoxelGrid:
    """
    Return the grid of points (N, 4): x, y, z, occupancy; the inverse of `VoxelGrid.points`.

    Its resolution is the smallest with every point at the centre of a cell, powers of two first;
    `resolution` is used where there are no points. Raises DataError of the kind 'cloud' where
    points are outside of the cube of `size` metres, are not at the centres of one grid's cells,
    only at every third, fifth ... of them, share a cell, or have an occupancy outside of [0, 1].
    """
    if not len(points):
        return VoxelGrid(np.zeros((resolution,) * 3, np.float32), size)
    with np.errstate(invalid='ignore', over='ignore'):  # values that are not finite: see below
        shares = points[:, :3] / size + np.float32(0.5)
    if not ((shares >= 0) & (shares < 1)).all():  # also where a coordinate is NaN
        raise DataError(f'point out of the cube: expected all inside a cube of {size} m about the '
                        'origin', 'cloud')
    if not ((points[:, 3] >= 0) & (points[:, 3] <= 1)).all():
        raise DataError(f'invalid occupancy: expected values in [0, 1], got {points[:, 3].min()} '
                        f'to {points[:, 3].max()}', 'cloud')
    side = _cells_a_side(shares)
    if side is None:
        raise DataError('points between cell centres: expected them at the centres of at '
                        f'most {_MOST_CELLS} cells a side of a cube of {size} m, got '
                        f'{len(points)} elsewhere', 'cloud')
    index = (shares * side).astype(np.intp)
    if (spacing := _spacing(index)) > 1:
        raise DataError('points of a cube of another size: expected the cells of a cube of '
                        f'{size} m beside each other, got {len(points)} that are {spacing} of '
                        f'{side} a side apart', 'cloud')
    x, y, z = index.T
    cells = (x * side + y) * side + z
    occupancy, filled = np.zeros(side ** 3, np.float32), np.zeros(side ** 3, bool)
    occupancy[cells], filled[cells] = points[:, 3], True
    if (count := np.count_nonzero(filled)) < len(points):
        raise DataError(f'several points in a cell: expected one point a cell, got {len(points)} '
                        f'in {count} cells of {side} a side', 'cloud')
    return VoxelGrid(occupancy.reshape((side,) * 3), size)


def _cells_a_side(shares: NDArray[np.floating]) -> int | None:
    """Return the resolution whose cell centres points (N, 3) in [0, 1) are, None if none is."""
    def fit(shares: NDArray[np.floating], side: int) -> bool:
        places = shares * side
        return bool((np.abs(places - np.floor(places) - 0.5) <= _OFF_CENTRE).all())

    return next((side for side in _RESOLUTIONS
                 if fit(shares[:_FEW], side) and fit(shares, side)), None)


def _spacing(index: NDArray[np.intp]) -> int:
    """
    Return the spacing of points (N, 3) in cells where it is that of a coarser grid, else 1.

    Grids with the same centre share cell centres only if one is an odd number of times finer.
    """
    if len(index) < _TELLING:
        return 1
    for points in (index[:_FEW], index):
        spacing = int(np.gcd.reduce(np.abs(points - index[0]), axis=None))
        if spacing % 2 == 0 or spacing == 1:
            return 1
    return spacing


def write_mesh(mesh: 'trimesh.Trimesh', path: Path) -> None:
    """Write a mesh as PLY, OBJ or STL, by the file's suffix; raises ConfigError on others."""
    suffix = path.suffix.lower().lstrip('.')
    if suffix not in MESH_FORMATS:
        raise ConfigError(f'{path}: no mesh has that suffix: expected {", ".join(MESH_FORMATS)}')
    path.parent.mkdir(parents=True, exist_ok=True)
    mesh.export(path)


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
    except (OSError, ValueError, IndexError) as error:
        raise DataError(f'{path}: no readable scale: expected a binvox file with one, got: '
                        f'{error}') from error


def write_binvox(grid: VoxelGrid, path: Path, threshold: float = 0.5) -> None:
    """
    Write the occupied cells as binvox, as `read_binvox` reads them.

    Not by trimesh: it writes other bytes, and its run lengths overflow for grids that it has read.
    """
    cells = grid.occupied(threshold)[:, ::-1, :].reshape(-1).astype(np.uint8)
    starts = np.flatnonzero(np.r_[True, cells[1:] != cells[:-1]])
    runs = bytearray()
    for value, length in zip(cells[starts], np.diff(np.r_[starts, cells.size]), strict=True):
        whole, rest = divmod(int(length), 255)
        runs += bytes((value, 255)) * whole + (bytes((value, rest)) if rest else b'')
    dims = ' '.join(map(str, grid.occupancy.shape))
    header = f'#binvox 1\ndim {dims}\ntranslate 0 0 0\nscale {grid.size:.9g}\ndata\n'
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(header.encode() + runs)


def turned(occupancy: NDArray[np.float32], yaw: float) -> NDArray[np.float32]:
    """
    Return occupancies (X, Y, Z) rotated counter-clockwise about +z by a yaw in radians.

    Cells are interpolated linearly; cells rotated out of the cube are lost. A yaw of 0 is exact.
    """
    if yaw == 0:
        return occupancy
    from scipy.ndimage import affine_transform

    cosine, sine = np.cos(yaw), np.sin(yaw)
    to_source = np.array([[cosine, sine, 0], [-sine, cosine, 0], [0, 0, 1]])
    center = (np.array(occupancy.shape) - 1) / 2
    result: NDArray[np.float32] = affine_transform(
        occupancy, to_source, center - to_source @ center, order=1, mode='grid-constant')
    return result
