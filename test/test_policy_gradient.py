"""The second stage: rewards, returns, and a policy that finds what is worth looking at."""

import math

from active_recon.config import RewardConfig
from active_recon.datasets.layout import ObjectFolder
from active_recon.datasets.views import ViewSet
from active_recon.errors import ConfigError
from active_recon.evaluation.rollouts import nearest_views
from active_recon.geometry.cameras import azimuth_difference, AZIMUTHS
from active_recon.models.attention import AttentionModel
from active_recon.models.network import ReconstructionNetwork
from active_recon.training import policy_gradient
from active_recon.training.loop import make_fabric, Run, TrainingConfig, TrainingDivergedError
from active_recon.training.policy_gradient import draw_episodes, run_episodes, train_policy
from active_recon.training.policy_losses import (
    azimuth_entropy,
    distance_reward,
    Episode,
    policy_losses,
    returns_to_go,
)
from active_recon.volumes.voxels import iou
import numpy as np
import pytest
from shown_views import cameras_at
import torch
from torch.testing import assert_close

CONFIG = TrainingConfig(steps=5, batch_size=4, max_views=3, bfloat16=False, checkpoint_every=2,
                        validate_every=2)


def reward(azimuth, *taken, **config):
    return distance_reward(torch.tensor([float(azimuth)]), torch.tensor([taken]),
                           RewardConfig(**config)).item()


def test_going_where_one_was_costs_the_most_and_far_away_nothing():
    costs = [reward(azimuth, 0.0) for azimuth in np.linspace(0, math.pi, 13)]
    assert costs[0] == pytest.approx(-0.02)
    assert (np.diff(costs) > 0).all()
    assert costs[-1] == pytest.approx(0, abs=1e-6)
    assert reward(math.radians(30), 0.0) == pytest.approx(-0.02 * math.exp(-0.5))


@pytest.mark.parametrize('azimuth', [0.1, 1.0, 3.0])
def test_the_distance_is_the_short_way_round(azimuth):
    expected = reward(azimuth, 0.0)
    for other, taken in ((-azimuth, 0.0), (azimuth + math.tau, 0.0), (math.tau - azimuth, 0.0),
                         (0.0, azimuth), (azimuth, 2 * math.tau)):
        assert reward(other, taken) == pytest.approx(expected, abs=1e-6)


def test_the_nearest_of_all_views_counts_and_not_the_last():
    assert reward(1.0, 1.0, 4.0) == reward(1.0, 4.0, 1.0) == pytest.approx(-0.02)
    assert reward(1.0, 1.2, 4.0) == pytest.approx(reward(1.0, 1.2))


def test_the_papers_form_rewards_near_views_does_not_wrap_and_knows_only_the_last():
    assert reward(1.0, 3.0, paper_distance=True) == pytest.approx(0.25)
    assert reward(1.0, 1.0, 3.0, paper_distance=True) == pytest.approx(0.25)
    assert reward(1.1, 1.0, paper_distance=True) > reward(2.0, 1.0, paper_distance=True)
    assert reward(0.1, 6.2, paper_distance=True) == pytest.approx(1 / 6.1 ** 2, rel=1e-4)
    assert math.isfinite(reward(1.0, 1.0, paper_distance=True))


def test_a_return_to_go_sums_what_is_still_to_come():
    rewards = torch.tensor([[1.0, 10.0], [2.0, 20.0], [4.0, 40.0]])
    assert_close(returns_to_go(rewards), torch.tensor([[7.0, 70.0], [6.0, 60.0], [4.0, 40.0]]))


def an_episode(log_probability, baseline, reward_3d):
    nothing = torch.zeros_like(reward_3d)
    return Episode(log_probability, baseline, reward_3d, nothing, nothing, nothing, [])


def test_a_choice_answers_for_what_follows_it_and_the_baseline_for_the_return():
    logs = torch.zeros(2, 1, requires_grad=True)
    baseline = torch.tensor([[1.0], [5.0]], requires_grad=True)
    losses = policy_losses(an_episode(logs, baseline, torch.tensor([[2.0], [3.0]])))
    assert losses['baseline_error'].item() == pytest.approx((16 + 4) / 2)
    losses['loss'].backward()
    assert_close(logs.grad, torch.tensor([[-4.0], [2.0]]))  # minus the advantage
    assert_close(baseline.grad, torch.tensor([[-4.0], [2.0]]))  # of the error alone


def test_the_objective_sums_over_the_steps_and_averages_over_the_episodes():
    logs, rewards = torch.tensor([[-1.0, -2.0], [-3.0, -4.0]]), torch.zeros(2, 2)
    baseline = torch.full((2, 2), -1.0)
    losses = policy_losses(an_episode(logs, baseline, rewards))
    assert losses['loss'].item() == pytest.approx((1 + 2 + 3 + 4) / 2 + 1)  # and the baseline's


def gradient(rewards, group_size):
    """Return the gradient of the objective by log pi, (T - 1, B), with a baseline of 0.5."""
    logs = torch.zeros_like(rewards, requires_grad=True)
    episode = an_episode(logs, torch.full_like(rewards, 0.5), rewards)
    policy_losses(episode, group_size)['loss'].backward()
    return logs.grad


def test_what_all_episodes_of_a_group_earn_teaches_nothing():
    rewards = torch.rand(3, 8, generator=torch.Generator().manual_seed(0))
    harder = rewards - torch.tensor([1.0, 7.0]).repeat_interleave(4)
    assert_close(gradient(harder, 4), gradient(rewards, 4))
    assert (gradient(harder, 1) - gradient(rewards, 1)).abs().min() > 0.1


def test_an_episode_is_judged_by_the_mean_of_the_others_of_its_group():
    # Minus the advantage over six episodes: 1 - (2 + 6) / 2 and so on
    assert_close(gradient(torch.tensor([[1.0, 2.0, 6.0, 5.0, 5.0, 5.0]]), 3) * 6,
                 torch.tensor([[3.0, 1.5, -4.5, 0.0, 0.0, 0.0]]))


def test_the_episodes_of_a_group_have_the_same_start(views):
    objects, starts, _ = draw_episodes(views, 12, [5], 3).arguments
    for part in (objects, starts):
        groups = part.reshape(4, 3)
        assert (groups == groups[:, :1]).all()
        assert len(groups[:, 0].unique()) > 1
    with pytest.raises(ConfigError, match='uneven groups: expected a divisor of the 12 '
                       'episodes.*got 5'):
        draw_episodes(views, 12, [5], 5)


def nearest_of_each(network, attention, views, monkeypatch):
    """Return how near any two views of an episode came, over several episodes."""
    went = []

    def spy(azimuths, goals):
        went.append(nearest_views(azimuths, goals))
        return went[-1]

    monkeypatch.setattr(policy_gradient, 'nearest_views', spy)
    nearest = []
    for seed in range(5):
        went[:] = [torch.tensor([2, 9, 23])]
        some_episodes(network, attention, views, seed=seed)
        taken = views.azimuths[[0, 3, 5]].gather(1, torch.stack(went, dim=1)).double().numpy()
        gaps = np.abs(azimuth_difference(taken[:, :, None], taken[:, None, :]))
        nearest += np.where(np.eye(4, dtype=bool), np.inf, gaps).min(axis=(1, 2)).tolist()
    return nearest


@pytest.mark.slow
def test_episodes_keep_their_views_as_far_apart_as_the_policy_says(
        network, attention, views, monkeypatch):
    assert min(nearest_of_each(network, attention, views, monkeypatch)) < 0.5
    attention.view_separation = 1.0
    kept = nearest_of_each(network, attention, views, monkeypatch)
    assert min(kept) > 1.0 - math.radians(7.6)  # the nearest rendered view is taken


def some_episodes(network, attention, views, length=4, seed=0, rewards=None):
    return run_episodes(network, attention, views, torch.tensor([0, 3, 5]),
                        torch.tensor([2, 9, 23]), length, 0.1, rewards or RewardConfig(),
                        np.random.default_rng(seed))


def test_the_first_view_was_not_chosen_and_earns_nothing(network, attention, views):
    episode = some_episodes(network, attention, views)
    for part in (episode.log_probability, episode.baseline, episode.reward_3d, episode.reward_2d,
                 episode.reward_distance, episode.reward):
        assert part.shape == (3, 3)  # T - 1 choices of three episodes
    assert_close(episode.reward,
                 episode.reward_3d + episode.reward_2d + episode.reward_distance)
    assert (episode.log_probability <= 0).all()
    assert ((episode.reward_distance >= -0.0201) & (episode.reward_distance <= 0)).all()


def test_the_gains_of_an_episode_add_up_to_last_minus_first(network, attention, views):
    seen = []
    network.decoder.register_forward_hook(
        lambda *call: seen.append(call[2].sigmoid() > 0.1))
    episode = some_episodes(network, attention, views)
    truth = views.voxels[[0, 3, 5]]
    quality = torch.stack([iou(occupied, truth) for occupied in seen])
    assert_close(episode.reward_3d, quality.diff(dim=0))
    assert_close(episode.reward_3d.sum(0), quality[-1] - quality[0])


def test_the_same_generator_runs_the_same_episodes(network, attention, views):
    first, again, other = (some_episodes(network, attention, views, seed=seed)
                           for seed in (0, 0, 1))
    assert_close(again.log_probability, first.log_probability, rtol=0, atol=0)
    assert_close(again.reward, first.reward, rtol=0, atol=0)
    assert (other.log_probability != first.log_probability).any()


def test_only_the_attention_learns_from_an_episode(network, attention, views):
    network.requires_grad_(False)
    policy_losses(some_episodes(network, attention, views))['loss'].backward()
    assert all(parameter.grad is None for parameter in network.parameters())
    assert all(parameter.grad is not None for parameter in attention.parameters())


def test_proposals_one_way_have_no_entropy_and_proposals_every_way_the_most():
    assert azimuth_entropy(torch.full((3, 8), -0.1)).item() == pytest.approx(0)
    everywhere = torch.tensor(AZIMUTHS, dtype=torch.float32) - math.pi
    assert azimuth_entropy(everywhere).item() == pytest.approx(math.log(24), abs=1e-5)


class Bandit(ReconstructionNetwork):
    """An episode's IoU depends on the azimuth of the view alone, which the image's red tells."""

    image_size, resolution, needs_front = 64, 32, True

    def __init__(self, best: float) -> None:
        super().__init__()
        worth = (1 + torch.tensor(AZIMUTHS - best).cos()) / 2
        self.filled = (32 * worth).round()  # of 32 layers, by view

    def initial_state(self, batch):
        return {'filled': torch.zeros(batch), 'latent': torch.ones(batch, 4, 4, 4)}

    def encode(self, images, cameras):
        return images

    def update(self, encoded, cameras, state):
        view = (encoded[:, 0, 0, 0] * 255 / 10).round().long()
        return state | {'filled': self.filled[view]}

    def decode(self, state):
        layers = torch.arange(32)[None, :, None, None] < state['filled'][:, None, None, None]
        return torch.where(layers.expand(-1, -1, 32, 32), 9.0, -9.0)


@pytest.fixture(scope='module')
def bandit_views(tmp_path_factory):
    """Return one full cube, each of its images a plain red that tells the view's number."""
    images = torch.zeros(1, 24, 64, 64, 4, dtype=torch.uint8)
    images[..., 0] = (10 * torch.arange(24))[None, :, None, None]
    images[..., 3] = 255
    folder = ObjectFolder(tmp_path_factory.mktemp('none'), 'cube', 'cube')
    cameras = cameras_at(AZIMUTHS)
    return ViewSet(images, cameras.poses[None], cameras.intrinsics[None],
                   torch.ones(1, 32, 32, 32, dtype=torch.bool), (folder,))


@torch.no_grad()
def mean_direction(attention):
    """Return where the policy looks after one view, averaged over the 24 first views."""
    proposal, _ = attention(torch.ones(24, 4, 4, 4), torch.tensor(AZIMUTHS, dtype=torch.float32),
                            attention.initial_state(24))
    mean = proposal.mean_azimuth
    return math.atan2(mean.sin().mean(), mean.cos().mean())


def test_reinforce_finds_the_azimuth_that_pays(bandit_views, tmp_path, monkeypatch):
    # Seen from above the cube's layers show as well as in perspective, and at once
    monkeypatch.setattr(policy_gradient, 'project_all', lambda occupancy, frusta: (
        occupancy.amax(dim=3)[:, None].expand(-1, len(frusta), -1, -1)))
    torch.manual_seed(0)
    attention = AttentionModel(latent_channels=1, hidden_channels=8)
    best = mean_direction(attention) + 2.0
    returns = []
    config = TrainingConfig(steps=60, batch_size=24, learning_rate=3e-2, max_views=2,
                            bfloat16=False, warmup_steps=20)
    run = Run(make_fabric(False), tmp_path / 'policy.safetensors',
              lambda step, told: returns.append(told['return']))
    train_policy(Bandit(best), attention, bandit_views, 0.5, config,
                 RewardConfig(distance_weight=0.0), run, lambda model: {})
    after = abs(azimuth_difference(mean_direction(attention), best))
    assert after < math.radians(20)
    assert np.mean(returns[-10:]) > np.mean(returns[:10]) + 0.3


class CutError(Exception):
    """A training that is cut off."""


def train(network, views, tiny, path, cut_after=None, seed=0, threshold=0.1, resume=False):
    torch.manual_seed(seed)
    attention = AttentionModel.from_config(tiny)
    told = []

    def report(step, measured):
        told.append((step, measured))
        if step == cut_after:
            raise CutError

    train_policy(network, attention, views, threshold, CONFIG, RewardConfig(),
                 Run(make_fabric(False), path, report, resume),
                 lambda model: {'validation': 1.0})
    return attention, told


def test_a_policys_training_cut_off_and_resumed_ends_in_the_very_same_weights(
        network, views, tiny, tmp_path):
    before = {name: tensor.clone() for name, tensor in network.state_dict().items()}
    whole, told = train(network, views, tiny, tmp_path / 'whole.safetensors')
    path = tmp_path / 'cut.safetensors'
    with pytest.raises(CutError):
        train(network, views, tiny, path, cut_after=3)
    resumed, later = train(network, views, tiny, path, seed=9, resume=True)
    assert_close(resumed.state_dict(), whole.state_dict(), rtol=0, atol=0)
    assert later == told[2:]
    assert [step for step, measured in told if 'validation' in measured] == [2, 4, 5]
    assert_close(network.state_dict(), before, rtol=0, atol=0)  # frozen throughout
    with pytest.raises(ConfigError, match='made under other settings'):
        train(network, views, tiny, path, threshold=0.2, resume=True)
    network.decoder.grow[0].weight.data += 1
    with pytest.raises(ConfigError, match='made under other settings'):
        train(network, views, tiny, path, resume=True)  # another network was frozen


def test_a_policys_loss_that_is_not_finite_names_its_batch(network, views, tiny, tmp_path):
    network.encoder.to_latent[0].bias.data.fill_(torch.nan)
    with pytest.raises(TrainingDivergedError, match='step 0: the loss is nan on the batch'):
        train(network, views, tiny, tmp_path / 'policy.safetensors')
