"""Episodes, IoU view by view, and the latents of other objects."""

from dataclasses import replace

from active_recon.errors import DataError
from active_recon.evaluation.metrics import (
    episodes,
    iou_per_view,
    swapped_objects,
    THRESHOLDS,
)
from active_recon.evaluation.rollouts import nearest_views, roll_out
from active_recon.evaluation.validation import best_threshold, policy_auc, reconstruction_iou
from active_recon.geometry.cameras import azimuth_difference, AZIMUTHS, pose_azimuths
from active_recon.policies.attention import AttentionPolicy
from active_recon.policies.base import Choice
from active_recon.policies.geometric import FarthestPolicy, HeuristicPolicy, RandomPolicy
from active_recon.runtimes.torch import TorchPolicyRuntime
from active_recon.volumes.voxels import iou
import numpy as np
import pytest
import torch
from torch.testing import assert_close


@pytest.mark.parametrize('starts', [1, 4, 24])
def test_each_object_starts_from_so_many_different_views(views, starts):
    objects, first = episodes(views, starts)
    assert objects.tolist() == np.repeat(np.arange(6), starts).tolist()
    for own in first.reshape(6, starts):
        assert len(set(own.tolist())) == starts
        assert set(own.tolist()) <= set(range(24))
    assert episodes(views, starts)[1].equal(first)
    assert starts == 24 or not episodes(views, starts, seed=1)[1].equal(first)


def test_an_object_with_fewer_views_starts_from_each_of_them(views):
    few = replace(views, images=views.images[:, :2], poses=views.poses[:, :2],
                  intrinsics=views.intrinsics[:, :2])
    objects, first = episodes(few, 4)
    assert objects.tolist() == np.repeat(np.arange(6), 2).tolist()
    assert all(sorted(own.tolist()) == [0, 1] for own in first.reshape(6, 2))


@pytest.mark.parametrize('starts', [1, 3, 4, 24])
@pytest.mark.parametrize('count', [2, 3, 6, 17, 67])
def test_no_object_stands_in_for_itself_and_each_does_so_once(count, starts):
    objects = torch.arange(count).repeat_interleave(starts)
    others = swapped_objects(objects, count)
    assert (others != objects).all()
    assert (others.bincount(minlength=count) == starts).all()


def test_a_single_object_has_no_stand_in():
    with pytest.raises(DataError, match='too few objects: expected two or more.*got 1'):
        swapped_objects(torch.zeros(4, dtype=torch.int64), 1)


def test_the_nearest_view_is_the_short_way_round():
    azimuths = np.float32([AZIMUTHS, AZIMUTHS + 0.05])
    assert nearest_views(azimuths, np.array([6.2, -0.1])).tolist() == [0, 23]


class Listener(HeuristicPolicy):
    """A policy that keeps what it was shown, and steps on by 45 degrees."""

    def __init__(self):
        self.latents, self.taken = [], []

    def choose(self, seen, state):
        self.latents.append(seen.latent)
        self.taken.append(pose_azimuths(seen.taken))
        scores = np.zeros(seen.candidates.shape[:2], np.float32)
        return Choice(scores, self.taken[-1][:, -1] + np.pi / 4), state


def rolled_out(network, views, policy, swapped=None, count=3):
    objects, starts = torch.tensor([0, 3, 5]), torch.tensor([23, 4, 9])
    return list(roll_out(network, policy, views, objects, starts, count, swapped))


def test_a_rollout_yields_every_view_and_asks_the_policy_between_them(network, views):
    policy = Listener()
    steps = rolled_out(network, views, policy)
    assert len(steps) == 3
    assert len(policy.latents) == 2
    for t, step in enumerate(steps):
        expected = AZIMUTHS[[23, 4, 9]][:, None] + np.arange(t + 1) * np.pi / 4
        np.testing.assert_allclose(azimuth_difference(step.taken, expected), 0, atol=1e-5)
    np.testing.assert_array_equal(policy.latents[1], steps[1].latent)


def test_a_rollout_knows_what_the_network_knows(network, views):
    steps = rolled_out(network, views, Listener())
    state, objects = network.initial_state(3), torch.tensor([0, 3, 5])
    for t, step in enumerate(steps):
        index = (torch.tensor([23, 4, 9]) + 3 * t) % 24
        with torch.no_grad():
            logits, state = network(views.white(objects, index), views.cameras(objects, index),
                                    state)
        assert_close(step.occupancy, logits.sigmoid())


def test_a_stand_in_is_seen_from_the_same_azimuths_and_changes_only_the_latent(network, views):
    own, swapped, others = Listener(), Listener(), Listener()
    steps = rolled_out(network, views, own)
    blinded = rolled_out(network, views, swapped, torch.tensor([3, 5, 0]))
    list(roll_out(network, others, views, torch.tensor([3, 5, 0]), torch.tensor([23, 4, 9]), 3))
    for t in range(2):
        np.testing.assert_array_equal(swapped.latents[t], others.latents[t])
        assert (swapped.latents[t] != own.latents[t]).any(axis=(1, 2, 3)).all()
        np.testing.assert_array_equal(swapped.taken[t], own.taken[t])
    for step, other in zip(steps, blinded, strict=True):
        assert_close(other.occupancy, step.occupancy)


def test_iou_view_by_view_is_that_of_the_rollout_whatever_the_batch(network, views):
    objects, starts = episodes(views, 2)
    thresholds = np.array([0.05, 0.1])
    values = iou_per_view(network, FarthestPolicy(), views, objects, starts, thresholds, 3, 5)
    whole = iou_per_view(network, FarthestPolicy(), views, objects, starts, thresholds, 3, 64)
    assert values.shape == (12, 3, 2)
    np.testing.assert_allclose(values, whole, atol=2e-3)  # a cell on the threshold may tip
    steps = roll_out(network, FarthestPolicy(), views, objects, starts, 3)
    for t, step in enumerate(steps):
        expected = iou(step.occupancy > 0.1, views.voxels[objects])
        np.testing.assert_allclose(whole[:, t, 1], expected, atol=1e-6)


def test_fewer_episodes_of_a_network_with_a_large_state_run_at_once(network, views, monkeypatch):
    objects, starts = episodes(views, 2)
    small, sizes = network.initial_state, []

    def large(batch):
        sizes.append(batch)
        return small(batch) | {'more': torch.empty(batch, 2 ** 24)}  # 64 MiB

    monkeypatch.setattr(network, 'initial_state', large)
    iou_per_view(network, FarthestPolicy(), views, objects, starts, np.array([0.1]), 1)
    assert sizes[0] == 1 and set(sizes[1:]) == {3}  # a look at the state, then a quarter of a GiB


def test_the_threshold_is_the_best_on_validation(network, views):
    objects, starts = episodes(views, 2)
    values = iou_per_view(network, RandomPolicy(np.random.default_rng(0)), views, objects, starts,
                          THRESHOLDS).mean(axis=(0, 1))
    chosen = THRESHOLDS.tolist().index(best_threshold(network, views))
    assert values[chosen] == values.max()


def test_what_a_training_looks_at_is_the_same_every_time(network, attention, views):
    policy = AttentionPolicy(TorchPolicyRuntime(attention))
    first = reconstruction_iou(network, views) | policy_auc(network, policy, views, 0.1)
    again = reconstruction_iou(network, views) | policy_auc(network, policy, views, 0.1)
    assert first == again
    assert set(first) == {'validation_iou_1', 'validation_iou_5', 'validation_auc',
                          'validation_auc_random'}
    assert all(0 <= value <= 1 for value in first.values())
