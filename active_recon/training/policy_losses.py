"""Rewards of a view policy's episodes, and the losses of REINFORCE that they make."""

from dataclasses import dataclass
import math

from active_recon.config import RewardConfig
from active_recon.geometry.cameras import TURN, VIEW_COUNT
from active_recon.models.network import State
import torch
from torch import Tensor


def distance_reward(azimuth: Tensor, taken: Tensor, config: RewardConfig) -> Tensor:
    """
    Return r_distance, (B,), of going to azimuths (B,) after those taken, (B, t), radians.

    -lambda exp(-d^2 / 2 tau^2), d the shortest way to the nearest view taken: near views cost.
    The paper's 1 / d^2 to the last view, unwrapped, rewards near views, against its own text; it
    is used with `paper_distance`.
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
    """
    The outcome of the T - 1 choices of B episodes, (T - 1, B) each.

    `azimuth` are the policy's mean azimuths, radians; `states` the network's states after each of
    the T views.
    """

    log_probability: Tensor
    baseline: Tensor
    reward_3d: Tensor
    reward_2d: Tensor
    reward_distance: Tensor
    azimuth: Tensor
    states: list[State]

    @property
    def reward(self) -> Tensor:
        """Return r_t = r_3D + r_2D + r_distance."""
        return self.reward_3d + self.reward_2d + self.reward_distance


def policy_losses(episode: Episode, group_size: int = 1) -> dict[str, Tensor]:
    """
    Return J(theta) of section 3.3 and the baseline's squared error, summed as `loss`; and a log.

    J sums -log pi (R_t - b_t) over the steps, where R_t is the reward-to-go. Each `group_size`
    consecutive episodes have the same start, and the mean R_t - b_t of the others in the group is
    subtracted (Kool et al. 2019, "Buy 4 REINFORCE samples, get a baseline for free"): the
    advantage then does not depend on how hard an object is.

    The log: the return of an episode and its three parts, the baseline of the first choice, and
    the entropy of the histogram of the batch's proposals over 24 azimuths, nats (0 where all are
    in one direction, 3.18 where they are uniform).
    """
    returns = returns_to_go(episode.reward.detach())
    advantage = returns - episode.baseline.detach()
    if group_size > 1:
        groups = advantage.reshape(len(advantage), -1, group_size)
        others = (groups.sum(dim=2, keepdim=True) - groups) / (group_size - 1)
        advantage = (groups - others).flatten(1)
    objective = -(episode.log_probability * advantage).sum(0).mean()
    error = (returns - episode.baseline).square().mean()
    return {
        'loss': objective + error, 'baseline_error': error.detach(),
        'return': episode.reward.sum(0).mean(), 'reward_3d': episode.reward_3d.sum(0).mean(),
        'reward_2d': episode.reward_2d.sum(0).mean(),
        'reward_distance': episode.reward_distance.sum(0).mean(),
        'baseline': episode.baseline[0].mean().detach(),
        'azimuth_entropy': azimuth_entropy(episode.azimuth)}


def azimuth_entropy(azimuths: Tensor) -> Tensor:
    """Return the entropy, nats, of the histogram of azimuths (any shape) over the 24."""
    bins = (azimuths / TURN * VIEW_COUNT).round().long() % VIEW_COUNT
    share = torch.bincount(bins.flatten(), minlength=VIEW_COUNT) / bins.numel()
    return -torch.xlogy(share, share).sum()
