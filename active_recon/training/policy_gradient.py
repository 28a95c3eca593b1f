"""The second stage: the attention model by policy gradient, on a frozen reconstruction network."""

from collections.abc import Callable
from dataclasses import dataclass
import math
from pathlib import Path

from active_recon.cameras import AZIMUTHS, orbit_camera, TURN
from active_recon.config import RewardConfig
from active_recon.datasets.views import ViewSet
from active_recon.evaluation.rollouts import nearest_views
from active_recon.models.attention import AttentionModel
from active_recon.models.reconstruction import ReconstructionNetwork
from active_recon.silhouettes import frustum, project_all
from active_recon.training.checkpoints import Checkpoint, resume_checkpoint, save_checkpoint
from active_recon.training.supervised import (
    learning_rate_share,
    refuse_divergence,
    TrainingConfig,
)
from active_recon.voxels import iou
import numpy as np
import torch
from torch import Tensor

_SILHOUETTES = 2  # random cameras that a step's r_2D is measured from


def distance_reward(azimuth: Tensor, taken: Tensor, config: RewardConfig) -> Tensor:
    """
    Return r_distance, (B,), of going to azimuths (B,) after those taken, (B, t), radians.

    -lambda exp(-d^2 / 2 tau^2), d the shortest way to the nearest view taken: near views cost.
    The paper's 1 / d^2 to the last view, unwrapped, rewards near views, against its own text; it
    stands behind `paper_distance`.
    """
    if config.paper_distance:
        return 1 / (azimuth % TURN - taken[:, -1] % TURN).square().clamp(min=1e-4)
    away = torch.remainder(azimuth[:, None] - taken + math.pi, TURN) - math.pi
    nearest = away.abs().amin(dim=1)
    return -config.distance_weight * torch.exp(-nearest.square() / (2 * config.distance_tau ** 2))


def returns_to_go(rewards: Tensor) -> Tensor:
    """Return the sum of each reward and all later ones, along the first axis, (T, B)."""
    return rewards.flip(0).cumsum(0).flip(0)


@dataclass(frozen=True, eq=False)
class Episode:
    """What T - 1 choices of B episodes brought, (T - 1, B) each."""

    log_probability: Tensor
    baseline: Tensor
    reward_3d: Tensor
    reward_2d: Tensor
    reward_distance: Tensor

    @property
    def reward(self) -> Tensor:
        """Return r_t = r_3D + r_2D + r_distance."""
        return self.reward_3d + self.reward_2d + self.reward_distance


def run_episodes(
    network: ReconstructionNetwork, attention: AttentionModel, views: ViewSet, objects: Tensor,
    starts: Tensor, length: int, threshold: float, config: RewardConfig,
    rng: np.random.Generator,
) -> Episode:
    """
    Run an episode for each object (B,), sampling every azimuth from the policy.

    The nearest rendered view is taken, and log pi is that of the sample before. The first view
    was not chosen and earns nothing. r_2D compares silhouettes from two random cameras.
    """
    truth, azimuths = views.voxels[objects], views.azimuths[objects]
    rows = torch.arange(len(objects))
    cameras = [orbit_camera(azimuth)
               for azimuth in rng.choice(AZIMUTHS, _SILHOUETTES, replace=False)]
    frusta = frustum(cameras)
    true_outlines = project_all(truth.float(), frusta) > 0.5  # (B, cameras, S, S)
    chosen, hidden, state = starts, None, None
    taken = torch.empty(len(objects), 0)
    quality: list[tuple[Tensor, Tensor]] = []
    steps: dict[str, list[Tensor]] = {'log': [], 'baseline': [], 'distance': []}
    for t in range(length):
        taken = torch.column_stack([taken, azimuths[rows, chosen]])
        with torch.inference_mode():
            seen, hidden = network(views.white(objects, chosen), hidden)
            occupied = seen.logits.sigmoid() > threshold
            outlines = project_all(occupied.float(), frusta) > 0.5
            quality.append((iou(occupied, truth),
                            iou(outlines, true_outlines, (-2, -1)).mean(dim=1)))
        if t + 1 == length:
            break
        proposal, state = attention(seen.latent.clone(), taken[:, -1], state)
        mean = proposal.mean_azimuth
        noise = torch.from_numpy(rng.normal(0, config.policy_sigma, len(objects)))
        sample = (mean.detach() + noise.float())
        steps['log'].append(-((sample - mean) / config.policy_sigma).square() / 2)
        steps['baseline'].append(proposal.baseline)
        chosen = nearest_views(azimuths.numpy(), sample.double().numpy())
        steps['distance'].append(distance_reward(azimuths[rows, chosen], taken, config))
    volumes, silhouettes = (torch.stack(part).clone() for part in zip(*quality, strict=True))
    return Episode(torch.stack(steps['log']), torch.stack(steps['baseline']),
                   volumes.diff(dim=0), silhouettes.diff(dim=0), torch.stack(steps['distance']))


def policy_loss(episode: Episode) -> tuple[Tensor, Tensor]:
    """
    Return J(theta) of section 3.3 and the baseline's squared error, scalars.

    J sums -log pi (R_t - b_t) over the steps, R_t the reward to go: a choice answers for what
    follows it.
    """
    returns = returns_to_go(episode.reward.detach())
    advantage = returns - episode.baseline.detach()
    return (-(episode.log_probability * advantage).sum(0).mean(),
            (returns - episode.baseline).square().mean())


def train_policy(
    network: ReconstructionNetwork, attention: AttentionModel, views: ViewSet, threshold: float,
    config: TrainingConfig, rewards: RewardConfig, checkpoint_path: Path,
    validate: Callable[[AttentionModel], dict[str, float]],
    report: Callable[[int, dict[str, float]], None], resume: bool = False,
) -> None:
    """Train the attention model in place; see train_reconstruction for what is shared."""
    optimizer = torch.optim.AdamW(attention.parameters(), config.learning_rate,
                                  betas=(0.9, 0.99), weight_decay=0.0)
    settings = {'training': config.to_dict(), 'reward': rewards.to_dict(), 'threshold': threshold}
    begun = Checkpoint(0, settings, [])
    if resume:
        begun = resume_checkpoint(checkpoint_path, attention, optimizer, settings)
    log = begun.log
    network.eval()
    for step in range(begun.step, config.steps):
        rng = np.random.default_rng([config.seed, 1, step])
        objects = torch.from_numpy(rng.integers(len(views), size=config.batch_size))
        starts = torch.from_numpy(rng.integers(views.images.shape[1], size=config.batch_size))
        for group in optimizer.param_groups:
            group['lr'] = config.learning_rate * learning_rate_share(step, config.steps, 20)
        episode = run_episodes(network, attention, views, objects, starts, config.max_views,
                               threshold, rewards, rng)
        objective, error = policy_loss(episode)
        refuse_divergence(step, objective + error, views, objects)
        optimizer.zero_grad(set_to_none=True)
        (objective + error).backward()  # type: ignore[no-untyped-call]
        optimizer.step()
        measured = {
            'return': episode.reward.sum(0).mean().item(),
            'reward_3d': episode.reward_3d.sum(0).mean().item(),
            'reward_2d': episode.reward_2d.sum(0).mean().item(),
            'reward_distance': episode.reward_distance.sum(0).mean().item(),
            'baseline': episode.baseline[0].mean().item(), 'baseline_error': error.item()}
        last = step + 1 == config.steps
        if last or (step + 1) % config.validate_every == 0:
            measured |= validate(attention)
            log.append({'step': step + 1, **measured})
        report(step + 1, measured)
        if last or (step + 1) % config.checkpoint_every == 0:
            save_checkpoint(checkpoint_path, attention, optimizer,
                            Checkpoint(step + 1, settings, log))
    attention.eval()
