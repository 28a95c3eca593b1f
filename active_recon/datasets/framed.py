"""Views from arbitrary cameras, cropped to the object's cube, read from disk on first access."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache
from pathlib import Path

from active_recon.datasets.cropped import cropped, cropped_camera
from active_recon.datasets.layout import ObjectFolder
from active_recon.errors import DataError
from active_recon.geometry.cameras import Camera
from active_recon.geometry.canonical import framing_camera
from active_recon.geometry.resampling import depth_seen_by
import numpy as np
from numpy.typing import NDArray
import torch
from torch import Tensor

_KEPT_IMAGES, _KEPT_VOXELS = 4 << 30, 1 << 30
"""Bytes of images and of voxels that are kept in memory; others are read again."""


class FramedViews:
    """
    Reads images, cameras and voxels of N objects with V views each; for the arrays, see `ViewSet`.

    V is the smallest number of views of any object; of an object with more, every second or so is
    taken, so that turntables are still seen all around. What was read is kept, up to some
    gigabytes, the least recently used of it being dropped first.
    """

    def __init__(self, folders: Sequence[ObjectFolder], shown: Sequence[Sequence[Camera]],
                 sides: Sequence[float], resolution: int, image_size: int) -> None:
        count, views = len(folders), min(map(len, shown))
        self.folders, self._size = folders, image_size
        self._numbers = [[view * len(cameras) // views for view in range(views)]
                         for cameras in shown]
        self._shown = [[cameras[number] for number in numbers]
                       for cameras, numbers in zip(shown, self._numbers, strict=True)]
        self._resolution = resolution
        self._sides = sides
        self.poses = np.empty((count, views, 4, 4))
        self.intrinsics = np.empty((count, views, 3, 3))
        for index in range(count):
            for view, camera in enumerate(self._shown[index]):
                target = cropped_camera(camera, sides[index], image_size)
                self.poses[index, view] = target.pose
                self.intrinsics[index, view] = target.intrinsics.matrix
        self.image_shapes = ((count, views, image_size, image_size, 4),
                             (count, views, image_size, image_size))
        self.voxels_shape = (count, resolution, resolution, resolution)
        self.image = lru_cache(_KEPT_IMAGES // (5 * image_size ** 2))(self.read_image)
        self.voxels = lru_cache(_KEPT_VOXELS // resolution ** 3)(self.read_voxels)

    def read_image(self, index: int, view: int) -> tuple[NDArray[np.uint8], NDArray[np.bool_]]:
        """Read an image, (S, S, 4), and its mask `seen`, (S, S); raises DataError on bad ones."""
        number, camera = self._numbers[index][view], self._shown[index][view]
        image = self.folders[index].image(number)
        _require_size(image, camera, self.folders[index].images_folder / f'{number:02d}.png')
        return cropped(image, camera, self._sides[index], self._size)

    def read_depth(self, index: int, view: int) -> NDArray[np.float32]:
        """Read a depth image, (S, S), in sides of the grid; raises DataError on bad ones."""
        number, camera = self._numbers[index][view], self._shown[index][view]
        depth = self.folders[index].depth(number)
        _require_size(depth, camera, self.folders[index].depth_path(number))
        side = self._sides[index]
        target = framing_camera(camera, side, self._size)
        return np.asarray(depth_seen_by(target, depth, camera) / side, np.float32)

    def read_voxels(self, index: int) -> NDArray[np.bool_]:
        """Read the voxels of one object, (R, R, R); raises DataError where they are unreadable."""
        return self.folders[index].voxels(self._resolution).occupied(0.5)


def _require_size(image: NDArray[np.generic], camera: Camera, path: Path) -> None:
    height, width = image.shape[:2]
    if (height, width) != (camera.intrinsics.height, camera.intrinsics.width):
        raise DataError(f'{path}: wrong size: expected {camera.intrinsics.height} x '
                        f'{camera.intrinsics.width} pixels, as its camera says, got {height} x '
                        f'{width}')


class OnDemand:
    """
    Rows of a tensor that are read when indexed.

    `read` returns the row of an object, or of an object and a view, as an array.
    """

    def __init__(self, shape: Sequence[int], read: Callable[..., NDArray[np.generic]]) -> None:
        self.shape, self._read = torch.Size(shape), read

    def __len__(self) -> int:
        """Return the number of objects."""
        return self.shape[0]

    def __getitem__(self, index: Tensor | tuple[Tensor, Tensor]) -> Tensor:
        """Return the rows of objects (...), or of objects (...) and views (...)."""
        places = [torch.as_tensor(place) for place in np.broadcast_arrays(
            *(index if isinstance(index, tuple) else (index,)))]
        rows = torch.stack(places, -1).reshape(-1, len(places)).tolist()
        with ThreadPoolExecutor(2) as pool:
            found = np.stack(list(pool.map(lambda row: self._read(*row), rows)))
        return torch.from_numpy(found.reshape(*places[0].shape, *found.shape[1:]))


def read_cameras(folders: Sequence[ObjectFolder], resolution: int) -> tuple[
        list[ObjectFolder], list[list[Camera]], list[float], tuple[str, ...]]:
    """
    Return the objects whose cameras can be read, these, their grids' sides, and others' errors.

    Those without voxels of this resolution, as of a run that was interrupted, are of the others.
    """
    good, shown, sides, errors = [], [], [], []
    for folder in folders:
        try:
            cameras = folder.cameras()
            if not cameras:
                raise DataError(f'{folder.images_folder}: no views: expected one or more, got '
                                'none')
            sides.append(folder.grid_side(resolution))
            good.append(folder)
            shown.append(cameras)
        except DataError as error:
            errors.append(str(error))
    return good, shown, sides, tuple(errors)
