"""The second stage: the attention model by policy gradient, on a frozen reconstruction network."""

from collections.abc import Callable
from dataclasses import dataclass
import math

from active_recon.config import RewardConfig
from active_recon.datasets.views import ViewSet
from active_recon.environment import run_episode, TimeStep
from active_recon.errors import ConfigError
from active_recon.evaluation.rollouts import nearest_views, RenderedObjects, Seen
from active_recon.geometry.cameras import AZIMUTHS, orbit_camera, TURN, VIEW_COUNT
from active_recon.models.attention import AttentionModel
from active_recon.models.network import Cameras, ReconstructionNetwork, State
from active_recon.models.weights import state_hash
from active_recon.policies.attention import enforce_separation
from active_recon.training.loop import (
    Draw,
    Measured,
    Run,
    share_of_batch,
    train_steps,
    TrainingConfig,
)
from active_recon.volumes.silhouettes import frustum, project_all
from active_recon.volumes.voxels import iou
import numpy as np
import torch
from torch import nn, Tensor

_SILHOUETTES = 2  # random cameras that a step's r_2D is measured from


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


def run_episodes(
    network: ReconstructionNetwork, attention: AttentionModel, views: ViewSet, objects: Tensor,
    starts: Tensor, length: int, threshold: float, config: RewardConfig,
    rng: np.random.Generator,
    show: Callable[[Tensor, Tensor], tuple[Tensor, Cameras]] | None = None,
) -> Episode:
    """
    Run an episode for each object (B,), sampling every azimuth from the policy.

    The policy's separation from the views taken is enforced on the sample, then the nearest
    rendered view is taken; log pi is that of the sample itself. The first view was not chosen and
    has no reward. r_2D compares silhouettes from two random cameras. The network's gradients are
    kept where it has any; the policy's do not flow into it. `show` returns images (B, 3, S, S)
    and their cameras of objects and views (B,); by default the images have a white background.
    """
    device = next(attention.parameters()).device
    truth = views.voxels[objects].to(device)
    cameras = [orbit_camera(azimuth)
               for azimuth in rng.choice(AZIMUTHS, _SILHOUETTES, replace=False)]
    frusta = frustum(cameras).to(device)
    true_outlines = project_all(truth.float(), frusta) > 0.5  # (B, cameras, S, S)
    every = views.azimuths[objects]
    own = RenderedObjects(_Shown(network, views, show, device), objects)
    memory = attention.initial_state(len(objects))
    steps: dict[str, list[Tensor]] = {'log': [], 'baseline': [], 'distance': [], 'azimuth': []}

    def choose(step: TimeStep[Tensor, Seen]) -> Tensor:
        nonlocal memory
        taken = every.gather(1, step.known.chosen)
        with torch.autocast(device.type, enabled=False):
            proposal, memory = attention(step.known.state['latent'].detach().float(),
                                         taken[:, -1].to(device), memory)
        mean = proposal.mean_azimuth
        noise = torch.from_numpy(rng.normal(0, config.policy_sigma, len(objects)))
        sample = (mean.detach() + noise.float().to(device))
        steps['log'].append(-((sample - mean) / config.policy_sigma).square() / 2)
        steps['baseline'].append(proposal.baseline)
        steps['azimuth'].append(mean.detach())
        goal = enforce_separation(sample.double().cpu().numpy(), taken.double().numpy(),
                          every.double().numpy(), attention.view_separation)
        chosen = nearest_views(every.numpy(), goal)
        steps['distance'].append(distance_reward(
            every.gather(1, chosen[:, None])[:, 0], taken, config))
        return chosen

    quality: list[tuple[Tensor, Tensor]] = []
    states: list[State] = []
    for step in run_episode(own, starts, choose, length):
        states.append(step.known.state)
        with torch.no_grad():
            occupied = network.decode(step.known.state).sigmoid() > threshold
            outlines = project_all(occupied.float(), frusta) > 0.5
            quality.append((iou(occupied, truth),
                            iou(outlines, true_outlines, (-2, -1)).mean(dim=1)))
    volumes, silhouettes = (torch.stack(part) for part in zip(*quality, strict=True))
    return Episode(
        torch.stack(steps['log']), torch.stack(steps['baseline']), volumes.diff(dim=0),
        silhouettes.diff(dim=0), torch.stack(steps['distance']).to(device),
        torch.stack(steps['azimuth']), states)


class _Shown:
    """Shows a network the views of a set as `show` renders them, with gradients."""

    def __init__(self, network: ReconstructionNetwork, views: ViewSet,
                 show: Callable[[Tensor, Tensor], tuple[Tensor, Cameras]] | None,
                 device: torch.device) -> None:
        self.views = views
        self._network, self._device = network, device
        self._show = show or (lambda objects, chosen: (
            views.white(objects, chosen), views.cameras(objects, chosen)))

    def initial_state(self, batch: int) -> State:
        """Return the network's state before any view."""
        return self._network.initial_state(batch)

    def update(self, objects: Tensor, chosen: Tensor, state: State) -> State:
        """Update the state by views (B,) of objects (B,)."""
        images, cameras = self._show(objects, chosen)
        return self._network.step(images.to(self._device), cameras.to(self._device), state)


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


class PolicyLearner(nn.Module):
    """The losses of a view policy over episodes on a frozen reconstruction network."""

    def __init__(self, network: ReconstructionNetwork, attention: AttentionModel, views: ViewSet,
                 threshold: float, length: int, rewards: RewardConfig) -> None:
        super().__init__()
        self.network = network.requires_grad_(False)
        self.attention = attention
        self._views, self._threshold, self._length = views, threshold, length
        self._rewards = rewards

    def forward(self, objects: Tensor, starts: Tensor,
                rng: np.random.Generator) -> dict[str, Tensor]:
        """Run an episode of each object (B,) from the view it starts at (B,)."""
        return policy_losses(run_episodes(
            self.network, self.attention, self._views, objects.cpu(), starts.cpu(), self._length,
            self._threshold, self._rewards, rng), self._rewards.group_size)


def draw_episodes(views: ViewSet, size: int, key: list[int], group_size: int = 1) -> Draw:
    """
    Return the starts of episodes: objects and views (size,), and the generator for the rest.

    Each `group_size` consecutive episodes have the same start. Raises ConfigError where that does
    not divide the size.
    """
    if size % group_size:
        raise ConfigError(f'group_size: uneven groups: expected a divisor of the {size} episodes '
                          f'that a process runs at once, got {group_size}')
    rng = np.random.default_rng(key)
    objects, starts = (
        torch.from_numpy(rng.integers(count, size=size // group_size).repeat(group_size))
        for count in views.images.shape[:2])
    return Draw((objects, starts, rng), objects)


def train_policy(
    network: ReconstructionNetwork, attention: AttentionModel, views: ViewSet, threshold: float,
    config: TrainingConfig, rewards: RewardConfig, run: Run,
    validate: Callable[[AttentionModel], Measured],
) -> None:
    """Train the attention model in place on a frozen network; see `train_steps`."""
    size = share_of_batch(config, run.fabric)
    settings = {'training': config.to_dict(), 'reward': rewards.to_dict(), 'threshold': threshold,
                'network': state_hash(network)}
    train_steps(
        run, PolicyLearner(network, attention, views, threshold, config.max_views, rewards),
        attention, config, settings, views,
        lambda step: draw_episodes(views, size, [config.seed, 1, step, run.fabric.global_rank],
                                   rewards.group_size),
        lambda: validate(attention), weight_decay=0.0)
