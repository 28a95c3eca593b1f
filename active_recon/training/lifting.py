"""Training of the lifting network: silhouettes and coarse cells beside the voxels."""

from collections.abc import Callable

from active_recon.config import LossConfig
from active_recon.models.lifting import Lifting
from active_recon.models.lifting_encoder import Maps
from active_recon.models.network import Cameras, ReconstructionNetwork, State
from active_recon.models.volume_unet import depth_to_space
from active_recon.training.loop import (
    Draw,
    Measured,
    Run,
    share_of_batch,
    train_steps,
    TrainingConfig,
    TrainingObjects,
)
from active_recon.training.losses import volume_loss
from active_recon.training.posed_batches import draw_posed_batch
from active_recon.training.supervised import drawn_length
import torch
from torch import nn, Tensor
from torch.nn import functional

FOREGROUND_WEIGHT, COARSE_WEIGHT = 0.5, 0.3
"""Weights of the silhouettes' loss and of the coarse logits' loss, beside the volume's."""


class LiftingLearner(nn.Module):
    """
    A sequence of views to the losses after the first and after the last of them.

    A single view is where most is to be learned, and its state is a step on the way to the last:
    in sequences of equally likely lengths it alone would be decoded in one of `max_views` steps.
    """

    def __init__(self, network: Lifting, loss: LossConfig) -> None:
        super().__init__()
        self.network = network
        self._kind = loss.volume_loss

    def forward(self, images: Tensor, cameras: Cameras, alpha: Tensor,
                voxels: Tensor) -> dict[str, Tensor]:
        """Return the losses of images (T, B, 4, S, S) of cameras (T, B, ...); see `PosedBatch`."""
        maps = self.network.maps(images.flatten(0, 1))
        states = self._first_and_last(maps, Cameras(
            cameras.poses.flatten(0, 1), cameras.intrinsics.flatten(0, 1)), len(voxels))
        logits, coarse_logits, _ = self.network.logits(states)
        voxels = voxels.repeat(len(logits) // len(voxels), 1, 1, 1)
        with torch.autocast(logits.device.type, enabled=False):
            volume = volume_loss(depth_to_space(logits.float())[:, 0], voxels, self._kind)
            coarse = volume_loss(coarse_logits.float(),
                                 functional.max_pool3d(voxels[:, None], 2)[:, 0], self._kind)
            silhouette = self._silhouette_loss(maps.foreground.float(), alpha.flatten(0, 1),
                                               images[:, :, 3].flatten(0, 1))
        total = volume + COARSE_WEIGHT * coarse + FOREGROUND_WEIGHT * silhouette
        return {'loss': total, 'volume': volume.detach(), 'silhouette': silhouette.detach()}

    def _first_and_last(self, maps: Maps, cameras: Cameras, batch: int) -> State:
        """Return the states after the first and after the last view, (2 B, ...); (B, ...) of 1."""
        first = self.network.update_from_maps(
            Maps(*(part[:batch] for part in maps)), cameras.rows(slice(batch)),
            self.network.initial_state(batch))
        if len(maps.seen) == batch:
            return first
        last = self.network.update_from_maps(
            Maps(*(part[batch:] for part in maps)), cameras.rows(slice(batch, None)), first)
        return {name: torch.cat([first[name], last[name]]) for name in first}

    @staticmethod
    def _silhouette_loss(logits: Tensor, alpha: Tensor, seen: Tensor) -> Tensor:
        each = functional.binary_cross_entropy_with_logits(logits[:, 0], alpha, reduction='none')
        return (each * seen).sum() / seen.sum().clamp(min=1)


def train_lifting(
    network: Lifting, objects: TrainingObjects, config: TrainingConfig, loss: LossConfig, run: Run,
    validate: Callable[[ReconstructionNetwork], Measured],
) -> None:
    """Train a network in place on random views of random objects; see `train_steps`."""
    size = share_of_batch(config, run.fabric)

    def draw(step: int) -> Draw:
        length, own = drawn_length(step, config, run.fabric.global_rank)
        views = objects.at(step)
        batch = draw_posed_batch(views, size, length, own, config.augment)
        return Draw((batch.images, batch.cameras, batch.alpha, batch.voxels),
                    views.names(batch.objects))

    train_steps(run, LiftingLearner(network, loss), network, config,
                {'training': config.to_dict(), 'loss': loss.to_dict()},
                objects.fingerprint, draw,
                lambda: validate(network), weight_decay=0.01)
