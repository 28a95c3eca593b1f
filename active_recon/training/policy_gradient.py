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
from active_recon.policies.attention import kept_apart
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
    """
    What T - 1 choices of B episodes brought, (T - 1, B) each.

    `azimuth` are the means that the policy proposed, radians; `states` the network's after
    each of the T views, for who learns from them.
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

    The sample is kept as far from the views taken as the policy says, the nearest rendered view is
    taken, and log pi is that of the sample before both. The first view was not chosen and earns
    nothing. r_2D compares silhouettes from two random cameras. The network's gradients are kept
    where it has any; the policy's do not reach into it. `show` makes images (B, 3, S, S) and their
    cameras of objects and views (B,); by default they stand on white.
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
        goal = kept_apart(sample.double().cpu().numpy(), taken.double().numpy(),
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
    """Shows a network views of a set as a training wants them shown, with gradients."""

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
        """Take in views (B,) of objects (B,)."""
        images, cameras = self._show(objects, chosen)
        return self._network.step(images.to(self._device), cameras.to(self._device), state)


def policy_losses(episode: Episode, alike: int = 1) -> dict[str, Tensor]:
    """
    Return J(theta) of section 3.3 and the baseline's squared error, summed as `loss`; and a log.

    J sums -log pi (R_t - b_t) over the steps, R_t the reward to go: a choice answers for what
    follows it. Where so many episodes after one another are `alike` at their start, the mean of
    the others' R_t - b_t is taken off (Kool et al. 2019, "Buy 4 REINFORCE samples, get a baseline
    for free"): how hard an object is then no longer hides what a choice was worth.

    The log: the return of an episode and its three parts, the baseline of the first choice, and
    how widely the proposals of the batch are spread: the entropy of their histogram over 24
    azimuths, nats (a policy that always goes one way has 0, one that goes anywhere 3.18).
    """
    returns = returns_to_go(episode.reward.detach())
    advantage = returns - episode.baseline.detach()
    if alike > 1:
        groups = advantage.reshape(len(advantage), -1, alike)
        others = (groups.sum(dim=2, keepdim=True) - groups) / (alike - 1)
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
    """Episodes on a frozen reconstruction network to the policy's losses."""

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
            self._threshold, self._rewards, rng), self._rewards.episodes_alike)


def draw_episodes(views: ViewSet, size: int, key: list[int], alike: int = 1) -> Draw:
    """
    Return what episodes start from: objects and views (size,), and the generator after.

    So many after one another are alike. Raises ConfigError where that does not divide the size.
    """
    if size % alike:
        raise ConfigError(f'episodes_alike: expected a divisor of the {size} episodes that a '
                          f'process runs at once, got {alike}')
    rng = np.random.default_rng(key)
    objects = torch.from_numpy(rng.integers(len(views), size=size // alike).repeat(alike))
    starts = torch.from_numpy(
        rng.integers(views.images.shape[1], size=size // alike).repeat(alike))
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
                                   rewards.episodes_alike),
        lambda: validate(attention), weight_decay=0.0)
