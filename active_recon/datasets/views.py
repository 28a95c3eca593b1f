"""A dataset in memory, at the network's size: what training and measurement draw from."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

from active_recon.cameras import VIEW_COUNT
from active_recon.datasets.layout import ObjectFolder
from active_recon.datasets.splits import SYNSETS
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
    - voxels: (N, R, R, R) bool, R 32 or 64
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
        """Category of each object, (N,); a synset's id of ShapeNet becomes its name."""
        return np.array([SYNSETS.get(folder.category, folder.category)
                         for folder in self.folders])

    def white(self, objects: Tensor, views: Tensor) -> Tensor:
        """Return views (B,) of objects (B,) on white, (B, 3, 64, 64) float32 in [0, 1]."""
        return on_background(self.images[objects, views], torch.ones(len(objects), 3))


def on_background(images: Tensor, colors: Tensor) -> Tensor:
    """Lay premultiplied images (B, 64, 64, 4) uint8 over colours (B, 3): (B, 3, 64, 64)."""
    planes = images.permute(0, 3, 1, 2).float() / 255
    return planes[:, :3] + (1 - planes[:, 3:]) * colors[:, :, None, None].to(planes.device)


def read_views(folders: Sequence[ObjectFolder], progress: Callable[[], None] = lambda: None,
               resolution: int = RESOLUTION) -> ViewSet:
    """
    Read objects, with voxels of 32 or 64 cells a side.

    What cannot be read is left out and listed. Raises DataError if none can.
    """
    count = len(folders)
    # Filled in place: gathered and then stacked, a large set would take its memory twice
    images = np.empty((count, VIEW_COUNT, IMAGE_SIZE, IMAGE_SIZE, 4), np.uint8)
    azimuths = np.empty((count, VIEW_COUNT), np.float32)
    voxels = np.empty((count, *(resolution,) * 3), np.bool_)

    def read(index: int) -> str:
        try:
            _read_object(folders[index], images[index], azimuths[index], voxels[index])
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
    return ViewSet(torch.from_numpy(images[kept]), torch.from_numpy(azimuths[kept]),
                   torch.from_numpy(voxels[kept]), tuple(folders[index] for index in good),
                   unreadable)


def _read_object(folder: ObjectFolder, images: NDArray[np.uint8],
                 azimuths: NDArray[np.float32], voxels: NDArray[np.bool_]) -> None:
    """Read one object into (V, 64, 64, 4), (V,) and (R, R, R)."""
    cameras = folder.cameras()
    if len(cameras) != len(images):
        raise DataError(f'{folder.images_folder}: expected {len(images)} views, '
                        f'got {len(cameras)}')
    voxels[:] = folder.voxels(len(voxels)).occupied(0.5)
    azimuths[:] = [camera.azimuth for camera in cameras]
    for index, image in enumerate(images):
        image[:] = _premultiplied(folder.image(index))


def _premultiplied(rgba: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the image at the network's size, (64, 64, 4), its colours multiplied by alpha."""
    weighted = rgba.astype(np.float32)
    weighted[..., :3] *= weighted[..., 3:] / 255
    small = cv2.resize(weighted, (IMAGE_SIZE, IMAGE_SIZE), interpolation=cv2.INTER_AREA)
    return np.asarray(np.rint(small), np.uint8)
