"""The second stage: the attention model by policy gradient, on a frozen reconstruction network."""

from collections.abc import Callable

from active_recon.config import RewardConfig
from active_recon.datasets.views import ViewSet
from active_recon.environment import run_episode, TimeStep
from active_recon.errors import ConfigError
from active_recon.evaluation.rollouts import nearest_views, RenderedObjects, Seen
from active_recon.geometry.cameras import AZIMUTHS, orbit_camera
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
from active_recon.training.policy_losses import distance_reward, Episode, policy_losses
from active_recon.volumes.silhouettes import frustum, project_all
from active_recon.volumes.voxels import iou
import numpy as np
import torch
from torch import nn, Tensor

_SILHOUETTES = 2  # random cameras that a step's r_2D is measured from


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
    return Draw((objects, starts, rng), views.names(objects))


def train_policy(
    network: ReconstructionNetwork, attention: AttentionModel, views: ViewSet, threshold: float,
    config: TrainingConfig, rewards: RewardConfig, run: Run,
    validate: Callable[[AttentionModel], Measured],
) -> None:
    """Train the attention model in place on a frozen network; see `train_steps`."""
    size = share_of_batch(config, run.fabric)
    settings = {'training': config.to_dict(), 'reward': rewards.to_dict(), 'threshold': threshold,
                'network': state_hash(network), 'view_separation': attention.view_separation}
    train_steps(
        run, PolicyLearner(network, attention, views, threshold, config.max_views, rewards),
        attention, config, settings, views.fingerprint,
        lambda step: draw_episodes(views, size, [config.seed, 1, step, run.fabric.global_rank],
                                   rewards.group_size),
        lambda: validate(attention), weight_decay=0.0)
