"""All policies on one network: what is told of each, and of what lies between them."""

from contextlib import contextmanager
import json
import math

from active_recon.errors import ConfigError, ViewError, WeightsError
from active_recon.evaluation.contenders import contender_names, contenders
from active_recon.evaluation.measure import Episodes
from active_recon.evaluation.policy_study import compare, decision_ms, policy_study, run_all
from active_recon.evaluation.statistics import by_object
from active_recon.evaluation.subsets import drawn_over_categories
from active_recon.evaluation.trial import Contender, Trial
from active_recon.models.attention import AttentionModel
from active_recon.policies.geometric import FarthestPolicy
import numpy as np
import pytest
from shown_views import part_of
import torch


@pytest.fixture
def attentions(attention, tiny):
    """Return the models of two seeds."""
    torch.manual_seed(1)
    return [attention, AttentionModel.from_config(tiny).eval()]


@pytest.fixture
def few(views):
    """Return the six objects with every sixth view alone."""
    return part_of(views, chosen=slice(None, None, 6))


@pytest.fixture(scope='module')
def finished_runs(tmp_path_factory):
    """Return a folder: what one test has run the others find there."""
    return tmp_path_factory.mktemp('runs')


@pytest.fixture
def trial(network, few, finished_runs):
    """Return a trial of all six objects, each from two views."""
    return Trial(network, 0.1, few, 2, 3, cache=finished_runs)


def some_episodes(ious):
    return Episodes(ious, np.ones_like(ious), np.ones_like(ious), np.zeros_like(ious))


class Listener:
    """Reporting that is kept."""

    def __init__(self):
        self.told = {}

    @contextmanager
    def __call__(self, title, total):
        done = []
        yield lambda steps, note: done.append(steps)
        self.told[title] = (sum(done), total)


def test_the_study_tells_everything_of_every_policy_and_json_holds_it(trial, attentions):
    found = policy_study(trial, attentions, seeds=2, subset_objects=4)
    assert json.loads(json.dumps(found, allow_nan=False)) == found
    assert set(found['policies']) == set(contender_names())
    assert {name: figures['seeds'] for name, figures in found['policies'].items()} == {
        'random': 2, 'uniform': 1, 'farthest': 1, 'attention': 2, 'oracle': 1}
    for name, figures in found['policies'].items():
        assert len(figures['iou']) == len(figures['entropy']) == 3
        assert set(figures['auc_above']) == {'random', 'uniform', 'farthest'} - {name}
        assert (figures['decision_ms'] is None) == (name == 'oracle')
        assert set(figures['per_category_iou']) == {'lamp', 'table'}
    assert (found['objects'], found['episodes']) == (6, 12)
    assert found['identity'] == trial.identity
    assert found['headroom_sentence'].startswith('An oracle that sees the truth')


def test_the_share_of_random_is_none_that_of_the_oracle_all_and_between_it_is_measured(trial):
    rng = np.random.default_rng(0)
    random = rng.random((12, 3))
    oracle = random + rng.uniform(0.1, 0.3, (12, 1))
    found = compare(trial, {
        'random': [some_episodes(random), some_episodes(random[:, ::-1])],
        'uniform': [some_episodes(0.75 * random + 0.25 * oracle)],
        'oracle': [some_episodes(oracle)]})
    shares = {name: figures['gap_closed'] for name, figures in found['policies'].items()}
    assert list(shares['random'].values()) == pytest.approx([0, 0, 0])
    assert list(shares['uniform'].values()) == pytest.approx([0.25, 0.25, 0.25])
    assert list(shares['oracle'].values()) == pytest.approx([1, 1, 1])
    assert 'can gain at most' in found['headroom_sentence']


def test_where_there_is_no_headroom_there_is_no_share_and_that_is_said(trial):
    alike = [some_episodes(np.random.default_rng(0).random((12, 3)))]
    found = compare(trial, {'random': alike, 'oracle': alike})
    assert found['policies']['random']['gap_closed'] is None
    assert 'no policy can gain anything' in found['headroom_sentence']


def test_a_study_without_attention_or_sequences_leaves_them_out(trial):
    found = policy_study(trial, seeds=1, subset_objects=0)
    assert set(found['policies']) == {'random', 'uniform', 'farthest', 'oracle'}
    assert 'best_subset' not in found


def test_headroom_is_the_oracle_s_area_above_random_s(trial):
    runs = run_all(trial, contenders(['random', 'oracle'], seeds=2))
    found = compare(trial, runs)
    random = np.mean([run.auc.mean() for run in runs['random']])
    assert found['headroom']['mean'] == pytest.approx(runs['oracle'][0].auc.mean() - random)
    assert found['headroom'] == found['policies']['oracle']['auc_above']['random']


def test_without_an_oracle_nothing_is_said_of_a_gap(trial):
    found = compare(trial, run_all(trial, contenders(['random', 'uniform'], seeds=1)))
    assert set(found) == {'policies'}
    assert 'gap_closed' not in found['policies']['random']


def test_no_sequence_of_three_is_better_than_the_best(trial):
    found = policy_study(trial, seeds=2, subset_objects=6)['best_subset']
    assert (found['objects'], found['views']) == (6, 3)
    assert found['best']['mean'] >= found['best_from_start']['mean']
    assert found['best_from_start']['mean'] >= found['policies']['oracle']['mean'] - 2e-3
    assert found['best_from_start']['mean'] > found['expected_at_random']['mean']
    assert found['oracle_lacks']['mean'] == pytest.approx(
        found['best_from_start']['mean'] - found['policies']['oracle']['mean'])


@pytest.mark.slow
def test_random_s_mean_is_that_of_all_sequences_that_begin_as_it_did(trial):
    runs = run_all(trial, contenders(['random'], seeds=12))
    ious = np.stack([by_object(run.iou[:, 2], trial.objects.numpy()) for run in runs['random']])
    found = policy_study(trial, seeds=1, subset_objects=6)['best_subset']['expected_at_random']
    doubt = ious.std(axis=0).mean() / np.sqrt(12)
    assert ious.mean() == pytest.approx(found['mean'], abs=4 * doubt)


def test_a_study_that_is_run_again_runs_nothing(trial, attentions, monkeypatch):
    found = policy_study(trial, attentions, seeds=2, subset_objects=2)
    for name in ('run_policy', 'run_oracle'):
        monkeypatch.setattr(f'active_recon.evaluation.trial.{name}', None)
    monkeypatch.setattr('active_recon.evaluation.subsets.sequence_iou', None)
    again = policy_study(trial, attentions, seeds=2, subset_objects=2)
    for figures in (*found['policies'].values(), *again['policies'].values()):
        del figures['decision_ms']
    assert again == found


def test_every_run_is_reported_to_its_end(network, few, attention, tmp_path):
    listener, trial = Listener(), Trial(
        network, 0.1, part_of(few, objects=slice(2, 4)), 2, 3, cache=tmp_path)
    policy_study(trial, [attention], seeds=2, subset_objects=2, reporting=listener)
    assert len(listener.told) == 7
    assert {'random-0', 'random-1', 'uniform', 'farthest', 'oracle'} < set(listener.told)
    assert all(done == total for done, total in listener.told.values())


class Fails(FarthestPolicy):
    """A policy with a fault of its own."""

    def choose(self, seen, state):
        return 1 / 0


def test_of_several_policies_the_one_that_fails_is_named(trial):
    with pytest.raises(ViewError, match='^mine: policy: fails with ZeroDivisionError'):
        run_all(trial, [Contender('mine', 'mine', lambda rng: Fails())])


def test_a_decision_takes_a_time_and_the_oracle_s_is_not_told(trial, attention):
    every = contenders(contender_names(), [attention], 3, seeds=1)
    times = {contender.policy: decision_ms(trial, contender) for contender in every}
    assert times.pop('oracle') is None
    assert all(0 < spent < math.inf for spent in times.values())


def test_a_policy_that_there_is_not_is_refused(attention):
    with pytest.raises(ConfigError, match="no such policy: expected some of random.*got 'best'"):
        contenders(['random', 'best'])
    with pytest.raises(WeightsError, match='no view policy: expected weights that contain one'):
        contenders(['attention'])


@pytest.mark.parametrize('count', [1, 4, 7, 100])
def test_objects_are_drawn_evenly_over_the_categories(count):
    names = np.array(['car'] * 20 + ['lamp'] * 2 + ['table'] * 9)
    drawn = drawn_over_categories(names, count)
    assert len(drawn) == len(set(drawn.tolist())) == min(count, 31)
    numbers = [(names[drawn] == name).sum() for name in ('car', 'lamp', 'table')]
    if count <= 7:
        assert max(numbers) - min(numbers) <= 1
    np.testing.assert_array_equal(drawn, drawn_over_categories(names, count))
