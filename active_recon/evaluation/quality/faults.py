"""Views with a fault that a robot may have: noise, wrong poses, a wrong size, broken masks."""

from collections.abc import Callable, Mapping
from dataclasses import replace
import math

from active_recon.datasets.cropped import weighted
from active_recon.datasets.layout import ObjectFolder
from active_recon.datasets.views import ViewSet
from active_recon.evaluation.posed.robustness import poses_off
from active_recon.geometry.canonical import framed_layers
import cv2
import numpy as np
from numpy.typing import NDArray
import torch

POSE_ERROR = math.radians(20)
SIZE_FACTOR = 1.5
CUT = (0.3, 0.5)  # share of the object that a broken mask leaves out
ADDED = (0.3, 0.5)  # side of a rectangle of background that a broken mask keeps, in image sides
_BLOTCHES = 8


def noise(views: ViewSet, seed: int) -> ViewSet:
    """Return views of nothing but noise: of single pixels for even objects, else of blotches."""
    rng = np.random.default_rng([seed, 10])
    images = np.empty(tuple(views.images.shape), np.uint8)
    size = views.image_size
    for row in range(len(images)):
        for view in range(images.shape[1]):
            side = size if row % 2 == 0 else _BLOTCHES
            drawn = rng.integers(256, size=(side, side, 3), dtype=np.uint8)
            images[row, view, ..., :3] = cv2.resize(drawn, (size, size))
    images[..., 3] = 255
    return replace(views, images=torch.from_numpy(images))


def wrong_poses(views: ViewSet, seed: int) -> ViewSet:
    """Return views whose poses are each turned by 20 degrees about the object's centre."""
    return replace(views, poses=poses_off(views, POSE_ERROR, seed))


def wrong_size(views: ViewSet, seed: int) -> ViewSet:
    """
    Return views framed for a cube 1.5 times too large for even objects, else too small.

    The voxels stay those of the true cube.
    """
    images, seen, poses, lenses = (np.empty(tuple(shape), kind) for shape, kind in (
        (views.images.shape, np.uint8), (views.images.shape[:4], np.bool_),
        (views.poses.shape, np.float64), (views.intrinsics.shape, np.float64)))
    for row, folder in enumerate(views.folders):
        factor = SIZE_FACTOR if row % 2 == 0 else 1 / SIZE_FACTOR
        side = folder.grid_side(views.resolution) * factor
        for view, camera in enumerate(folder.cameras()[:images.shape[1]]):
            layers = np.asarray(weighted(folder.image(view)).round(), np.uint8)
            images[row, view], seen[row, view], target = framed_layers(
                layers, camera, side, views.image_size)
            poses[row, view] = target.scaled(1 / side).pose
            lenses[row, view] = target.intrinsics.matrix
    return replace(views, images=torch.from_numpy(images), seen=torch.from_numpy(seen),
                   poses=torch.from_numpy(poses), intrinsics=torch.from_numpy(lenses))


def broken_masks(views: ViewSet, seed: int) -> ViewSet:
    """
    Return views whose masks leave out 30 to 50 % of the object at one side, for even objects.

    Those of the others keep a rectangle of background. Each view is broken in its own way.
    """
    rng = np.random.default_rng([seed, 11])
    images = views.images.numpy().copy()
    for row in range(len(images)):
        for view in range(images.shape[1]):
            (_cut_off if row % 2 == 0 else _left_in)(images[row, view], rng)
    return replace(views, images=torch.from_numpy(images))


def _cut_off(image: NDArray[np.uint8], rng: np.random.Generator) -> None:
    """Erase a share of an object's pixels, (S, S, 4), on one side of a line."""
    where = np.argwhere(image[..., 3] > 127)
    angle, share = rng.uniform(0, 2 * math.pi), rng.uniform(*CUT)
    if len(where):
        along = where @ [math.sin(angle), math.cos(angle)]
        down, across = where[along < np.quantile(along, share)].T
        image[down, across] = 0


def _left_in(image: NDArray[np.uint8], rng: np.random.Generator) -> None:
    """Paint a rectangle of one colour behind the object of an image, (S, S, 4)."""
    size = len(image)
    height, width = (int(size * rng.uniform(*ADDED)) for _ in range(2))
    top, left = int(rng.integers(size - height)), int(rng.integers(size - width))
    part = image[top:top + height, left:left + width]
    colour = rng.integers(40, 216, size=3)
    part[..., :3] += (colour * (1 - part[..., 3:] / 255)).astype(np.uint8)
    part[..., 3] = 255


FAULTS: Mapping[str, Callable[[ViewSet, int], ViewSet]] = {
    'unknown': noise, 'pose': wrong_poses, 'object_size': wrong_size, 'mask': broken_masks}
"""What spoils views, by the suspect that is to be named; each takes a seed."""


def sources_of(folders: tuple[ObjectFolder, ...]) -> list[str]:
    """Return where each object is from: its name up to `__`, its category without one."""
    return [folder.name.partition('__')[0] if '__' in folder.name else folder.category
            for folder in folders]
