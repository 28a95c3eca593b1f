"""The first stage: a reconstruction network under the losses of section 3.2, on random views."""

from collections.abc import Callable

from active_recon.config import LossConfig
from active_recon.geometry.cameras import AZIMUTHS, orbit_camera
from active_recon.models.network import Cameras, ReconstructionNetwork, State
from active_recon.training.batches import draw_batch
from active_recon.training.loop import (
    Draw,
    Measured,
    Run,
    share_of_batch,
    train_steps,
    TrainingConfig,
    TrainingObjects,
)
from active_recon.training.losses import reconstruction_loss
from active_recon.training.posed_batches import draw_posed_batch
from active_recon.volumes.silhouettes import frustum
import numpy as np
import torch
from torch import nn, Tensor


class ReconstructionLearner(nn.Module):
    """
    The losses of a network after a sequence of views.

    The loss after one random view of a sequence is an unbiased estimate of the mean over its
    views, at a fraction of the cost: decoding costs more than updating.
    """

    def __init__(self, network: ReconstructionNetwork, loss: LossConfig) -> None:
        super().__init__()
        self.network = network
        self._loss = loss
        self._frusta: Tensor
        self.register_buffer(
            '_frusta', frustum([orbit_camera(azimuth) for azimuth in AZIMUTHS]), persistent=False)

    def forward(self, images: Tensor, cameras: Cameras, voxels: Tensor,
                seen_from: Tensor) -> dict[str, Tensor]:
        """
        Return the losses after the last of images (T, B, C, S, S) of cameras (T, B, ...).

        `voxels` are (B, R, R, R); `seen_from`, (B,), the indices of the cameras, out of 24, whose
        silhouettes are compared.
        """
        every = Cameras(*(part.flatten(0, 1) for part in cameras))
        encoded = self.network.encode(images.flatten(0, 1), every)
        encoded = encoded.reshape(*images.shape[:2], *encoded.shape[1:])
        state = self.network.initial_state(len(voxels))
        for number, view in enumerate(encoded):
            state = self.network.update(view, cameras.rows(number), state)
        return self.losses(state, voxels, seen_from)

    def losses(self, state: State, voxels: Tensor, seen_from: Tensor) -> dict[str, Tensor]:
        """Return the losses of a state: the sum is `loss`."""
        own = self.network.objective(state, voxels)
        if own is not None:
            return {'loss': own}
        logits = self.network.decode(state)
        with torch.autocast(logits.device.type, enabled=False):
            total, parts = reconstruction_loss(logits.float(), voxels, self._frusta[seen_from],
                                               self._loss)
        return {'loss': total, **parts}


def longest_sequence(step: int, config: TrainingConfig) -> int:
    """
    Return the largest number of views of a sequence: two in the first part of a training.

    A single view is learned first, and faster if no time is spent on later views.
    """
    short = step < config.curriculum_fraction * config.steps
    return min(2, config.max_views) if short else config.max_views


def drawn_length(step: int, config: TrainingConfig,
                 rank: int) -> tuple[int, np.random.Generator]:
    """
    Return the number of views of a step's sequences, and the generator of its other draws.

    The length is the same for all processes; the generator is that of the process of a rank.
    """
    shared = np.random.default_rng([config.seed, step])
    length = int(shared.integers(1, longest_sequence(step, config) + 1))
    # Not the rank itself: numpy takes [seed, step, 0] for [seed, step], the length's own numbers
    return length, np.random.default_rng([config.seed, step, rank + 1])


def steps_for(samples: int, batch_size: int, max_views: int,
              curriculum_fraction: float = 0.5) -> int:
    """Return the steps in which a training sees about so many views."""
    return max(1, round(samples / (batch_size * mean_length(max_views, curriculum_fraction))))


def mean_length(max_views: int, curriculum_fraction: float = 0.5) -> float:
    """Return how many views a sequence has on average, over a whole training."""
    short, long = (min(2, max_views) + 1) / 2, (max_views + 1) / 2
    return curriculum_fraction * short + (1 - curriculum_fraction) * long


def train_reconstruction(
    network: ReconstructionNetwork, objects: TrainingObjects, config: TrainingConfig,
    loss: LossConfig, run: Run, validate: Callable[[ReconstructionNetwork], Measured],
) -> None:
    """
    Train a network in place on random views of random objects; see `train_steps`.

    One that needs no front learns from posed views, as the lifting network does.
    """
    size = share_of_batch(config, run.fabric)

    def draw(step: int) -> Draw:
        length, own = drawn_length(step, config, run.fabric.global_rank)
        drawn = draw_batch if network.needs_front else draw_posed_batch
        views = objects.at(step)
        batch = drawn(views, size, length, own, config.augment)
        seen_from = torch.from_numpy(own.integers(len(AZIMUTHS), size=size))
        return Draw((batch.images, batch.cameras, batch.voxels, seen_from),
                    views.names(batch.objects))

    train_steps(run, ReconstructionLearner(network, loss), network, config,
                {'training': config.to_dict(), 'loss': loss.to_dict()},
                objects.fingerprint, draw,
                lambda: validate(network), weight_decay=0.01)
