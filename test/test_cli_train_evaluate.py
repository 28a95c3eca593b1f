"""`active-recon train` and `evaluate`, from the command line to the files that they write."""

from contextlib import redirect_stderr, redirect_stdout
import csv
from io import StringIO
import json
import math
import shutil

from active_recon.cli.bf16_option import trained_in_bf16
from active_recon.errors import DataError
from active_recon.models.network_2d3d import SIZES
from active_recon.models.weights import load_weights
from active_recon.models.weights_files import PAPER_MODEL, weights_hash
from command_line import command, refusal
import pytest
from recorded_messages import small_disk
from safetensors.torch import load_file
from small_datasets import lamps_and_tables
import torch
from torch.testing import assert_close


@pytest.fixture(scope='module')
def dataset(tmp_path_factory):
    """Return a folder of a lamp and a table: what is measured takes as long as its objects."""
    return lamps_and_tables(tmp_path_factory.mktemp('dataset'), 1)


@pytest.fixture(scope='module', autouse=True)
def small_is_tiny(tiny):
    """Let the small size of the networks of the paper be one that is trained in no time."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(SIZES, 'small', tiny)
        yield


@pytest.fixture(autouse=True)
def as_many_threads_as_before():
    before = torch.get_num_threads()
    yield
    torch.set_num_threads(before)


def reconstructing(dataset, out, *more):
    return ('train', dataset, '--validation', dataset, '--out', out, '--steps', 2,
            '--batch-size', 2, '--threads', 1, *more)


def training(dataset, out, *more):
    return reconstructing(dataset, out, '--policy-steps', 2, '--policy-batch-size', 2,
                          '--group-size', 2, *more)


@pytest.fixture(scope='module')
def run(dataset, tmp_path_factory):
    """Return the folder of a short training."""
    out = tmp_path_factory.mktemp('run')
    with pytest.MonkeyPatch.context() as patch:
        assert command(patch, *training(dataset, out)) == 0
    return out


@pytest.fixture(scope='module')
def plain(dataset, tmp_path_factory):
    """Return the folder of a training without a policy, and what it told, on both streams."""
    out = tmp_path_factory.mktemp('plain')
    copied = shutil.copytree(dataset, out / 'copy')
    told, warned = StringIO(), StringIO()
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(told), redirect_stderr(warned):
        assert command(patch, *reconstructing(
            dataset, out, '--policy-steps', 0, '--silhouette-weight', 0, '--validation',
            copied)) == 0
    return out, told.getvalue(), warned.getvalue()


def test_a_training_writes_checkpoints_a_log_and_weights_with_a_card(run, dataset):
    assert {path.name for path in run.iterdir()} == {
        'reconstruction.safetensors', 'policy.safetensors', 'tensorboard', 'weights.safetensors',
        'weights.json'}
    assert {path.parent.name for path in (run / 'tensorboard').rglob('events.*')} == {
        'reconstruction', 'policy'}
    bundle = load_weights(run / 'weights.safetensors')
    card = json.loads((run / 'weights.json').read_text())
    assert card['threshold'] == bundle.threshold
    assert card['command'].startswith('active-recon train ')
    assert card['data'] == {str(dataset): 2}
    assert card['reconstruction']['steps'] == card['policy']['steps'] == 2
    assert card['reconstruction']['silhouette_weight'] == 0.6
    assert card['reconstruction']['bfloat16'] is trained_in_bf16(None)
    assert len(card['generators_sha256']) == 64


def test_a_training_that_is_done_is_resumed_to_the_same_weights(run, dataset, monkeypatch):
    before = load_file(run / 'weights.safetensors')
    assert command(monkeypatch, *training(dataset, run, '--resume')) == 0
    assert_close(load_file(run / 'weights.safetensors'), before, rtol=0, atol=0)


@pytest.mark.parametrize(('option', 'value', 'told'), [
    ('--seed', 3, 'settings: seed: expected 0 as before, got 3; ask'),
    ('--view-separation-deg', 90, 'view_separation: expected 1.04719755')])
def test_a_training_of_other_settings_is_not_resumed(
        run, dataset, monkeypatch, capsys, option, value, told):
    line = refusal(monkeypatch, capsys, *training(dataset, run, '--resume', option, value))
    assert 'made under other settings' in line and told in line


def test_a_training_that_began_with_other_weights_is_not_resumed(
        run, dataset, monkeypatch, capsys):
    assert "settings: begun_with: expected '' as before, got '" in refusal(
        monkeypatch, capsys, *training(dataset, run, '--resume', '--init-from',
                                       run / 'weights.safetensors'))


def test_a_new_training_never_overwrites_the_checkpoints_of_another(
        run, dataset, monkeypatch, capsys):
    before = (run / 'reconstruction.safetensors').read_bytes()
    line = refusal(monkeypatch, capsys, *training(dataset, run))
    assert 'continue it with --resume' in line
    assert (run / 'reconstruction.safetensors').read_bytes() == before


def test_weights_of_a_training_that_keeps_nothing_else_are_never_overwritten(
        dataset, tmp_path, monkeypatch, capsys):
    (tmp_path / 'weights.safetensors').touch()
    assert 'holds another training (weights.safetensors)' in refusal(
        monkeypatch, capsys, *training(dataset, tmp_path))


def test_a_training_says_before_it_reads_data_that_its_folder_cannot_be_written(
        dataset, tmp_path, monkeypatch, capsys):
    (tmp_path / 'file').touch()
    assert 'weights.safetensors: cannot be written: expected a folder' in refusal(
        monkeypatch, capsys, *training(dataset, tmp_path / 'file' / 'run'))


def test_a_log_of_another_training_is_never_mixed_with_a_new_one(
        dataset, tmp_path, monkeypatch, capsys):
    log = tmp_path / 'tensorboard' / 'reconstruction' / 'events.out.tfevents.1.host'
    log.parent.mkdir(parents=True)
    log.touch()
    assert 'holds another training (events.' in refusal(
        monkeypatch, capsys, *training(dataset, tmp_path))


def test_a_training_that_is_interrupted_says_where_and_how_to_go_on(
        dataset, tmp_path, monkeypatch, capsys):
    import os
    import signal

    from active_recon.cli.training_log import SummaryLog

    monkeypatch.setattr(SummaryLog, 'show', lambda *told: os.kill(os.getpid(), signal.SIGINT))
    asked = reconstructing(
        dataset, tmp_path, '--validate-every', 1, '--policy-steps', 0, '--steps', 3)
    assert command(monkeypatch, *asked) == 130
    assert 'stopped at step 2 of 3; continue with --resume' in capsys.readouterr().out
    monkeypatch.undo()
    assert command(monkeypatch, *asked, '--resume') == 0


def test_a_training_that_is_interrupted_after_its_steps_says_how_to_go_on(
        dataset, tmp_path, monkeypatch, capsys):
    def stopped(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr('active_recon.training.plan.best_threshold', stopped)
    assert command(monkeypatch, *reconstructing(
        dataset, tmp_path, '--policy-steps', 0, '--steps', 1)) == 130
    assert 'stopped; continue with --resume' in capsys.readouterr().out


def test_a_log_without_room_is_told_in_words_alone(tmp_path, monkeypatch):
    import threading

    from active_recon.cli.training_log import SummaryLog

    failed = []
    monkeypatch.setattr(threading, 'excepthook', failed.append)
    with (small_disk(1000), pytest.raises(DataError, match='a folder with room.*--resume'),
          SummaryLog(tmp_path, None) as log, log.reporting('policy', 99) as report):
        for step in range(1, 99):
            report(step, {'loss': 0.5})
    assert not failed


@pytest.mark.slow
def test_the_paper_s_network_with_cameras_goes_from_data_to_figures(
        dataset, tmp_path, monkeypatch):
    asked = reconstructing(dataset, tmp_path, '--model', '2d3d-posed')
    assert command(monkeypatch, *asked) == 0
    card = json.loads((tmp_path / 'weights.json').read_text())
    assert (card['reconstruction']['volume_loss'], card['policy']) == ('bce+dice', None)
    weights = tmp_path / 'weights.safetensors'
    assert not load_weights(weights).reconstruction.needs_front
    out = tmp_path / 'figures.json'
    assert command(monkeypatch, 'evaluate', dataset, '--model', weights, '--json', out,
                   '--threads', 1) == 0
    found = json.loads(out.read_text())['policies']
    assert all(0 <= value['mean'] <= 1 for each in found.values() for value in each['iou'])


def test_a_training_is_validated_on_the_objects_of_every_folder(plain):
    assert f'reading validation data: {2 * 2}/{2 * 2}' in plain[1]


def test_validation_objects_that_are_trained_on_are_told_wherever_they_lie(plain):
    assert '4 of 4 validation objects are trained on too' in plain[2]


def test_only_weights_with_a_policy_say_how_far_apart_its_views_stay(run, plain):
    separations = [json.loads((folder / 'weights.json').read_text())['config']['view_separation']
                   for folder in (run, plain[0])]
    assert separations == [math.radians(60), 0]


def test_a_training_is_told_as_it_goes(plain):
    out, told, _ = plain
    assert 'reconstruction: 2/2' in told
    assert 'validation_iou_1' in told
    assert 'chosen on validation' in told
    assert 'policy' not in told
    assert not (out / 'policy.safetensors').exists()
    assert json.loads((out / 'weights.json').read_text())['policy'] is None


def test_an_evaluation_measures_all_that_it_says(run, dataset, tmp_path, monkeypatch, capsys):
    out = tmp_path / 'figures' / 'found.json'
    assert command(
        monkeypatch, 'evaluate', dataset, '--model', run / 'weights.safetensors', '--views', 2,
        '--starts', 2, '--seeds', 2, '--training', dataset, '--validation', dataset, '--json', out,
        '--threads', 1, '--yaw-study', '--latent-study') == 0
    found = json.loads(out.read_text())
    assert found['command'].startswith('active-recon evaluate ')
    assert found['weights'] == weights_hash(run / 'weights.safetensors')
    assert found['threshold'] == load_weights(run / 'weights.safetensors').threshold
    assert (found['objects'], found['episodes'], found['unreadable']) == (2, 4, [])
    assert set(found['policies']) == {'random', 'uniform', 'farthest', 'attention'}
    for figures in found['policies'].values():
        assert set(figures) == {'seeds', 'iou', 'auc', 'entropy', 'paper_entropy', 'rotation',
                                'per_category_iou', 'auc_above'}
        assert len(figures['iou']) == len(figures['entropy']) == 2
        assert all(0 <= value['low'] <= value['mean'] <= value['high'] <= 1
                   for value in (*figures['iou'], figures['auc']))
        assert set(figures['per_category_iou']) == {'lamp', 'table'}
    first = [figures['iou'][0] for figures in found['policies'].values()]
    assert all(value == pytest.approx(first[0]) for value in first)  # nobody chose the first
    assert found['policies']['random']['seeds'] == 2
    assert set(found['policies']['attention']['auc_above']) == {'random', 'uniform', 'farthest'}
    assert set(found['yaw']) == {'0', '5', '15', '30', '90', '180'}
    assert found['yaw']['0'] == pytest.approx(first[0], abs=5e-3)  # in full precision
    assert set(found['latent_swap']) == {'goal_change_deg', 'auc', 'auc_swapped', 'auc_loss'}
    assert found['latent_swap']['auc'] == pytest.approx(
        found['policies']['attention']['auc'], abs=5e-3)
    assert found['baselines']['nearest_image']['mean'] == 1  # the training set itself was asked
    assert 0 < found['baselines']['mean_shape']['mean'] <= 1
    told = capsys.readouterr().out
    assert all(word in told for word in ('random:', 'attention:', 'mean_shape:', 'nearest_image:',
                                         'goals move by', "front's yaw", 'wrote'))


def test_an_evaluation_with_an_oracle_tells_the_headroom_and_goes_on_from_its_cache(
        run, dataset, tmp_path, monkeypatch, capsys):
    found = []
    for again in range(2):
        out = tmp_path / f'{again}.json'
        assert command(
            monkeypatch, 'evaluate', dataset, '--model', run / 'weights.safetensors', '--views',
            2, '--starts', 1, '--seeds', 1, '--policy', 'random,oracle', '--cache',
            tmp_path / 'cache', '--json', out, '--threads', 1) == 0
        found.append(json.loads(out.read_text()))
        monkeypatch.setattr('active_recon.evaluation.trial.run_policy', None)
        monkeypatch.setattr('active_recon.evaluation.trial.run_oracle', None)
    assert found[0]['policies'] == found[1]['policies']
    assert found[0]['headroom_sentence'] in capsys.readouterr().out
    assert 'gap_closed' in found[0]['policies']['random']


def test_a_model_without_a_view_policy_is_measured_under_the_others(
        run, dataset, tmp_path, monkeypatch, capsys):
    from dataclasses import replace

    from active_recon.models.weights import save_weights
    path, out = tmp_path / 'plain.safetensors', tmp_path / 'found.json'
    save_weights(path, replace(load_weights(run / 'weights.safetensors'), attention=None))
    arguments = ('evaluate', dataset, '--model', path, '--views', 2, '--starts', 1, '--seeds', 1,
                 '--threads', 1)
    assert command(monkeypatch, *arguments, '--json', out) == 0
    found = json.loads(out.read_text())
    assert set(found['policies']) == {'random', 'uniform', 'farthest'}
    assert not {'latent_swap', 'yaw'} & found.keys()  # nobody asked for them
    monkeypatch.setattr('active_recon.evaluation.trial.run_policy', None)  # nothing is measured
    assert '--latent-study: cannot swap latents' in refusal(
        monkeypatch, capsys, *arguments, '--latent-study')
    assert 'no view policy: expected weights that contain one' in refusal(
        monkeypatch, capsys, *arguments, '--policy', 'attention')


def test_two_weights_files_are_compared_on_the_same_episodes(
        run, dataset, tmp_path, monkeypatch, capsys):
    import csv
    import shutil

    weights, copy = run / 'weights.safetensors', tmp_path / 'copy.safetensors'
    shutil.copy(weights, copy)
    out, rows = tmp_path / 'found.json', tmp_path / 'rows.csv'
    arguments = ('evaluate', dataset, '--model', weights, '--views', 2, '--starts', 2, '--seeds',
                 1, '--threads', 1)
    assert command(monkeypatch, *arguments, '--against', copy, '--policy', 'random,farthest',
                   '--paired', '--json', out, '--rows', rows) == 0
    found = json.loads(out.read_text())
    for figures in found['against']['above'].values():  # they are the same network
        assert figures['auc'] == {'mean': 0, 'low': 0, 'high': 0}
    random, farthest = (found['policies'][name]['auc']['mean'] for name in ('random', 'farthest'))
    assert found['paired']['auc']['mean'] == pytest.approx(random - farthest)
    told = capsys.readouterr().out
    assert 'random minus farthest: ' in told
    with rows.open() as file:
        lines = list(csv.DictReader(file))
    assert len(lines) == 2 * 2 * 4 * 2  # models, policies, episodes, views
    first = [float(line['iou']) for line in lines
             if line['model'] == str(weights) and line['policy'] == 'random'
             and line['view'] == '1']
    assert sum(first) / len(first) == pytest.approx(
        found['policies']['random']['iou'][0]['mean'], abs=1e-5)
    assert '--paired: wrong number of policies: expected two in --policy, got 0' in refusal(
        monkeypatch, capsys, *arguments, '--paired')


def test_the_rows_of_a_policy_that_draws_have_the_seeds_that_it_drew_by(
        dataset, tmp_path, monkeypatch):
    out = tmp_path / 'rows.csv'
    assert command(
        monkeypatch, 'evaluate', dataset, '--model', PAPER_MODEL, '--policy', 'random', '--views',
        2, '--starts', 1, '--seed', 3, '--seeds', 2, '--rows', out, '--threads', 1) == 0
    with out.open() as file:
        assert {row['seed'] for row in csv.DictReader(file)} == {'3', '4'}


def test_a_policy_that_is_named_twice_is_measured_once(dataset, tmp_path, monkeypatch):
    out = tmp_path / 'found.json'
    assert command(monkeypatch, 'evaluate', dataset, '--model', '2d3d', '--policy',
                   'random, farthest,random', '--views', 2, '--starts', 1, '--seeds', 2, '--json',
                   out, '--threads', 1) == 0
    found = json.loads(out.read_text())['policies']
    assert {name: figures['seeds'] for name, figures in found.items()} == {
        'random': 2, 'farthest': 1}


def test_an_object_that_cannot_be_read_is_listed(run, dataset, tmp_path, monkeypatch, capsys):
    import shutil
    copy = tmp_path / 'a copy'
    shutil.copytree(dataset, copy)
    next(copy.rglob('model.binvox')).write_bytes(b'#binvox 1\n')
    out = tmp_path / 'found.json'
    assert command(
        monkeypatch, 'evaluate', copy, '--model', run / 'weights.safetensors', '--views', 1,
        '--starts', 1, '--policy', 'uniform', '--json', out, '--threads', 1) == 0
    found = json.loads(out.read_text())
    assert found['objects'] == 1
    assert f"evaluate '{copy}' --model" in found['command']
    assert len(found['unreadable']) == 1
    assert 'model.binvox' in capsys.readouterr().err
    assert 'latent_swap' not in found


def test_what_cannot_be_done_is_refused_before_anything_is_measured(
        run, dataset, tmp_path, monkeypatch, capsys):
    weights = run / 'weights.safetensors'
    nothing = tmp_path / 'nothing'
    for arguments, words in [
        (('train', nothing, '--validation', dataset, '--out', tmp_path), "R2N2's layout"),
        (('evaluate', nothing, '--model', weights), "R2N2's layout"),
        (('evaluate', dataset, '--model', nothing), 'no such file: expected weights'),
        (('evaluate', dataset, '--model', '2d4d'), '2d4d: neither a weights file'),
        (('evaluate', dataset, '--model', weights, '--policy', 'random,best'), "'best'"),
        (('evaluate', dataset, '--model', weights, '--against', 'carving'),
         'expected weights of 32 cells a side, as those of --model, got 64'),
        (('evaluate', dataset, '--model', weights, '--policy', 'random, random', '--paired'),
         'expected two in --policy, got 1'),
        (('evaluate', dataset, '--model', weights, '--training', dataset),
         '--training: no validation objects'),
        (('evaluate', dataset, '--model', weights, '--validation', dataset),
         '--validation: no effect'),
    ]:
        assert words in refusal(monkeypatch, capsys, *arguments)


def test_a_comparison_of_which_a_part_cannot_be_done_measures_nothing(
        run, plain, dataset, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr('active_recon.evaluation.policy_study.run_all',
                        lambda *_: pytest.fail('something was measured'))
    asked = ('evaluate', dataset, '--model', run / 'weights.safetensors', '--policy', 'attention')
    for more, words in [
        (('--against', plain[0] / 'weights.safetensors'), 'attention: no view policy'),
        (('--training', tmp_path, '--validation', dataset), "no dataset in R2N2's layout"),
        (('--training', dataset, '--validation', tmp_path), "no dataset in R2N2's layout"),
    ]:
        assert words in refusal(monkeypatch, capsys, *asked, *more)


@pytest.mark.parametrize(('option', 'value', 'words'), [
    ('--volume-loss', 'mae', 'unknown volume loss: expected one of mse, bce'),
    ('--silhouette-weight', -1, 'invalid weights: expected 0 or more'),
    ('--learning-rate', 0, 'number out of range: expected finite numbers above 0'),
    ('--learning-rate', 'inf', 'number out of range: expected finite numbers above 0'),
    ('--max-views', 1, 'nothing to choose: expected 2 or more'),
    ('--group-size', 3, 'expected a divisor of the 2 episodes')])
def test_settings_that_train_nothing_are_refused(
        dataset, tmp_path, monkeypatch, capsys, option, value, words):
    assert words in refusal(monkeypatch, capsys, *training(dataset, tmp_path, option, value))


@pytest.mark.parametrize(('model', 'option', 'value'), [
    ('lifting', '--silhouette-weight', 1), ('lifting', '--volume-weight', 0.4),
    ('ogn', '--volume-loss', 'dice'), ('carving', '--volume-weight', 1)])
def test_options_of_losses_that_a_network_does_not_learn_by_are_refused(
        model, option, value, dataset, tmp_path, monkeypatch, capsys):
    line = refusal(monkeypatch, capsys, 'train', dataset, '--validation', dataset, '--out',
                   tmp_path / 'run', '--model', model, option, value, '--threads', 1)
    assert f'{option}: no effect: expected none, since {model} learns' in line


@pytest.mark.parametrize(('more', 'said'), [
    (('--freeze-from', PAPER_MODEL, '--steps', 9, '--no-augment'),
     '--steps, --augment with --freeze-from, whose reconstruction is not trained: no effect'),
    (('--scheme', 'joint', '--curriculum-fraction', 0), '--curriculum-fraction with --scheme jo'),
    (('--scheme', 'joint', '--policy-steps', 9), '--policy-steps with --scheme joint: no effect'),
    (('--policy-steps', 0, '--group-size', 2, '--view-separation-deg', 9),
     '--group-size, --view-separation-deg with --policy-steps 0, which trains no view policy: no'),
    (('--model', 'lifting', '--policy-batch-size', 9, '--policy-learning-rate', 1),
     '--policy-batch-size, --policy-learning-rate with lifting, which has no view policy: no'),
    (('--model', '2d3d', '--policy-steps', 9), '--policy-steps with 2d3d, which has no view poli'),
    (('--model', 'carving', '--steps', 9), '--steps with carving, which learns all at once: no'),
    (('--model', 'shape-basis', '--max-views', 3), '--max-views with shape-basis, which learns'),
    (('--kept', 9, '--uses', 2), '--uses, --kept without --make: they are for it alone')])
def test_options_of_what_is_not_trained_are_refused(
        more, said, dataset, tmp_path, monkeypatch, capsys):
    assert said in refusal(monkeypatch, capsys, 'train', dataset, '--validation', dataset,
                           '--out', tmp_path / 'run', '--threads', 1, *more)


def test_a_size_beside_given_weights_is_refused(dataset, tmp_path, monkeypatch, capsys):
    asked = reconstructing(dataset, tmp_path, '--model', '2d3d', '--size', 'small')
    said = refusal(monkeypatch, capsys, *asked, '--init-from', '2d3d')
    assert '--size: small with given weights' in said


def test_a_reconstruction_that_is_trained_further_begins_with_what_it_was_given_and_tells_so(
        run, dataset, tmp_path, monkeypatch, capsys):
    out = tmp_path / 'further'
    given = load_file(run / 'weights.safetensors')
    assert command(monkeypatch, *reconstructing(
        dataset, out, '--init-from', run / 'weights.safetensors', '--learning-rate', 1e-9,
        '--policy-steps', 0)) == 0
    name = 'reconstruction.encoder.memory.gates.weight'
    after = load_file(out / 'weights.safetensors')
    assert_close(after[name].float(), given[name].float(), rtol=2e-3, atol=1e-4)
    card = json.loads((out / 'weights.json').read_text())
    assert card['begun_with']['sha256'] == weights_hash(run / 'weights.safetensors')
    assert command(
        monkeypatch, 'train', dataset, '--validation', dataset, '--out', tmp_path / 'policy',
        '--policy-steps', 2, '--policy-batch-size', 2, '--group-size', 2, '--threads', 1,
        '--freeze-from', out / 'weights.safetensors') == 0
    frozen = json.loads((tmp_path / 'policy' / 'weights.json').read_text())
    assert frozen['begun_with'] == card['begun_with']
    assert 'both --freeze-from and --init-from' in refusal(monkeypatch, capsys, *training(
        dataset, tmp_path / 'none', '--init-from', run / 'weights.safetensors', '--freeze-from',
        run / 'weights.safetensors'))


@pytest.mark.parametrize(('model', 'begun'), [('2d3d-attention', 'lifting'), ('2d3d', 'carving'),
                                              ('lifting', '2d3d-attention')])
def test_weights_of_another_network_are_refused(
        dataset, tmp_path, monkeypatch, capsys, model, begun):
    line = refusal(monkeypatch, capsys, *reconstructing(
        dataset, tmp_path, '--model', model, '--init-from', begun))
    assert f'{model}: begun with weights of another network' in line
    assert f'got those of {begun}; name it by --model' in line


def test_a_policy_alone_leaves_its_reconstruction_as_it_was(
        run, dataset, tmp_path, monkeypatch, capsys):
    out = tmp_path / 'policy'
    assert command(
        monkeypatch, 'train', dataset, '--validation', dataset, '--out', out, '--policy-steps', 2,
        '--policy-batch-size', 2, '--group-size', 2, '--threads', 1, '--seed', 3, '--freeze-from',
        run / 'weights.safetensors') == 0
    told = capsys.readouterr().out
    assert 'chosen on' not in told and f'that of {run / "weights.safetensors"}' in told
    before, after = (load_file(folder / 'weights.safetensors') for folder in (run, out))
    for name, tensor in before.items():
        same = bool((after[name] == tensor).all())
        assert same == name.startswith('reconstruction.') or not tensor.any(), name
    assert not (out / 'reconstruction.safetensors').exists()


def test_a_training_on_other_data_is_not_resumed(run, dataset, tmp_path, monkeypatch, capsys):
    other = tmp_path / 'other'
    shutil.copytree(dataset, other)
    some = next(other.glob('ShapeNetRendering/*/*'))
    for each in [*other.glob(f'*/{some.parent.name}/{some.name}')]:
        each.rename(each.with_name('another'))
    line = refusal(monkeypatch, capsys, *training(other, run, '--resume'))
    assert 'made under other settings' in line
