"""Views from arbitrary cameras, cropped to the object's cube, read from disk on first access."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor

from active_recon.datasets.layout import ObjectFolder
from active_recon.errors import DataError
from active_recon.geometry.cameras import Camera
from active_recon.geometry.canonical import framed_layers, framing_camera
import numpy as np
from numpy.typing import NDArray
import torch
from torch import Tensor


class FramedViews:
    """
    Images, cameras and voxels of N objects with V views each; for the arrays, see `ViewSet`.

    V is the smallest number of views of any object. Raises DataError where the side of an
    object's voxel grid cannot be read.
    """

    def __init__(self, folders: Sequence[ObjectFolder], shown: Sequence[Sequence[Camera]],
                 resolution: int, image_size: int) -> None:
        count, views = len(folders), min(map(len, shown))
        self.folders, self._shown, self._size = folders, shown, image_size
        self.images = np.empty((count, views, image_size, image_size, 4), np.uint8)
        self.seen = np.empty((count, views, image_size, image_size), np.bool_)
        self.voxels = np.empty((count, *(resolution,) * 3), np.bool_)
        self._has_image = np.zeros((count, views), np.bool_)
        self._has_voxels = np.zeros(count, np.bool_)
        self._sides = np.ones(count)
        self.poses = np.empty((count, views, 4, 4))
        self.intrinsics = np.empty((count, views, 3, 3))
        for index in range(count):
            self._sides[index] = side = folders[index].grid_side(resolution)
            for view, camera in enumerate(shown[index][:views]):
                target = framing_camera(camera, side, image_size)
                self.poses[index, view] = target.scaled(1 / side).pose
                self.intrinsics[index, view] = target.intrinsics.matrix

    def read_images(self, index: int, views: Sequence[int]) -> None:
        """Read those views of one object that are not read yet; raises DataError on bad images."""
        for view in views:
            if self._has_image[index, view]:
                continue
            layers = np.asarray(weighted(self.folders[index].image(view)).round(), np.uint8)
            self.images[index, view], self.seen[index, view], _ = framed_layers(
                layers, self._shown[index][view], self._sides[index], self._size)
            self._has_image[index, view] = True

    def read_voxels(self, index: int) -> None:
        """Read the voxels of one object, once; raises DataError where they cannot be read."""
        if not self._has_voxels[index]:
            self.voxels[index] = self.folders[index].voxels(
                self.voxels.shape[-1]).occupied(0.5)
            self._has_voxels[index] = True


class OnDemand:
    """An array of `FramedViews` that is indexed like a tensor; rows are read when indexed."""

    def __init__(self, array: NDArray[np.generic], read: Callable[..., None]) -> None:
        self._array, self._read = array, read

    @property
    def shape(self) -> torch.Size:
        """The array's shape."""
        return torch.Size(self._array.shape)

    def __len__(self) -> int:
        """Return the number of objects."""
        return len(self._array)

    def __getitem__(self, index: Tensor | tuple[Tensor, Tensor]) -> Tensor:
        """Return the rows of objects (...), or of objects (...) and views (...)."""
        places = [torch.as_tensor(place) for place in np.broadcast_arrays(
            *(index if isinstance(index, tuple) else (index,)))]
        rows = torch.stack(places, -1).reshape(-1, len(places)).tolist()
        with ThreadPoolExecutor(2) as pool:
            list(pool.map(lambda row: self._read(row[0], *[row[1:]] * (len(row) > 1)), rows))
        return torch.from_numpy(self._array[tuple(place.numpy() for place in places)])


def read_cameras(folders: Sequence[ObjectFolder]) -> tuple[list[ObjectFolder],
                                                           list[list[Camera]], tuple[str, ...]]:
    """Return the objects whose cameras can be read, their cameras, and errors of the others."""
    good, shown, errors = [], [], []
    for folder in folders:
        try:
            cameras = folder.cameras()
            if not cameras:
                raise DataError(f'{folder.images_folder}: no views: expected one or more, got '
                                'none')
            good.append(folder)
            shown.append(cameras)
        except DataError as error:
            errors.append(str(error))
    return good, shown, tuple(errors)


def weighted(rgba: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Return an RGBA image (H, W, 4), premultiplied by alpha, values in [0, 255]."""
    layers = rgba.astype(np.float32)
    layers[..., :3] *= layers[..., 3:] / 255
    return layers
