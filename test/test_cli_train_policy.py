"""`active-recon train-policy`, from the command line to a policy that chooses."""

import json
import shutil

from active_recon.datasets.drawn_cameras import Viewing
from active_recon.datasets.making import make_dataset, shape_jobs
from active_recon.errors import WeightsError
from active_recon.models.scorer_weights import save_scorer
from active_recon.models.view_scorer import ScorerConfig, ViewScorer
from active_recon.models.weights_files import find_weights
from active_recon.policies import load_policy, PolicyOptions
from command_line import command, refusal
import numpy as np
import pytest
from safetensors.numpy import load_file
from small_datasets import lamps_and_tables
import torch


@pytest.fixture(autouse=True)
def as_many_threads_as_before():
    before = torch.get_num_threads()
    yield
    torch.set_num_threads(before)


@pytest.fixture(scope='module')
def dataset(tmp_path_factory):
    """Return a folder of two lamps and two tables, so that two rounds see different ones."""
    return lamps_and_tables(tmp_path_factory.mktemp('dataset'), 2)


@pytest.fixture
def weights(tmp_path):
    """Return weights of carving in a folder of their own, without a scorer."""
    for file in find_weights('carving').parent.glob('carving.*'):
        shutil.copy(file, tmp_path)
    return tmp_path / 'carving.safetensors'


def test_a_policy_is_learned_in_two_rounds_and_chooses(
        dataset, weights, tmp_path, monkeypatch, capsys):
    arguments = [dataset, '--validation', dataset, '--model', weights, '--out', tmp_path / 'run',
                 '--objects', 2, '--candidates', 4, '--starts', 1, '--views', 3, '--epochs', 2,
                 '--threads', 1]
    assert command(monkeypatch, 'train-policy', *arguments) == 0
    assert '4 of 4 validation objects are trained on too' in capsys.readouterr().err
    made = tmp_path / 'run' / 'carving-scorer.safetensors'
    card = json.loads(made.with_suffix('.json').read_text())
    assert len(card['rounds']) == 2 and card['rounds'][1]['train_states'] >= 4
    rounds = [sorted(file.name for file in (tmp_path / 'run' / f'gains-{number}').rglob('*.npz'))
              for number in (1, 2)]
    assert len(rounds[0]) == len(rounds[1]) == 2 and not set(rounds[0]) & set(rounds[1])
    for file in made.parent.glob('carving-scorer.*'):
        shutil.copy(file, weights.parent)
    assert load_policy('attention', PolicyOptions(weights=weights)).wants_volume
    written = load_file(made)
    before = {file: file.stat().st_mtime_ns for file in (tmp_path / 'run').rglob('*.npz')}
    made.unlink()
    assert command(monkeypatch, 'train-policy', *arguments) == 0  # nothing is measured again
    assert before == {file: file.stat().st_mtime_ns
                      for file in (tmp_path / 'run').rglob('*.npz')}
    np.testing.assert_equal(load_file(made), written)
    made.unlink()
    assert command(monkeypatch, 'train-policy', *arguments, '--model', 'named=carving') == 0
    np.testing.assert_equal(load_file(made), written)
    assert command(monkeypatch, 'train-policy', *arguments, '--candidates', 5) == 2
    assert 'candidates: expected 4 as before, got 5; name another' in capsys.readouterr().err
    # Their views would be chosen by another scorer
    assert command(monkeypatch, 'train-policy', *arguments, '--init-from', made) == 2
    assert "begun_with: expected '' as before" in capsys.readouterr().err
    assert command(monkeypatch, 'train-policy', *arguments, '--epochs', 3) == 2
    assert 'epochs: expected 2 as before, got 3' in capsys.readouterr().err
    other = shutil.copytree(dataset, tmp_path / 'other')
    assert command(monkeypatch, 'train-policy', other, *arguments) == 2
    assert f"data: expected ['{dataset}'] as before, got [" in capsys.readouterr().err
    assert command(monkeypatch, 'train-policy', *arguments, '--model', 'lifting') == 2
    assert 'network_sha256: expected' in capsys.readouterr().err
    assert command(monkeypatch, 'policies', dataset, '--model', weights, '--policies',
                   'random,attention', '--objects', 2, '--starts', 1, '--seeds', 1, '--views', 3,
                   '--threads', 1, '--out', tmp_path) == 0
    assert '| attention |' in (tmp_path / 'policies.md').read_text()


def test_a_policy_follows_a_network_that_was_trained_further(
        dataset, weights, tmp_path, monkeypatch, capsys):
    earlier = tmp_path / 'earlier-scorer.safetensors'
    torch.manual_seed(1)
    save_scorer(earlier, ViewScorer.from_config(ScorerConfig()), ScorerConfig(), 'a' * 64, {})
    arguments = [dataset, '--validation', dataset, '--model', weights, '--objects', 2,
                 '--candidates', 4, '--starts', 1, '--views', 3, '--epochs', 1, '--threads', 1,
                 '--rounds', 1, '--learning-rate', 1e-9]
    assert command(monkeypatch, 'train-policy', *arguments, '--init-from', earlier, '--out',
                   tmp_path / 'run') == 0
    begun, learned = (load_file(file) for file in (
        earlier, tmp_path / 'run' / 'carving-scorer.safetensors'))
    for name in begun:
        if name.endswith(('weight', 'bias')):
            np.testing.assert_allclose(learned[name], begun[name], atol=1e-6)
    assert command(monkeypatch, 'train-policy', *arguments, '--init-from', weights, '--out',
                   tmp_path / 'other') == 2
    assert 'no view scorer' in capsys.readouterr().err
    other = ScorerConfig(hidden=8)
    save_scorer(earlier, ViewScorer.from_config(other), other, 'a' * 64, {})
    assert command(monkeypatch, 'train-policy', *arguments, '--init-from', earlier, '--out',
                   tmp_path / 'other') == 2
    assert 'of other sizes' in capsys.readouterr().err
    assert not (tmp_path / 'other').exists()


def test_objects_whose_gains_cannot_be_measured_are_told_with_the_reason(
        dataset, weights, tmp_path, monkeypatch, capsys):
    data = shutil.copytree(dataset, tmp_path / 'data')
    for voxels in data.glob('ShapeNetVox*/lamp/*0/model.binvox'):
        voxels.write_text('bad')
    assert command(monkeypatch, 'train-policy', data, '--validation', dataset, '--model', weights,
                   '--candidates', 3, '--starts', 1, '--views', 2, '--epochs', 1, '--threads', 1,
                   '--rounds', 1, '--out', tmp_path / 'run') == 0
    told = capsys.readouterr().err
    assert 'left out: ' in told and 'model.binvox: no readable' in told
    assert f'gains of {data}, round 1: 3 read, 0 missing, 1 left out' in told


def test_a_training_without_validation_objects_is_refused_before_gains_are_measured(
        dataset, weights, tmp_path, monkeypatch, capsys):
    (tmp_path / 'empty' / 'ShapeNetRendering').mkdir(parents=True)
    assert 'a dataset without objects: expected one or more' in refusal(
        monkeypatch, capsys, 'train-policy', dataset, '--validation', tmp_path / 'empty',
        '--model', weights, '--out', tmp_path / 'run')
    assert not (tmp_path / 'run').exists()


def test_a_folder_of_a_training_that_cannot_be_written_is_told_in_plain_words(
        dataset, weights, monkeypatch, capsys):
    assert f'{weights}/run/carving-scorer.safetensors: cannot be written: expected a folder' in (
        refusal(monkeypatch, capsys, 'train-policy', dataset, '--validation', dataset, '--model',
                weights, '--out', weights / 'run'))


def test_weights_without_a_scorer_have_no_learned_policy(weights):
    with pytest.raises(WeightsError, match='no view policy'):
        load_policy('attention', PolicyOptions(weights=weights))


def test_a_network_that_needs_the_front_is_refused(dataset, tmp_path, monkeypatch, capsys):
    assert command(monkeypatch, 'train-policy', dataset, '--validation', dataset, '--model',
                   '2d3d', '--out', tmp_path, '--threads', 1) == 2
    assert 'expected one that takes any cameras' in capsys.readouterr().err


def test_objects_of_two_views_have_no_gains_to_choose_by(weights, tmp_path, monkeypatch, capsys):
    list(make_dataset(shape_jobs('lamp', range(2), tmp_path / 'few'), 1,
                      viewing=Viewing('any', 2)))
    assert command(monkeypatch, 'train-policy', tmp_path / 'few', '--validation',
                   tmp_path / 'few', '--model', weights, '--out', tmp_path / 'run',
                   '--threads', 1) == 2
    said = capsys.readouterr().err
    assert 'no object whose gains can be measured: expected one or more with voxels and 3' in said
