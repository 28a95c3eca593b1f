"""
R2N2's layout on disk, read and written: the same for real ShapeNet and for datasets made here.

    <root>/ShapeNetRendering/<category>/<id>/rendering/NN.png  RGBA, 137 x 137
                                                      /NN_depth.png (optional)
                                                      /rendering_metadata.txt
                                                      /renderings.txt
                                                      /cameras.json (optional)
    <root>/ShapeNetVox32/<category>/<id>/model.binvox
    <root>/ShapeNetVox64/<category>/<id>/model.binvox (optional)

A row of the metadata holds azimuth, elevation and in-plane rotation in degrees, distance, and a
field of view, which is ignored. The azimuth is clockwise, so it is negated, and the distance is in
units of 1.75 sides of the grid. The metadata assumes R2N2's lens and no roll; any other cameras
are stored in `cameras.json` instead, which takes precedence: for each camera its pose, 4 x 4
object from optical frame, and its intrinsics in pixels. A depth image has the size of the image
beside it, 16 bits, in thousandths of the cameras' unit along the optical axis (millimetres where
that is metres); 0 is no value.
"""

from collections.abc import Sequence
from dataclasses import dataclass
import filecmp
import json
import math
from pathlib import Path

from active_recon.errors import DataError, ViewError
from active_recon.geometry.cameras import Camera, CANONICAL_INTRINSICS, Intrinsics, orbit_camera
from active_recon.json_text import json_value
from active_recon.png_files import write_png
from active_recon.volumes.binvox import binvox_side, read_binvox, write_binvox
from active_recon.volumes.voxels import FINE_RESOLUTION, RESOLUTION, VoxelGrid
from active_recon.whole_files import whole_file
import cv2
import numpy as np
from numpy.typing import NDArray

RENDERING, VOXELS = 'ShapeNetRendering', 'ShapeNetVox'
_CAMERAS = 'cameras.json'
_LENS = ('fx', 'fy', 'cx', 'cy', 'width', 'height')
_DISTANCE_UNIT = 1.75
_STEPS, _FARTHEST = 1000, 65.535  # of depth images: steps in a unit, and what 16 bits hold
_FIELD_OF_VIEW_COLUMN = 25.0  # as R2N2 writes it; not the field of view of its lens


@dataclass(frozen=True)
class ObjectFolder:
    """One object of a dataset: its images, cameras and voxels, read from disk at each call."""

    root: Path
    category: str
    name: str

    @property
    def full_name(self) -> str:
        """CATEGORY/NAME, by which it is known wherever its dataset lies."""
        return f'{self.category}/{self.name}'

    @property
    def images_folder(self) -> Path:
        """Folder of the images and their metadata."""
        return self.root / RENDERING / self.category / self.name / 'rendering'

    def voxels_path(self, resolution: int = RESOLUTION) -> Path:
        """Return the path of the voxels with `resolution` cells a side."""
        return self.root / f'{VOXELS}{resolution}' / self.category / self.name / 'model.binvox'

    def cameras(self) -> list[Camera]:
        """
        Return the camera of every image, with poses in the units of the voxel file's grid.

        Raises DataError where they cannot be read.
        """
        written = self.images_folder / _CAMERAS
        if written.is_file():
            return _read_cameras(written)
        path = self.images_folder / 'rendering_metadata.txt'
        try:
            rows = np.array([line.split() for line in path.read_text().splitlines()], np.float64)
            if rows.ndim != 2 or rows.shape[1] != 5:
                raise ValueError(f'the shape {rows.shape}')
            return [orbit_camera(-math.radians(azimuth), math.radians(elevation),
                                 distance * _DISTANCE_UNIT)
                    for azimuth, elevation, _, distance, _ in rows]
        except (OSError, ValueError, ViewError) as error:
            raise DataError(f'{path}: no readable cameras: expected rows of five numbers, got: '
                            f'{error}') from error

    def image(self, index: int) -> NDArray[np.uint8]:
        """Return one image, (H, W, 4) uint8 RGBA; raises DataError where it cannot be read."""
        path = self.images_folder / f'{index:02d}.png'
        bgra = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
        if bgra is None:
            found = 'no whole PNG' if path.is_file() else 'no file'
            raise DataError(f'{path}: no readable image: expected a PNG, found {found}')
        if bgra.ndim != 3 or bgra.shape[2] != 4 or bgra.dtype != np.uint8:
            raise DataError(f'{path}: wrong image format: expected four channels (RGBA) of 8 '
                            f'bits, got the shape {bgra.shape} {bgra.dtype}')
        return np.asarray(cv2.cvtColor(bgra, cv2.COLOR_BGRA2RGBA), np.uint8)

    def depth_path(self, index: int) -> Path:
        """Return the path of the depth image beside an image."""
        return self.images_folder / f'{index:02d}_depth.png'

    @property
    def has_depth(self) -> bool:
        """Whether there are depth images: all are written where one is."""
        return self.depth_path(0).is_file()

    def depth(self, index: int) -> NDArray[np.float32]:
        """
        Return one depth image, (H, W), in the unit of the cameras, 0 where there is no value.

        Raises DataError where it cannot be read.
        """
        path = self.depth_path(index)
        stored = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
        if stored is None or stored.ndim != 2 or stored.dtype != np.uint16:
            found = ('no whole PNG' if path.is_file() else 'no file') if stored is None else (
                f'the shape {stored.shape} {stored.dtype}')
            raise DataError(f'{path}: no readable depth image: expected a PNG of one channel of '
                            f'16 bits, got {found}; make them by `render` or `dataset build` with '
                            '`--depth`')
        return np.asarray(stored / np.float32(_STEPS), np.float32)

    def voxels(self, resolution: int = RESOLUTION) -> VoxelGrid:
        """Return the true voxels; raises DataError where there are none of this resolution."""
        path = self._voxels_file(resolution)
        grid = read_binvox(path)
        if grid.occupancy.shape != (resolution,) * 3:
            raise DataError(f'{path}: wrong resolution: expected {resolution} cells a side, got '
                            f'{grid.occupancy.shape}')
        return grid

    def grid_side(self, resolution: int = RESOLUTION) -> float:
        """Return the side of the true voxels' grid, from the header of their file."""
        return binvox_side(self._voxels_file(resolution))

    def _voxels_file(self, resolution: int) -> Path:
        """Return the path of the voxels; raises DataError where finer ones are missing."""
        path = self.voxels_path(resolution)
        if resolution != RESOLUTION and not path.is_file():
            raise DataError(f'{path}: no such file: expected voxels of {resolution} cells a side; '
                            'make them by `render` or `dataset build` with `--fine`')
        return path

    @property
    def complete(self) -> bool:
        """Whether the object was written completely: its voxels are written last."""
        return self.voxels_path().is_file()

    def is_copy_of(self, other: 'ObjectFolder') -> bool:
        """
        Return whether it is the same object, in the same folder or rendered into another one.

        Then it has the same name, which makers of shapes give once for a seed, and the same
        voxels, which other shapes of one name have not. An object that was turned
        (`Viewing.turned`) in one folder only has others.
        """
        if (self.category, self.name) != (other.category, other.name):
            return False
        return self.images_folder.resolve() == other.images_folder.resolve() or any(
            mine.is_file() and theirs.is_file() and filecmp.cmp(mine, theirs, shallow=False)
            for mine, theirs in ((self.voxels_path(cells), other.voxels_path(cells))
                                 for cells in (RESOLUTION, FINE_RESOLUTION)))


def list_objects(root: Path) -> list[ObjectFolder]:
    """
    Return the objects of a dataset that have images, sorted by category and name.

    Raises DataError where the folder has no dataset.
    """
    top = root / RENDERING
    if not top.is_dir():
        raise DataError(f"{root}: no dataset in R2N2's layout: it has no folder "
                        f'{RENDERING}; make one with `active-recon render` or `dataset build`')
    return [ObjectFolder(root, folder.parent.name, folder.name)
            for folder in sorted(top.glob('*/*')) if folder.is_dir()]


def needed_objects(root: Path) -> list[ObjectFolder]:
    """Return the objects of a dataset; raises DataError where it has none, or is none."""
    if not (folders := list_objects(root)):
        raise DataError(f'{root}: a dataset without objects: expected one or more, got none')
    return folders


def write_object(folder: ObjectFolder, images: Sequence[NDArray[np.uint8]],
                 cameras: Sequence[Camera], grid: VoxelGrid) -> None:
    """
    Write one object: images (H, W, 4) uint8 RGBA, their cameras, and the true voxels.

    The voxels come last and are renamed into place, so that an interrupted run can continue.
    Raises DataError where an image cannot be written.
    """
    folder.images_folder.mkdir(parents=True, exist_ok=True)
    for left in (*folder.images_folder.glob('*.png'), folder.images_folder / _CAMERAS):
        if left.is_file():  # of a run that was interrupted, perhaps of other cameras
            left.unlink()
    rows, names = [], []
    for index, (image, camera) in enumerate(zip(images, cameras, strict=True)):
        names.append(f'{index:02d}.png')
        path = folder.images_folder / names[-1]
        write_png(path, cv2.cvtColor(image, cv2.COLOR_RGBA2BGRA),
                  [cv2.IMWRITE_PNG_COMPRESSION, 4])
        azimuth_deg = math.degrees(-camera.azimuth) % 360
        rows.append(f'{azimuth_deg:.9g} {math.degrees(camera.elevation):.9g} 0 '
                    f'{camera.distance / _DISTANCE_UNIT:.9g} {_FIELD_OF_VIEW_COLUMN:g}')
    if all(map(is_r2n2, cameras)):
        (folder.images_folder / 'rendering_metadata.txt').write_text('\n'.join(rows) + '\n')
    else:
        _write_cameras(folder.images_folder / _CAMERAS, cameras)
    (folder.images_folder / 'renderings.txt').write_text('\n'.join(names) + '\n')
    write_voxels(folder, grid)


def write_depths(folder: ObjectFolder, depths: Sequence[NDArray[np.float32]]) -> None:
    """
    Write the depth images (H, W) of an object's views, in the unit of its cameras; 0 is no value.

    Values beyond the 65.535 units that 16 bits hold become no value. The first comes last: it
    tells that there are all. Raises DataError where one cannot be written.
    """
    for index, depth in reversed(list(enumerate(depths))):
        path = folder.depth_path(index)
        stored = np.rint(np.where(depth <= _FARTHEST, depth, 0) * _STEPS).astype(np.uint16)
        write_png(path, stored)


def is_r2n2(camera: Camera) -> bool:
    """Return whether a row of the metadata can represent the camera."""
    if camera.intrinsics != CANONICAL_INTRINSICS or abs(camera.elevation) > math.pi / 2 - 1e-6:
        return False
    upright = orbit_camera(camera.azimuth, camera.elevation, camera.distance)
    return bool(np.allclose(upright.pose, camera.pose, rtol=0, atol=1e-6))


def _write_cameras(path: Path, cameras: Sequence[Camera]) -> None:
    path.write_text(json.dumps([{
        'pose': camera.pose.tolist(),
        **{name: getattr(camera.intrinsics, name) for name in _LENS}} for camera in cameras]))


def _read_cameras(path: Path) -> list[Camera]:
    try:
        return [Camera(np.array(row['pose'], np.float64),
                       Intrinsics(float(row['fx']), float(row['fy']), float(row['cx']),
                                  float(row['cy']), int(row['width']), int(row['height'])))
                for row in json_value(path.read_text())]
    except (OSError, ValueError, KeyError, OverflowError, TypeError, ViewError) as error:
        raise DataError(f'{path}: no readable cameras: expected a list, each with pose, '
                        f'{", ".join(_LENS)}, got: {error}') from error


def write_voxels(folder: ObjectFolder, grid: VoxelGrid) -> None:
    """Write the voxels of one object to the path of their resolution, atomically."""
    with whole_file(folder.voxels_path(len(grid.occupancy))) as unfinished:
        write_binvox(grid, unfinished)
