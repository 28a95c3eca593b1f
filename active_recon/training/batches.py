"""Random sequences of views for training, the same for the same seed and step."""

from dataclasses import dataclass

from active_recon.datasets.views import on_background, ViewSet
from active_recon.models.network import Cameras
from active_recon.training import augmentation
import numpy as np
import torch
from torch import Tensor


@dataclass(frozen=True, eq=False)
class Batch:
    """
    B objects and T views of each.

    - images: (T, B, 3, S, S) in [0, 1], and their cameras, (T, B, ...)
    - voxels: (B, R, R, R) in {0, 1} float32, R as in the set
    - objects: (B,) indices into the set
    """

    images: Tensor
    cameras: Cameras
    voxels: Tensor
    objects: Tensor


def draw_batch(views: ViewSet, size: int, length: int, rng: np.random.Generator,
               augment: bool = True) -> Batch:
    """
    Draw objects with different random views of each, augmented unless `augment` is off.

    There are `length` views of each, or all that an object has, if these are fewer. Half of the
    sequences are mirrored in the object's plane y = 0, voxels and cameras with the images.
    Without augmentation the same views of the same objects have a plain white background.
    """
    length = min(length, views.images.shape[1])
    objects = torch.from_numpy(rng.integers(len(views), size=size))
    order = rng.random((size, views.images.shape[1])).argsort(axis=1)
    chosen = torch.from_numpy(order[:, :length].T.copy())  # (T, B)
    mirrored = torch.from_numpy(rng.random(size) < 0.5)
    images = views.images[objects, chosen]
    images[:, mirrored] = images[:, mirrored].flip(-2)
    cameras = mirror_some(views.cameras(objects, chosen), mirrored, images.shape[2])
    if augment:
        pictures, intrinsics = augmentation.augment(images, cameras.intrinsics, views, rng)
        cameras = Cameras(cameras.poses, intrinsics)
    else:
        flat = on_background(images.flatten(0, 1), torch.ones(length * size, 3))
        pictures = flat.reshape(length, size, *flat.shape[1:])
    voxels = views.voxels[objects].float()
    voxels[mirrored] = voxels[mirrored].flip(2)
    return Batch(pictures, cameras, voxels, objects)


def mirror_some(cameras: Cameras, mirrored: Tensor, image_size: int) -> Cameras:
    """Return cameras (T, B, ...), those of some sequences, (B,) bool, mirrored; see `mirror`."""
    return Cameras(*(torch.where(mirrored[:, None, None], other, own) for own, other
                     in zip(cameras, mirror(cameras, image_size), strict=True)))


def mirror(cameras: Cameras, image_size: int) -> Cameras:
    """
    Return the cameras (..., 4, 4) that see the object mirrored in y = 0 as the images mirrored.

    The plane turns the pose's left into its right; flipping the image's columns, of S pixels,
    makes it a rotation again.
    """
    plane = torch.diag(torch.tensor([1.0, -1, 1, 1], dtype=cameras.poses.dtype))
    flip = torch.diag(torch.tensor([-1.0, 1, 1, 1], dtype=cameras.poses.dtype))
    intrinsics = cameras.intrinsics.clone()
    intrinsics[..., 0, 2] = image_size - intrinsics[..., 0, 2]
    return Cameras(plane @ cameras.poses @ flip, intrinsics)
