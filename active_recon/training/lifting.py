"""Training of networks that lift: any cameras, any yaw, and the silhouettes beside the voxels."""

from collections.abc import Callable
from dataclasses import dataclass

from active_recon.config import LossConfig
from active_recon.datasets.views import ViewSet, with_seen
from active_recon.models.lifting import Lifting
from active_recon.models.network import Cameras, ReconstructionNetwork
from active_recon.training.batches import mirror_some
from active_recon.training.loop import (
    Draw,
    Measured,
    Run,
    share_of_batch,
    train_steps,
    TrainingConfig,
)
from active_recon.training.losses import volume_loss
from active_recon.training.posed_augmentation import augment_posed, perturb_poses
from active_recon.training.supervised import drawn_length
import numpy as np
import torch
from torch import nn, Tensor
from torch.nn import functional

FOREGROUND_WEIGHT, COARSE_WEIGHT = 0.5, 0.3
"""Weights of the silhouettes' loss and of the coarse logits' loss, beside the volume's."""


@dataclass(frozen=True, eq=False)
class PosedBatch:
    """
    B objects and T views of each.

    - images: (T, B, 4, S, S) in [0, 1], RGB and which pixels there are; cameras (T, B, ...)
    - alpha: (T, B, S, S) in [0, 1], the object's share of each pixel
    - voxels: (B, R, R, R) in {0, 1} float32
    - objects: (B,) indices into the set
    """

    images: Tensor
    cameras: Cameras
    alpha: Tensor
    voxels: Tensor
    objects: Tensor


def draw_posed_batch(views: ViewSet, size: int, length: int, rng: np.random.Generator,
                     augment: bool = True) -> PosedBatch:
    """
    Draw objects with different random views of each, turned by quarters and mirrored at random.

    With `augment` the images get backgrounds, light and noise, and the poses small errors.
    """
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
    cameras = mirror_some(views.cameras(objects, chosen), mirrored, images.shape[2])
    cameras = cameras.turned(torch.from_numpy(quarters * np.pi / 2).expand(length, size))
    voxels = views.voxels[objects].float()
    voxels[mirrored] = voxels[mirrored].flip(2)
    for row, quarter in enumerate(quarters):
        voxels[row] = turned_by_quarters(voxels[row], int(quarter))
    alpha = images[..., 3].float() / 255
    if augment:
        return PosedBatch(augment_posed(images, seen, cameras, voxels, views, rng),
                          perturb_poses(cameras, rng), alpha,
                          voxels, objects)
    planes = images.permute(0, 1, 4, 2, 3).float() / 255
    return PosedBatch(with_seen(planes[:, :, :3] + 1 - planes[:, :, 3:], seen), cameras, alpha,
                      voxels, objects)


def turned_by_quarters(voxels: Tensor, quarters: int) -> Tensor:
    """Return voxels (X, Y, Z) turned counter-clockwise about +z by quarters of a turn."""
    return torch.rot90(voxels, quarters, (0, 1))


class LiftingLearner(nn.Module):
    """A sequence of views to the losses after the last of them."""

    def __init__(self, network: Lifting, loss: LossConfig) -> None:
        super().__init__()
        self.network = network
        self._kind = loss.volume_loss

    def forward(self, images: Tensor, cameras: Cameras, alpha: Tensor,
                voxels: Tensor) -> dict[str, Tensor]:
        """Return the losses of images (T, B, 4, S, S) of cameras (T, B, ...); see `PosedBatch`."""
        maps = self.network.maps(images.flatten(0, 1))
        state = self.network.update_from_maps(
            maps, Cameras(cameras.poses.flatten(0, 1), cameras.intrinsics.flatten(0, 1)),
            self.network.initial_state(len(voxels)))
        logits, coarse_logits = self.network.logits(state)
        with torch.autocast(logits.device.type, enabled=False):
            volume = volume_loss(logits.float(), voxels, self._kind)
            coarse = volume_loss(coarse_logits.float(),
                                 functional.max_pool3d(voxels[:, None], 2)[:, 0], self._kind)
            silhouette = self._silhouette_loss(maps.foreground.float(), alpha.flatten(0, 1),
                                               images[:, :, 3].flatten(0, 1))
        total = volume + COARSE_WEIGHT * coarse + FOREGROUND_WEIGHT * silhouette
        return {'loss': total, 'volume': volume.detach(), 'silhouette': silhouette.detach()}

    @staticmethod
    def _silhouette_loss(logits: Tensor, alpha: Tensor, seen: Tensor) -> Tensor:
        each = functional.binary_cross_entropy_with_logits(logits[:, 0], alpha, reduction='none')
        return (each * seen).sum() / seen.sum().clamp(min=1)


def train_lifting(
    network: Lifting, views: ViewSet, config: TrainingConfig, loss: LossConfig, run: Run,
    validate: Callable[[ReconstructionNetwork], Measured],
) -> None:
    """Train a network in place on random views of random objects; see `train_steps`."""
    size = share_of_batch(config, run.fabric)

    def draw(step: int) -> Draw:
        length, own = drawn_length(step, config, run.fabric.global_rank)
        batch = draw_posed_batch(views, size, length, own, config.augment)
        return Draw((batch.images, batch.cameras, batch.alpha, batch.voxels), batch.objects)

    train_steps(run, LiftingLearner(network, loss), network, config,
                {'training': config.to_dict(), 'loss': loss.to_dict()}, views, draw,
                lambda: validate(network), weight_decay=0.01)
