"""A dataset in memory, at the network's size: what training and measurement draw from."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from active_recon.datasets.framed import FramedViews, OnDemand, read_cameras, weighted
from active_recon.datasets.layout import ObjectFolder
from active_recon.datasets.splits import SYNSETS
from active_recon.errors import DataError
from active_recon.geometry.cameras import Camera, VIEW_COUNT
from active_recon.models.network import Cameras
from active_recon.volumes.voxels import RESOLUTION
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
    - seen: (N, V, S, S) bool, which pixels the cameras' own images have; None: all of them
    """

    images: Tensor
    poses: Tensor
    intrinsics: Tensor
    voxels: Tensor
    folders: tuple[ObjectFolder, ...]
    unreadable: tuple[str, ...] = ()
    seen: Tensor | None = None

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
        """
        Return views (B,) of objects (B,) on white, (B, 3, S, S) float32 in [0, 1].

        Where not all pixels were seen, which were is a fourth channel.
        """
        pictures = on_background(self.images[objects, views], torch.ones(len(objects), 3))
        return pictures if self.seen is None else with_seen(pictures, self.seen[objects, views])


def on_background(images: Tensor, colors: Tensor) -> Tensor:
    """Lay premultiplied images (B, S, S, 4) uint8 over colours (B, 3): (B, 3, S, S)."""
    planes = images.permute(0, 3, 1, 2).float() / 255
    return planes[:, :3] + (1 - planes[:, 3:]) * colors[:, :, None, None].to(planes.device)


def with_seen(pictures: Tensor, seen: Tensor) -> Tensor:
    """Return pictures (..., 3, S, S) with which pixels were seen as a fourth channel."""
    return torch.cat([pictures * seen[..., None, :, :], seen[..., None, :, :].to(pictures)], -3)


def read_views(folders: Sequence[ObjectFolder], progress: Callable[[], None] = lambda: None,
               resolution: int = RESOLUTION, image_size: int = 64,
               framed: bool = False, at_once: bool = True) -> ViewSet:
    """
    Read objects, with voxels and images of the sizes that a network asks for.

    `framed`, the images are what a network gets that needs no front: any camera's, around the
    object's cube, as many of each object as there are of all; else they are the turntable's 24.
    What cannot be read is left out and listed. Raises DataError if none can. Framed images that
    are not read `at_once` are read when a batch first shows them; then those that cannot be read
    raise DataError.
    """
    if framed:
        return _read_framed(folders, progress, resolution, image_size, at_once)
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

    kept, unreadable = _read_all(read, count)
    return ViewSet(torch.from_numpy(images[kept]), torch.from_numpy(poses[kept]),
                   torch.from_numpy(intrinsics[kept]), torch.from_numpy(voxels[kept]),
                   tuple(np.array(folders, object)[kept]), unreadable)


def _read_all(read: Callable[[int], str], count: int) -> tuple[slice | list[int], tuple[str, ...]]:
    """Read so many objects; return which could be, and what was said of the others."""
    with ThreadPoolExecutor() as pool:
        refusals = list(pool.map(read, range(count)))
    good = [index for index in range(count) if not refusals[index]]
    unreadable = tuple(filter(None, refusals))
    if not good:
        raise DataError('expected objects in the dataset, none can be read'
                        + ''.join(f'\n  {refusal}' for refusal in unreadable[:5]))
    return slice(None) if len(good) == count else good, unreadable


def _read_framed(folders: Sequence[ObjectFolder], progress: Callable[[], None], resolution: int,
                 image_size: int, at_once: bool) -> ViewSet:
    """Read what any cameras saw; see `read_views`."""
    folders, shown, lacking = read_cameras(folders)
    if not folders:
        raise DataError('expected objects in the dataset, none can be read'
                        + ''.join(f'\n  {refusal}' for refusal in lacking[:5]))
    views = FramedViews(folders, shown, resolution, image_size)
    poses, intrinsics = torch.from_numpy(views.poses), torch.from_numpy(views.intrinsics)
    if not at_once:
        on_demand: Any = [OnDemand(views.images, views.read_images),
                          OnDemand(views.voxels, views.read_voxels),
                          OnDemand(views.seen, views.read_images)]
        return ViewSet(on_demand[0], poses, intrinsics, on_demand[1], tuple(folders), lacking,
                       on_demand[2])

    def read(index: int) -> str:
        try:
            views.read_voxels(index)
            views.read_images(index, range(views.images.shape[1]))
            return ''
        except DataError as error:
            return str(error)
        finally:
            progress()

    kept, unreadable = _read_all(read, len(folders))
    return ViewSet(torch.from_numpy(views.images[kept]), poses[kept], intrinsics[kept],
                   torch.from_numpy(views.voxels[kept]), tuple(np.array(folders, object)[kept]),
                   lacking + unreadable, torch.from_numpy(views.seen[kept]))


def _read_object(folder: ObjectFolder, images: NDArray[np.uint8],
                 voxels: NDArray[np.bool_]) -> list[Camera]:
    """Read one object into (V, S, S, 4) and (R, R, R); return its cameras, the grid's side 1."""
    cameras = folder.cameras()
    if len(cameras) != len(images):
        raise DataError(f'{folder.images_folder}: wrong number of views: expected {len(images)}, '
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
    small = cv2.resize(weighted(rgba), (size, size), interpolation=cv2.INTER_AREA)
    return np.asarray(np.rint(small), np.uint8)
