"""A dataset in memory, at a network's image size and resolution, for training and evaluation."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property
import hashlib
from typing import Any

from active_recon.datasets.cropped import weighted
from active_recon.datasets.framed import FramedViews, OnDemand, read_cameras
from active_recon.datasets.layout import is_r2n2, ObjectFolder
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

    - images: (N, V, S, S, 4) uint8, RGBA, premultiplied by alpha
    - poses: (N, V, 4, 4) float64, object from optical frame; lengths in sides of the grid
    - intrinsics: (N, V, 3, 3) float64, K in pixels of these images
    - voxels: (N, R, R, R) bool
    - folders: the source of each object; unreadable: errors of the objects left out
    - seen: (N, V, S, S) bool, the pixels that lie in the cameras' original images; None: all
    - depths: (N, V, S, S) float32, along the optical axis in sides of the grid, 0 where there is
      no value; None: not read
    """

    images: Tensor
    poses: Tensor
    intrinsics: Tensor
    voxels: Tensor
    folders: tuple[ObjectFolder, ...]
    unreadable: tuple[str, ...] = ()
    seen: Tensor | None = None
    depths: Tensor | None = None

    def __len__(self) -> int:
        """Return the number of objects."""
        return len(self.voxels)

    @property
    def image_size(self) -> int:
        """S, the side of the images in pixels."""
        return self.images.shape[2]

    @property
    def resolution(self) -> int:
        """R, cells a side of the voxels."""
        return self.voxels.shape[-1]

    @cached_property
    def azimuths(self) -> Tensor:
        """Azimuths of the cameras, (N, V) float32, radians in [0, 2 pi)."""
        return Cameras(self.poses, self.intrinsics).azimuths

    @property
    def fingerprint(self) -> str:
        """SHA-256 of which objects there are, in their order, and of their cameras."""
        digest = hashlib.sha256()
        for folder in self.folders:
            digest.update(f'{folder.full_name}\n'.encode())
        for cameras in (self.poses, self.intrinsics):
            digest.update(cameras.contiguous().numpy().tobytes())
        return digest.hexdigest()

    def at(self, step: int) -> 'ViewSet':
        """Return what a step of a training draws from: always the same."""
        return self

    def names(self, objects: Tensor) -> tuple[str, ...]:
        """Return the names of objects (B,)."""
        return tuple(self.folders[index].name for index in objects.tolist())

    def cameras(self, objects: Tensor, views: Tensor) -> Cameras:
        """Return the cameras of views (...) of objects (...)."""
        return Cameras(self.poses, self.intrinsics).rows(objects, views)

    @property
    def categories(self) -> NDArray[np.str_]:
        """Category of each object, (N,); ShapeNet's synset ids become names."""
        return np.array([SYNSETS.get(folder.category, folder.category)
                         for folder in self.folders])

    def white(self, objects: Tensor, views: Tensor) -> Tensor:
        """
        Return views (B,) of objects (B,) on white, (B, 3, S, S) float32 in [0, 1].

        With `seen`, that mask is the fourth channel: (B, 4, S, S).
        """
        pictures = on_background(self.images[objects, views], torch.ones(len(objects), 3))
        return pictures if self.seen is None else with_seen(pictures, self.seen[objects, views])


def on_background(images: Tensor, colors: Tensor) -> Tensor:
    """
    Composite premultiplied images (B, S, S, 4) uint8 over colours (B, 3) in [0, 1].

    Returns (B, 3, S, S) float32 in [0, 1].
    """
    planes = images.permute(0, 3, 1, 2).float() / 255
    return planes[:, :3] + (1 - planes[:, 3:]) * colors[:, :, None, None].to(planes.device)


def with_seen(pictures: Tensor, seen: Tensor) -> Tensor:
    """Return images (..., 4, S, S): `pictures` (..., 3, S, S) masked by `seen`, and `seen`."""
    return torch.cat([pictures * seen[..., None, :, :], seen[..., None, :, :].to(pictures)], -3)


def read_views(folders: Sequence[ObjectFolder], progress: Callable[[], None] = lambda: None,
               resolution: int = RESOLUTION, image_size: int = 64,
               framed: bool = False, at_once: bool = True, depth: bool = False) -> ViewSet:
    """
    Read objects, with voxels and images of the sizes that a network declares.

    With `framed`, the images are those of a network that needs no front: from arbitrary cameras,
    cropped to the object's cube, with as many views of each object as every object has. Without
    it, they are the 24 of the turntable; other cameras cannot be read. Objects that cannot be read
    are left out and listed in `unreadable`. Without `at_once`, framed images are read when they
    are first indexed, and raise DataError then. With `depth`, framed views come with their depth
    images, and objects that have none are left out. Raises DataError if no object can be read.
    """
    if framed:
        return _read_framed(folders, progress, resolution, image_size, at_once, depth)
    count = len(folders)
    # Filled in place: stacking a list of arrays would need twice the memory
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


def no_readable(errors: Sequence[str]) -> DataError:
    """Return the error of a dataset without an object that can be read, with some of theirs."""
    return DataError('no readable object: expected at least one in the dataset, got none'
                     + ''.join(f'\n  {error}' for error in errors[:5]))


def _read_all(read: Callable[[int], str], count: int) -> tuple[slice | list[int], tuple[str, ...]]:
    """Read `count` objects; return the indices of those read, and the errors of the others."""
    with ThreadPoolExecutor() as pool:
        errors = list(pool.map(read, range(count)))
    good = [index for index in range(count) if not errors[index]]
    unreadable = tuple(filter(None, errors))
    if not good:
        raise no_readable(unreadable)
    return slice(None) if len(good) == count else good, unreadable


def _read_framed(folders: Sequence[ObjectFolder], progress: Callable[[], None], resolution: int,
                 image_size: int, at_once: bool, depth: bool) -> ViewSet:
    """Read views from arbitrary cameras; see `read_views`."""
    without = [folder for folder in folders if depth and not folder.has_depth]
    folders, shown, sides, lacking = read_cameras(
        [each for each in folders if each not in without], resolution)
    lacking += tuple(f'{folder.depth_path(0)}: no depth images: expected those that `render` or '
                     '`dataset build` makes with `--depth`' for folder in without)
    if not folders:
        raise no_readable(lacking)
    views = FramedViews(folders, shown, sides, resolution, image_size)
    poses, intrinsics = torch.from_numpy(views.poses), torch.from_numpy(views.intrinsics)
    image_shape, seen_shape = views.image_shapes
    if not at_once:
        on_demand: Any = [OnDemand(image_shape, lambda *place: views.image(*place)[0]),
                          OnDemand(views.voxels_shape, views.voxels),
                          OnDemand(seen_shape, lambda *place: views.image(*place)[1]),
                          OnDemand(seen_shape, views.read_depth) if depth else None]
        return ViewSet(on_demand[0], poses, intrinsics, on_demand[1], tuple(folders), lacking,
                       *on_demand[2:])
    images, seen = np.empty(image_shape, np.uint8), np.empty(seen_shape, np.bool_)
    depths = np.empty(seen_shape if depth else (len(folders), 0), np.float32)
    voxels = np.empty(views.voxels_shape, np.bool_)

    def read(index: int) -> str:
        try:
            voxels[index] = views.read_voxels(index)
            for view in range(images.shape[1]):
                images[index, view], seen[index, view] = views.read_image(index, view)
                if depth:
                    depths[index, view] = views.read_depth(index, view)
            return ''
        except DataError as error:
            return str(error)
        finally:
            progress()

    kept, unreadable = _read_all(read, len(folders))
    return ViewSet(torch.from_numpy(images[kept]), poses[kept], intrinsics[kept],
                   torch.from_numpy(voxels[kept]), tuple(np.array(folders, object)[kept]),
                   lacking + unreadable, torch.from_numpy(seen[kept]),
                   torch.from_numpy(depths[kept]) if depth else None)


def _read_object(folder: ObjectFolder, images: NDArray[np.uint8],
                 voxels: NDArray[np.bool_]) -> list[Camera]:
    """Read one object into (V, S, S, 4), (R, R, R); return its cameras, in sides of the grid."""
    cameras = folder.cameras()
    if len(cameras) != len(images):
        raise DataError(f'{folder.images_folder}: wrong number of views: expected {len(images)}, '
                        f'got {len(cameras)}')
    if not all(map(is_r2n2, cameras)):
        raise DataError(f"{folder.images_folder}: cameras of another kind: expected R2N2's lens "
                        "and cameras that look at the object's centre, upright, as `--cameras "
                        'turntable` makes, since the network is not told of others')
    grid = folder.voxels(len(voxels))
    voxels[:] = grid.occupied(0.5)
    size = images.shape[1]
    for index, image in enumerate(images):
        image[:] = _premultiplied(folder.image(index), size)
    return [Camera(camera.scaled(1 / grid.size).pose, camera.intrinsics.resized(size, size))
            for camera in cameras]


def _premultiplied(rgba: NDArray[np.uint8], size: int) -> NDArray[np.uint8]:
    """Return the image resampled to a size, (S, S, 4), premultiplied by alpha."""
    small = cv2.resize(weighted(rgba), (size, size), interpolation=cv2.INTER_AREA)
    return np.asarray(np.rint(small), np.uint8)
