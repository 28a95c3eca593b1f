"""The paper's joint scheme: reconstruction and policy together, views chosen by the policy."""

from collections.abc import Callable

from active_recon.config import LossConfig, RewardConfig
from active_recon.datasets.views import ViewSet
from active_recon.geometry.cameras import AZIMUTHS
from active_recon.models.attention import AttentionModel
from active_recon.models.network import Cameras, ReconstructionNetwork
from active_recon.training import augmentation
from active_recon.training.loop import (
    Draw,
    Measured,
    Run,
    share_of_batch,
    train_steps,
    TrainingConfig,
)
from active_recon.training.policy_gradient import draw_episodes, run_episodes
from active_recon.training.policy_losses import policy_losses
from active_recon.training.supervised import ReconstructionLearner
import numpy as np
import torch
from torch import nn, Tensor

_THRESHOLD = 0.4  # of the rewards' IoU: the one that is chosen on validation comes after training


class JointLearner(nn.Module):
    """
    The losses of both networks over episodes under the policy's own choices.

    The reconstruction learns from its losses after one random view of each episode (section 3.2),
    the policy from its rewards (section 3.3); the gradients of neither flow into the other.
    """

    def __init__(self, network: ReconstructionNetwork, attention: AttentionModel, views: ViewSet,
                 loss: LossConfig, rewards: RewardConfig, length: int, augment: bool) -> None:
        super().__init__()
        self.reconstruction = ReconstructionLearner(network, loss)
        self.attention = attention
        self._views, self._rewards = views, rewards
        self._length, self._augment = length, augment

    def forward(self, objects: Tensor, starts: Tensor,
                rng: np.random.Generator) -> dict[str, Tensor]:
        """Run an episode of each object (B,) from the view it starts at (B,)."""
        objects, device = objects.cpu(), next(self.attention.parameters()).device
        scene = int(rng.integers(2 ** 32))

        def show(objects: Tensor, chosen: Tensor) -> tuple[Tensor, Cameras]:
            # Views come one by one: the same generator for each keeps the scene as it is
            images, cameras = self._views.images[objects, chosen], self._views.cameras(
                objects, chosen)
            pictures, intrinsics = augmentation.augment(
                images[None], cameras.intrinsics[None], self._views, np.random.default_rng(scene))
            return pictures[0], Cameras(cameras.poses, intrinsics[0])

        episode = run_episodes(
            self.reconstruction.network, self.attention, self._views, objects, starts.cpu(),
            self._length, _THRESHOLD, self._rewards, rng, show if self._augment else None)
        seen_from = torch.from_numpy(rng.integers(len(AZIMUTHS), size=len(objects))).to(device)
        losses = self.reconstruction.losses(
            episode.states[rng.integers(self._length)],
            self._views.voxels[objects].float().to(device), seen_from)
        chosen = policy_losses(episode, self._rewards.group_size)
        return losses | chosen | {'loss': losses['loss'] + chosen['loss']}


class JointModel(nn.Module):
    """The two networks as one, for the checkpoints."""

    def __init__(self, reconstruction: ReconstructionNetwork, attention: AttentionModel) -> None:
        super().__init__()
        self.reconstruction = reconstruction
        self.attention = attention


def train_jointly(
    network: ReconstructionNetwork, attention: AttentionModel, views: ViewSet,
    config: TrainingConfig, loss: LossConfig, rewards: RewardConfig, run: Run,
    validate: Callable[[ReconstructionNetwork, AttentionModel], Measured],
) -> None:
    """Train both in place, from fresh weights or any others; see `train_steps`."""
    size = share_of_batch(config, run.fabric)
    settings = {'training': config.to_dict(), 'loss': loss.to_dict(), 'reward': rewards.to_dict(),
                'view_separation': attention.view_separation}

    def draw(step: int) -> Draw:
        return draw_episodes(views, size, [config.seed, 2, step, run.fabric.global_rank],
                             rewards.group_size)

    train_steps(
        run, JointLearner(network, attention, views, loss, rewards, config.max_views,
                          config.augment),
        JointModel(network, attention), config, settings, views.fingerprint, draw,
        lambda: validate(network, attention), weight_decay=0.01)
