"""The joint scheme: both learn, each from its own losses, and a cut training goes on."""

from active_recon.config import LossConfig, RewardConfig
from active_recon.models.attention import AttentionModel
from active_recon.models.network_2d3d import Network2d3d
from active_recon.training.joint import JointLearner, train_jointly
from active_recon.training.loop import make_fabric, Run, TrainingConfig
import numpy as np
import pytest
import torch
from torch.testing import assert_close

CONFIG = TrainingConfig(steps=4, batch_size=4, max_views=3, bfloat16=False, checkpoint_every=2,
                        validate_every=2)


class CutError(Exception):
    """A training that is cut off."""


def train(views, tiny, path, cut_after=None, seed=0, resume=False):
    torch.manual_seed(seed)
    network, attention = Network2d3d.from_config(tiny), AttentionModel.from_config(tiny)
    told = []

    def report(step, measured):
        told.append((step, measured))
        if step == cut_after:
            raise CutError

    train_jointly(network, attention, views, CONFIG, LossConfig(), RewardConfig(),
                  Run(make_fabric(False), path, report, resume), lambda *both: {'validation': 1.0})
    return network, attention, told


def a_step(views, network, attention, **options):
    learner = JointLearner(network, attention, views, LossConfig(**options), RewardConfig(), 3,
                           augment=True)
    return learner(torch.tensor([0, 3, 5]), torch.tensor([2, 9, 23]), np.random.default_rng(0))


def test_both_learn_and_every_part_of_the_reward_is_told(network, attention, views):
    losses = a_step(views, network, attention)
    losses['loss'].backward()
    for module in (network, attention):
        assert any(part.grad is not None and part.grad.any() for part in module.parameters())
    assert {'volume', 'silhouette', 'return', 'reward_3d', 'reward_2d', 'reward_distance',
            'baseline', 'baseline_error', 'azimuth_entropy'} <= set(losses)


def test_the_policys_gradients_do_not_reach_into_the_reconstruction(network, attention, views):
    a_step(views, network, attention)['loss'].backward()
    both = {name: part.grad.clone() for name, part in network.named_parameters()
            if part.grad is not None}
    network.zero_grad(set_to_none=True)
    attention.requires_grad_(False)
    a_step(views, network, attention)['loss'].backward()
    alone = {name: part.grad for name, part in network.named_parameters()
             if part.grad is not None}
    assert_close(alone, both)


@pytest.mark.slow
def test_a_joint_training_cut_off_and_resumed_ends_in_the_very_same_weights(
        views, tiny, tmp_path):
    whole = train(views, tiny, tmp_path / 'whole.safetensors')
    path = tmp_path / 'cut.safetensors'
    with pytest.raises(CutError):
        train(views, tiny, path, cut_after=3)
    resumed = train(views, tiny, path, seed=9, resume=True)
    for before, after in zip(whole[:2], resumed[:2], strict=True):
        assert_close(after.state_dict(), before.state_dict(), rtol=0, atol=0)
    assert resumed[2] == whole[2][2:]
