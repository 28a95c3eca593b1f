"""The greedy oracle and every sequence of views, against doing it one by one."""

from dataclasses import replace
from itertools import permutations

from active_recon.evaluation.measure import run_oracle, run_policy
from active_recon.evaluation.metrics import episodes
from active_recon.evaluation.oracle import roll_out_oracle, rows_of, sequence_iou
from active_recon.evaluation.rollouts import nearest_views, roll_out
from active_recon.policies.base import Choice
from active_recon.policies.geometric import HeuristicPolicy, RandomPolicy
from active_recon.volumes.voxels import iou
import numpy as np
import pytest
from shown_views import part_of
import torch
from torch.testing import assert_close

THRESHOLD = 0.1


class Itinerary(HeuristicPolicy):
    """A policy that goes where it was told before."""

    def __init__(self, azimuths):
        self.azimuths = azimuths

    def choose(self, seen, state):
        scores = np.zeros(seen.candidates.shape[:2], np.float32)
        return Choice(scores, self.azimuths[:, seen.taken.shape[1]]), state


@pytest.fixture(scope='module')
def few(views):
    """Return the six objects with every fourth view alone: six."""
    return part_of(views, chosen=slice(None, None, 4))


def iou_along(network, views, item, sequences):
    """Return the IoU of an object after every view of sequences (P, t)."""
    azimuths = views.azimuths[item].double().numpy()[sequences]
    steps = roll_out(network, Itinerary(azimuths), views, torch.full((len(sequences),), item),
                     torch.from_numpy(sequences[:, 0]), sequences.shape[1])
    truth = views.voxels[item].expand(len(sequences), -1, -1, -1)
    return np.stack([iou(step.occupancy > THRESHOLD, truth).numpy() for step in steps], axis=1)


def test_rows_of_a_state_are_taken_of_all_that_it_holds():
    state = {'cells': torch.arange(12).reshape(4, 3), 'views': torch.arange(4)}
    found = rows_of(state, torch.tensor([2, 2, 0]))
    assert_close(found['cells'], state['cells'][[2, 2, 0]])
    assert found['views'].tolist() == [2, 2, 0]


def test_the_oracle_goes_where_the_iou_is_highest_of_all_views_not_yet_taken(network, few):
    objects, starts = torch.tensor([0, 4]), torch.tensor([5, 2])
    steps = list(roll_out_oracle(network, few, objects, starts, 3, THRESHOLD))
    azimuths = few.azimuths[0].numpy()
    for row, item in enumerate(objects.tolist()):
        taken = [int(starts[row])]
        for step in steps[1:]:
            fresh = [view for view in range(6) if view not in taken]
            after = iou_along(network, few, item, np.array([[*taken, view] for view in fresh]))
            chosen = int(nearest_views(azimuths[None], step.taken[row:row + 1, -1])[0])
            assert chosen in fresh
            assert after[fresh.index(chosen), -1] == pytest.approx(after[:, -1].max(), abs=2e-3)
            taken.append(chosen)


def test_the_oracle_s_steps_are_those_of_a_rollout_along_its_way(network, few):
    objects, starts = torch.tensor([1, 3, 5]), torch.tensor([0, 5, 3])
    steps = list(roll_out_oracle(network, few, objects, starts, 4, THRESHOLD))
    again = roll_out(network, Itinerary(steps[-1].taken), few, objects, starts, 4)
    for own, other in zip(steps, again, strict=True):
        assert_close(own.occupancy, other.occupancy, atol=1e-4, rtol=1e-3)
        assert_close(own.latent, other.latent, atol=1e-4, rtol=1e-3)
        np.testing.assert_array_equal(own.taken, other.taken)


def test_the_oracle_takes_every_view_once_and_then_ends(network, few):
    steps = list(roll_out_oracle(network, few, torch.tensor([2]), torch.tensor([1]), 9,
                                 THRESHOLD))
    assert len(steps) == 6
    assert len(set(steps[-1].taken[0])) == 6


def test_the_oracle_s_episodes_have_the_form_of_a_policy_s_and_the_second_view_is_the_best(
        network, few):
    objects, starts = episodes(few, 2)
    told = []
    oracle = run_oracle(network, few, objects, starts, THRESHOLD, 2, progress=told.append)
    random = run_policy(network, RandomPolicy(np.random.default_rng(0)), few, objects, starts,
                        THRESHOLD, 2)
    assert sum(told) == 12
    for name in ('iou', 'entropy', 'paper_entropy', 'azimuths'):
        assert getattr(oracle, name).shape == getattr(random, name).shape == (12, 2)
    np.testing.assert_allclose(oracle.iou[:, 0], random.iou[:, 0], atol=2e-3)
    np.testing.assert_array_equal(oracle.azimuths[:, 0], random.azimuths[:, 0])
    assert (oracle.iou[:, 1] > random.iou[:, 1] - 2e-3).all()


@pytest.mark.parametrize('length', [1, 2, 3])
def test_every_sequence_has_the_iou_of_its_rollout_and_no_view_comes_twice(network, few, length):
    table = sequence_iou(network, few, 4, THRESHOLD, length)
    assert table.shape == (6,) * length
    sequences = np.array(list(permutations(range(6), length)))
    assert np.isfinite(table).sum() == len(sequences)
    sequences = np.random.default_rng(0).permutation(sequences)[:30]
    expected = iou_along(network, few, 4, sequences)[:, -1]
    np.testing.assert_allclose(table[tuple(sequences.T)], expected, atol=2e-3)


def test_longer_sequences_than_there_are_views_repeat_one(network, few):
    pair = replace(few, images=few.images[:, :2], poses=few.poses[:, :2],
                   intrinsics=few.intrinsics[:, :2])
    assert np.isnan(sequence_iou(network, pair, 0, THRESHOLD, 3)).all()


def test_no_way_of_the_oracle_is_better_than_the_best_sequence(network, few):
    best = np.nanmax(sequence_iou(network, few, 0, THRESHOLD), axis=(1, 2))
    greedy = run_oracle(network, few, torch.zeros(6, dtype=torch.long), torch.arange(6),
                        THRESHOLD, 3)
    assert (greedy.iou[:, 2] <= best + 2e-3).all()
