"""A dataset in memory, at the network's size: what training and measurement draw from."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

from active_recon.cameras import VIEW_COUNT
from active_recon.datasets.layout import ObjectFolder
from active_recon.errors import DataError
from active_recon.models.encoder import IMAGE_SIZE
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

    - images: (N, V, 64, 64, 4) uint8, RGB multiplied by alpha, and alpha
    - azimuths: (N, V) float32, radians
    - voxels: (N, 32, 32, 32) bool
    - folders: where each came from; unreadable: what was left out, and why
    """

    images: Tensor
    azimuths: Tensor
    voxels: Tensor
    folders: tuple[ObjectFolder, ...]
    unreadable: tuple[str, ...] = ()

    def __len__(self) -> int:
        """Return the number of objects."""
        return len(self.voxels)

    @property
    def categories(self) -> NDArray[np.str_]:
        """Category of each object, (N,)."""
        return np.array([folder.category for folder in self.folders])

    def white(self, objects: Tensor, views: Tensor) -> Tensor:
        """Return views (B,) of objects (B,) on white, (B, 3, 64, 64) float32 in [0, 1]."""
        return on_background(self.images[objects, views], torch.ones(len(objects), 3))


def on_background(images: Tensor, colors: Tensor) -> Tensor:
    """Lay premultiplied images (B, 64, 64, 4) uint8 over colours (B, 3): (B, 3, 64, 64)."""
    planes = images.permute(0, 3, 1, 2).float() / 255
    return planes[:, :3] + (1 - planes[:, 3:]) * colors[:, :, None, None].to(planes.device)


def read_views(folders: Sequence[ObjectFolder],
               progress: Callable[[], None] = lambda: None) -> ViewSet:
    """Read objects; what cannot be read is left out and listed. Raises DataError if none can."""
    def read(folder: ObjectFolder) -> tuple[ObjectFolder, _Object | str]:
        try:
            return folder, _read_object(folder)
        except DataError as error:
            return folder, str(error)
        finally:
            progress()

    with ThreadPoolExecutor() as pool:
        results = list(pool.map(read, folders))
    good = [(folder, found) for folder, found in results if not isinstance(found, str)]
    refusals = tuple(found for _, found in results if isinstance(found, str))
    if not good:
        raise DataError('expected objects in the dataset, none can be read'
                        + ''.join(f'\n  {refusal}' for refusal in refusals[:5]))
    images, azimuths, voxels = zip(*(found for _, found in good), strict=True)
    return ViewSet(torch.from_numpy(np.stack(images)), torch.from_numpy(np.stack(azimuths)),
                   torch.from_numpy(np.stack(voxels)), tuple(folder for folder, _ in good),
                   refusals)


_Object = tuple[NDArray[np.uint8], NDArray[np.float32], NDArray[np.bool_]]


def _read_object(folder: ObjectFolder) -> _Object:
    cameras = folder.cameras()
    if len(cameras) != VIEW_COUNT:
        raise DataError(f'{folder.images_folder}: expected {VIEW_COUNT} views, '
                        f'got {len(cameras)}')
    images = np.stack([_premultiplied(folder.image(index)) for index in range(len(cameras))])
    voxels = folder.voxels().occupied(0.5)
    if voxels.shape != (RESOLUTION,) * 3:
        raise DataError(f'{folder.voxels_path}: expected {RESOLUTION} cells a side, '
                        f'got {voxels.shape}')
    return images, np.array([camera.azimuth for camera in cameras], np.float32), voxels


def _premultiplied(rgba: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the image at the network's size, (64, 64, 4), its colours multiplied by alpha."""
    weighted = rgba.astype(np.float32)
    weighted[..., :3] *= weighted[..., 3:] / 255
    small = cv2.resize(weighted, (IMAGE_SIZE, IMAGE_SIZE), interpolation=cv2.INTER_AREA)
    return np.asarray(np.rint(small), np.uint8)
