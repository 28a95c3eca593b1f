"""What is said of a network and its policies."""

import csv
import json
import math

from active_recon.errors import DataError, WeightsError
from active_recon.evaluation.ablations import iou_by_yaw, latent_swap_ablation, YAWS_DEG
from active_recon.evaluation.measure import Episodes, interval, joined, run_policy, summary
from active_recon.evaluation.metrics import episodes, iou_per_view
from active_recon.evaluation.paired import write_rows
from active_recon.evaluation.trial import Trial
from active_recon.models.network import ReconstructionNetwork
from active_recon.policies.attention import AttentionPolicy
from active_recon.policies.geometric import FarthestPolicy, UniformPolicy
from active_recon.runtimes.torch import TorchPolicyRuntime
from active_recon.volumes.voxels import entropy, paper_entropy, turned
import numpy as np
import pytest
from recorded_messages import small_disk
from shown_views import part_of
import torch
from torch import nn


def some_episodes(azimuths, ious):
    ious = np.array(ious, float)
    return Episodes(ious, np.ones_like(ious), np.ones_like(ious), np.array(azimuths, float))


def test_the_area_under_the_curve_is_the_mean_over_the_views():
    found = some_episodes([[0, 1], [0, 2]], [[0.2, 0.6], [0.5, 0.5]])
    np.testing.assert_allclose(found.auc, [0.4, 0.5])


def test_the_rotation_goes_the_short_way_from_view_to_view():
    azimuths = [[0.1, math.tau - 0.1, 0.1], [0.0, 2.0, 4.0], [0.0, math.pi, 0.0]]
    found = some_episodes(azimuths, np.zeros((3, 3)))
    np.testing.assert_allclose(found.rotation, [0.4, 4.0, math.tau])


def test_rows_tell_azimuths_just_beside_0_as_0(network, views, tmp_path):
    trial = Trial(network, 0.1, part_of(views, slice(1)), starts=1, count=3)
    run = some_episodes([[-0.0, math.tau - 1e-6, math.tau - 0.01]], np.zeros((1, 3)))
    write_rows(tmp_path / 'rows.csv', {'one': (trial, {'uniform': [run]})})
    with (tmp_path / 'rows.csv').open() as file:
        assert [row['azimuth_deg'] for row in csv.DictReader(file)] == ['0.0', '0.0', '359.4']


def test_rows_that_a_full_disk_does_not_hold_leave_those_that_were_there(
        network, views, tmp_path):
    trial = Trial(network, 0.1, part_of(views, slice(1)), starts=1, count=3)
    run = some_episodes(np.zeros((1, 3)), np.zeros((1, 3)))
    path = tmp_path / 'rows.csv'
    path.write_text('those of before')
    with small_disk(50), pytest.raises(OSError):
        write_rows(path, {'one': (trial, {'uniform': [run]})})
    assert path.read_text() == 'those of before' and list(tmp_path.iterdir()) == [path]


def test_a_run_measures_iou_both_entropies_and_azimuths_of_every_view(network, views):
    objects, starts = episodes(views, 2)
    told = []
    run = run_policy(network, UniformPolicy(3), views, objects, starts, 0.1, 3,
                     progress=told.append)
    assert run.iou.shape == run.entropy.shape == run.paper_entropy.shape == (12, 3)
    assert run.azimuths.shape == (12, 3)
    assert sum(told) == 12
    np.testing.assert_allclose(run.rotation, 4 * math.pi / 3, atol=1e-5)
    expected = iou_per_view(network, UniformPolicy(3), views, objects, starts, np.array([0.1]), 3)
    np.testing.assert_allclose(run.iou, expected[..., 0])
    with torch.no_grad():
        logits, _ = network(views.white(objects[:1], starts[:1]),
                            views.cameras(objects[:1], starts[:1]), network.initial_state(1))
    occupancy = logits[0].sigmoid().double().numpy()
    assert run.entropy[0, 0] == pytest.approx(entropy(occupancy), rel=1e-4)
    assert run.paper_entropy[0, 0] == pytest.approx(paper_entropy(occupancy), rel=1e-4)
    assert (run.paper_entropy < run.entropy).all()


def test_a_network_that_gives_nan_is_refused_and_not_measured_as_nothing(
        network, views, monkeypatch):
    decode = network.decode
    monkeypatch.setattr(network, 'decode', lambda state: decode(state) * math.nan)
    with pytest.raises(WeightsError, match='not finite: expected an occupancy of finite numbers'):
        run_policy(network, UniformPolicy(2), views, *episodes(views, 1), 0.1, 2)


@pytest.mark.slow
def test_a_run_longer_than_a_batch_is_the_same_as_its_parts(network, views):
    objects, starts = episodes(views, 24)  # 144: one batch and a bit
    whole = run_policy(network, FarthestPolicy(), views, objects, starts, 0.1, 2)
    tail = run_policy(network, FarthestPolicy(), views, objects[128:], starts[128:], 0.1, 2)
    np.testing.assert_allclose(whole.iou[128:], tail.iou, atol=2e-3)
    np.testing.assert_array_equal(whole.azimuths[128:], tail.azimuths)


def test_episodes_in_parts_are_joined_in_their_order():
    first, second = some_episodes([[0, 1]], [[0.2, 0.6]]), some_episodes([[0, 2]], [[0.5, 0.4]])
    whole = joined([first, second])
    np.testing.assert_array_equal(whole.iou, [[0.2, 0.6], [0.5, 0.4]])
    np.testing.assert_array_equal(whole.azimuths, [[0, 1], [0, 2]])


def test_a_summary_is_ready_for_json_and_averages_over_objects_starts_and_seeds(views):
    objects = torch.tensor([0, 0, 3, 3])
    runs = [some_episodes([[0, 1]] * 4, [[0.1, 0.3], [0.3, 0.5], [0.6, 0.8], [0.8, 1.0]]),
            some_episodes([[0, 2]] * 4, [[0.2, 0.2], [0.4, 0.4], [0.6, 0.6], [0.8, 0.8]])]
    told = json.loads(json.dumps(summary(runs, views, objects)))
    assert told['seeds'] == 2
    assert [value['mean'] for value in told['iou']] == pytest.approx([0.475, 0.575])
    assert all(value['low'] < value['mean'] < value['high'] for value in told['iou'])
    per_category = {name: [value['mean'] for value in values]
                    for name, values in told['per_category_iou'].items()}
    assert per_category == {'lamp': pytest.approx([0.25, 0.35]),
                            'table': pytest.approx([0.7, 0.8])}
    assert told['auc']['mean'] == pytest.approx(0.525)
    assert told['rotation']['mean'] == pytest.approx(1.5)
    assert told['entropy'] == [{'mean': 1.0, 'low': 1.0, 'high': 1.0}] * 2


class Oracle(ReconstructionNetwork):
    """Answers with the truth of the object whose image it is shown, turned as it is told."""

    image_size, resolution, needs_front = 64, 32, True

    def __init__(self, views, listens=False):
        super().__init__()
        self.views, self.listens = views, listens
        every = torch.arange(24)
        self.known = torch.stack([views.white(torch.full((24,), item), every)
                                  for item in range(len(views))])

    def initial_state(self, batch):
        return {'answer': torch.zeros(batch, 2), 'latent': torch.zeros(batch, 8, 4, 4)}

    def encode(self, images, cameras):
        return images

    def update(self, encoded, cameras, state):
        away = [(self.known - image).abs().mean((2, 3, 4)) for image in encoded]
        item = torch.stack([each.amin(dim=1).argmin() for each in away])
        seen_from = torch.stack([each.amin(dim=0).argmin() for each in away])
        yaw = cameras.azimuths - self.views.azimuths[item, seen_from]
        latent = torch.ones(len(encoded), 8, 4, 4) * (item.float() + 1)[:, None, None, None]
        return {'latent': latent,
                'answer': torch.column_stack([item, yaw if self.listens else 0 * yaw])}

    def decode(self, state):
        return torch.stack([
            torch.from_numpy(20 * turned(self.views.voxels[int(item)].float().numpy(),
                                         float(yaw)) - 10) for item, yaw in state['answer']])


def test_a_front_that_stands_right_gives_the_plain_iou(network, views):
    objects, starts = episodes(views, 2)
    found = iou_by_yaw(network, views, objects, starts, 0.1)
    plain = iou_per_view(network, FarthestPolicy(), views, objects, starts, np.array([0.1]), 1)
    assert list(found) == [str(yaw) for yaw in YAWS_DEG]
    assert found['0'] == pytest.approx(interval(plain[:, 0, 0], objects))


def test_a_perfect_answer_loses_by_every_degree_that_the_front_stands_wrong(views):
    objects, starts = episodes(views, 2)
    found = iou_by_yaw(Oracle(views), views, objects, starts, 0.5)
    assert found['0']['mean'] == 1
    assert 1 > found['5']['mean'] > found['15']['mean'] > found['30']['mean']


def test_a_network_that_looks_at_the_azimuth_is_told_the_wrong_one_with_the_wrong_front(views):
    objects, starts = episodes(views, 2)
    found = iou_by_yaw(Oracle(views, listens=True), views, objects, starts, 0.5)
    assert all(value['mean'] > 0.99 for value in found.values())


class Recognising(nn.Module):
    """An attention model whose proposal is the latent's first number, or nothing of it."""

    facts = {'view_separation': 0.0, 'latent_shape': (8, 4, 4)}

    def __init__(self, sees):
        super().__init__()
        self.where = nn.Linear(2, 8)
        self.sees = sees

    def initial_state(self, batch):
        return {}

    def forward(self, latent, azimuth, state):
        from active_recon.models.attention import Attention
        mean = latent[:, 0, 0, 0] * np.radians(20) if self.sees else azimuth + 1
        return Attention(mean, mean), state


def followed(model):
    """Return the policy that follows an attention model."""
    return AttentionPolicy(TorchPolicyRuntime(model))


def test_a_policy_that_looks_at_nothing_loses_nothing_by_anothers_latent(network, views):
    objects, starts = episodes(views, 2)
    blind = followed(Recognising(sees=False))
    found = latent_swap_ablation(network, blind, views, objects, starts, 0.1, 3)
    assert found.goal_change_deg['mean'] == pytest.approx(0, abs=1e-9)
    assert found.auc_loss == {'mean': 0.0, 'low': 0.0, 'high': 0.0}
    assert found.auc == found.auc_swapped


def test_a_policy_that_knows_its_object_goes_elsewhere_by_anothers_latent(views):
    objects, starts = episodes(views, 3)
    found = latent_swap_ablation(Oracle(views), followed(Recognising(sees=True)), views, objects,
                      starts, 0.5, 2)
    assert found.goal_change_deg['mean'] == pytest.approx(60, abs=1e-3)  # three objects away
    assert found.goal_change_deg['low'] == pytest.approx(60, abs=1e-3)
    assert found.auc['mean'] == 1


def test_the_latent_swap_ablation_needs_two_objects(network, attention, views):
    one = part_of(views, slice(1))
    with pytest.raises(DataError, match='too few objects: expected two or more'):
        latent_swap_ablation(network, followed(attention), one, *episodes(one, 2), 0.1)
