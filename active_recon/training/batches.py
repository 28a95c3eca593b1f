"""Random sequences of views for training, the same for the same seed and step."""

from dataclasses import dataclass

from active_recon.datasets.views import on_background, ViewSet
import numpy as np
import torch
from torch import Tensor


@dataclass(frozen=True, eq=False)
class Batch:
    """
    B objects and T views of each.

    - images: (T, B, 3, 64, 64) in [0, 1]
    - azimuths: (T, B) radians
    - voxels: (B, 32, 32, 32) in {0, 1} float32
    - objects: (B,) indices into the set
    """

    images: Tensor
    azimuths: Tensor
    voxels: Tensor
    objects: Tensor


def draw_batch(views: ViewSet, size: int, length: int, rng: np.random.Generator) -> Batch:
    """
    Draw objects with different random views of each, varied as a camera would vary them.

    Half of the sequences stand on white, half on a plain random colour; light and colour change
    by up to a fifth; half are mirrored in the object's plane y = 0, voxels and azimuths with the
    images.
    """
    objects = torch.from_numpy(rng.integers(len(views), size=size))
    order = rng.random((size, views.images.shape[1])).argsort(axis=1)
    chosen = torch.from_numpy(order[:, :length].T.copy())  # (T, B)
    colors = np.where(rng.random((size, 1)) < 0.5, 1.0, rng.random((size, 3)))
    gains = rng.uniform(0.8, 1.2, (size, 3))
    mirrored = torch.from_numpy(rng.random(size) < 0.5)
    background = torch.from_numpy(colors.astype(np.float32))
    gain = torch.from_numpy(gains.astype(np.float32))[:, :, None, None]
    images = torch.stack([
        (on_background(views.images[objects, view], background) * gain).clamp(0, 1)
        for view in chosen])
    azimuths = torch.stack([views.azimuths[objects, view] for view in chosen])
    voxels = views.voxels[objects].float()
    return Batch(torch.where(mirrored[:, None, None, None], images.flip(-1), images),
                 torch.where(mirrored, -azimuths, azimuths),
                 torch.where(mirrored[:, None, None, None], voxels.flip(2), voxels), objects)
