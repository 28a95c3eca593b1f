"""Random sequences of posed views for training: any cameras, and a frame at any yaw."""

from collections.abc import Mapping
from dataclasses import dataclass

from active_recon.datasets.views import ViewSet, with_seen
from active_recon.models.network import Cameras
from active_recon.training.batches import mirror_some
from active_recon.training.posed_augmentation import (
    augment_posed,
    perturb_poses,
    SHARES,
    TABLE_SHARE,
)
import numpy as np
import torch
from torch import Tensor


@dataclass(frozen=True, eq=False)
class PosedBatch:
    """
    B objects and T views of each.

    - images: (T, B, 4, S, S) in [0, 1], RGB and which pixels there are; cameras (T, B, ...)
    - alpha: (T, B, S, S) in [0, 1], the object's share of each pixel
    - voxels: (B, R, R, R) in {0, 1} float32
    - objects: (B,) indices into the set
    - depths: (T, B, S, S) float32, as the set has them; None where it has none
    """

    images: Tensor
    cameras: Cameras
    alpha: Tensor
    voxels: Tensor
    objects: Tensor
    depths: Tensor | None = None


def draw_posed_batch(views: ViewSet, size: int, length: int, rng: np.random.Generator,
                     augment: bool = True, shares: Mapping[str, float] = SHARES,
                     table_share: float = TABLE_SHARE) -> PosedBatch:
    """
    Draw objects with different random views of each, turned by quarters and mirrored at random.

    There are `length` views of each, or all that an object has, if these are fewer. With `augment`
    the images get backgrounds, of kinds in these shares, light and noise, some objects a table,
    and the poses small errors.
    """
    length = min(length, views.images.shape[1])
    objects = torch.from_numpy(rng.integers(len(views), size=size))
    order = rng.random((size, views.images.shape[1])).argsort(axis=1)
    chosen = torch.from_numpy(order[:, :length].T.copy())  # (T, B)
    mirrored = torch.from_numpy(rng.random(size) < 0.5)
    quarters = rng.integers(4, size=size)
    images = views.images[objects, chosen]
    seen = (torch.ones(images.shape[:-1], dtype=torch.bool) if views.seen is None
            else views.seen[objects, chosen])
    images[:, mirrored] = images[:, mirrored].flip(-2)
    seen[:, mirrored] = seen[:, mirrored].flip(-1)
    depths = None if views.depths is None else views.depths[objects, chosen]
    if depths is not None:
        depths[:, mirrored] = depths[:, mirrored].flip(-1)
    cameras = mirror_some(views.cameras(objects, chosen), mirrored, images.shape[2])
    cameras = cameras.turned(torch.from_numpy(quarters * np.pi / 2).expand(length, size))
    voxels = views.voxels[objects].float()
    voxels[mirrored] = voxels[mirrored].flip(2)
    for row, quarter in enumerate(quarters):
        voxels[row] = turned_by_quarters(voxels[row], int(quarter))
    alpha = images[..., 3].float() / 255
    if augment:
        return PosedBatch(augment_posed(images, seen, cameras, voxels, views, rng, shares,
                                        table_share),
                          perturb_poses(cameras, rng), alpha,
                          voxels, objects, depths)
    planes = images.permute(0, 1, 4, 2, 3).float() / 255
    return PosedBatch(with_seen(planes[:, :, :3] + 1 - planes[:, :, 3:], seen), cameras, alpha,
                      voxels, objects, depths)


def turned_by_quarters(voxels: Tensor, quarters: int) -> Tensor:
    """Return voxels (X, Y, Z) turned counter-clockwise about +z by quarters of a turn."""
    return torch.rot90(voxels, quarters, (0, 1))
