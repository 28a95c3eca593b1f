"""A dataset in memory, at the network's size: what training and measurement draw from."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property

from active_recon.cameras import Camera, VIEW_COUNT
from active_recon.datasets.layout import ObjectFolder
from active_recon.datasets.splits import SYNSETS
from active_recon.errors import DataError
from active_recon.models.network import Cameras
from active_recon.voxels import RESOLUTION
import cv2
import numpy as np
from numpy.typing import NDArray
import torch
from torch import Tensor


@dataclass(frozen=True, eq=False)
class ViewSet:
    """
    N objects with V views each.

    - images: (N, V, S, S, 4) uint8, RGB multiplied by alpha, and alpha
    - poses: (N, V, 4, 4) float64, object from optical frame; lengths count in sides of the grid
    - intrinsics: (N, V, 3, 3) float64, K in pixels of these images
    - voxels: (N, R, R, R) bool
    - folders: where each came from; unreadable: what was left out, and why
    """

    images: Tensor
    poses: Tensor
    intrinsics: Tensor
    voxels: Tensor
    folders: tuple[ObjectFolder, ...]
    unreadable: tuple[str, ...] = ()

    def __len__(self) -> int:
        """Return the number of objects."""
        return len(self.voxels)

    @property
    def image_size(self) -> int:
        """S, pixels a side of the images."""
        return self.images.shape[2]

    @property
    def resolution(self) -> int:
        """R, cells a side of the voxels."""
        return self.voxels.shape[-1]

    @cached_property
    def azimuths(self) -> Tensor:
        """Azimuths of the cameras, (N, V) float32, radians in [0, 2 pi)."""
        return Cameras(self.poses, self.intrinsics).azimuths

    def cameras(self, objects: Tensor, views: Tensor) -> Cameras:
        """Return the cameras of views (...) of objects (...)."""
        return Cameras(self.poses, self.intrinsics).rows(objects, views)

    @property
    def categories(self) -> NDArray[np.str_]:
        """Category of each object, (N,); a synset's id of ShapeNet becomes its name."""
        return np.array([SYNSETS.get(folder.category, folder.category)
                         for folder in self.folders])

    def white(self, objects: Tensor, views: Tensor) -> Tensor:
        """Return views (B,) of objects (B,) on white, (B, 3, S, S) float32 in [0, 1]."""
        return on_background(self.images[objects, views], torch.ones(len(objects), 3))


def on_background(images: Tensor, colors: Tensor) -> Tensor:
    """Lay premultiplied images (B, S, S, 4) uint8 over colours (B, 3): (B, 3, S, S)."""
    planes = images.permute(0, 3, 1, 2).float() / 255
    return planes[:, :3] + (1 - planes[:, 3:]) * colors[:, :, None, None].to(planes.device)


def read_views(folders: Sequence[ObjectFolder], progress: Callable[[], None] = lambda: None,
               resolution: int = RESOLUTION, image_size: int = 64) -> ViewSet:
    """
    Read objects, with voxels and images of the sizes that a network asks for.

    What cannot be read is left out and listed. Raises DataError if none can.
    """
    count = len(folders)
    # Filled in place: gathered and then stacked, a large set would take its memory twice
    images = np.empty((count, VIEW_COUNT, image_size, image_size, 4), np.uint8)
    poses = np.empty((count, VIEW_COUNT, 4, 4))
    intrinsics = np.empty((count, VIEW_COUNT, 3, 3))
    voxels = np.empty((count, *(resolution,) * 3), np.bool_)

    def read(index: int) -> str:
        try:
            cameras = _read_object(folders[index], images[index], voxels[index])
            poses[index] = [camera.pose for camera in cameras]
            intrinsics[index] = [camera.intrinsics.matrix for camera in cameras]
            return ''
        except DataError as error:
            return str(error)
        finally:
            progress()

    with ThreadPoolExecutor() as pool:
        refusals = list(pool.map(read, range(count)))
    good = [index for index in range(count) if not refusals[index]]
    unreadable = tuple(filter(None, refusals))
    if not good:
        raise DataError('expected objects in the dataset, none can be read'
                        + ''.join(f'\n  {refusal}' for refusal in unreadable[:5]))
    kept = slice(None) if len(good) == count else good
    return ViewSet(torch.from_numpy(images[kept]), torch.from_numpy(poses[kept]),
                   torch.from_numpy(intrinsics[kept]), torch.from_numpy(voxels[kept]),
                   tuple(folders[index] for index in good), unreadable)


def _read_object(folder: ObjectFolder, images: NDArray[np.uint8],
                 voxels: NDArray[np.bool_]) -> list[Camera]:
    """Read one object into (V, S, S, 4) and (R, R, R); return its cameras, the grid's side 1."""
    cameras = folder.cameras()
    if len(cameras) != len(images):
        raise DataError(f'{folder.images_folder}: expected {len(images)} views, '
                        f'got {len(cameras)}')
    grid = folder.voxels(len(voxels))
    voxels[:] = grid.occupied(0.5)
    size = images.shape[1]
    for index, image in enumerate(images):
        image[:] = _premultiplied(folder.image(index), size)
    return [Camera(camera.scaled(1 / grid.size).pose, camera.intrinsics.resized(size, size))
            for camera in cameras]


def _premultiplied(rgba: NDArray[np.uint8], size: int) -> NDArray[np.uint8]:
    """Return the image in pixels of a size, (S, S, 4), its colours multiplied by alpha."""
    weighted = rgba.astype(np.float32)
    weighted[..., :3] *= weighted[..., 3:] / 255
    small = cv2.resize(weighted, (size, size), interpolation=cv2.INTER_AREA)
    return np.asarray(np.rint(small), np.uint8)
