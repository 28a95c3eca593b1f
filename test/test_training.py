"""The first stage of training: it learns, repeats, goes on after a cut, says what went wrong."""

from dataclasses import replace
import json
import os
import signal

from active_recon.config import LossConfig
from active_recon.errors import ConfigError
from active_recon.models.network_2d3d import Network2d3d
from active_recon.training.loop import (
    lr_factor,
    make_fabric,
    Run,
    TrainingConfig,
    TrainingDivergedError,
    TrainingStoppedError,
)
from active_recon.training.pictures import progress_picture
from active_recon.training.supervised import (
    drawn_length,
    longest_sequence,
    steps_for,
    train_reconstruction,
)
import numpy as np
import pytest
from safetensors import safe_open
from safetensors.torch import load_file, save_file
from shown_views import part_of
import torch
from torch.nn import functional
from torch.testing import assert_close

CONFIG = TrainingConfig(steps=7, batch_size=3, max_views=3, bfloat16=False, checkpoint_every=3,
                        validate_every=4)


class CutError(Exception):
    """A training that is cut off."""


def train(config, views, tiny, path, cut_after=None, loss=None, seed=0, **options):
    """Train a fresh network; return it and what was reported."""
    torch.manual_seed(seed)
    network = Network2d3d.from_config(tiny)
    told = []

    def report(step, measured):
        told.append((step, measured))
        if step == cut_after:
            raise CutError

    run = Run(make_fabric(config.bfloat16), path, report, **options)
    train_reconstruction(network, views, config, loss or LossConfig(), run,
                         lambda model: {'validation': float(model.training)})
    return network, told


def assert_same(a, b):
    assert_close(a.state_dict(), b.state_dict(), rtol=0, atol=0)


@pytest.fixture(scope='module')
def finished(tmp_path_factory):
    """Return the checkpoint of the training that nobody cut off, once it is done."""
    return tmp_path_factory.mktemp('whole') / 'run.safetensors'


@pytest.fixture(scope='module')
def whole(views, tiny, finished):
    """Return a training that nobody cut off."""
    return train(CONFIG, views, tiny, finished)


@pytest.fixture(scope='module')
def begun(views, tiny, tmp_path_factory):
    """Return the checkpoint of a training that was stopped after three steps."""
    path = tmp_path_factory.mktemp('begun') / 'run.safetensors'
    train(CONFIG, views, tiny, path, until=3)
    return path


def test_the_same_seed_walks_the_same_path(whole, views, tiny, tmp_path):
    again, told = train(CONFIG, views, tiny, tmp_path / 'run.safetensors')
    assert_same(again, whole[0])
    assert told == whole[1]


def test_another_seed_walks_another(whole, views, tiny, tmp_path):
    config = TrainingConfig(**(CONFIG.to_dict() | {'seed': 1}))
    _, told = train(config, views, tiny, tmp_path / 'run.safetensors')
    assert told[0][1]['loss'] != whole[1][0][1]['loss']


def test_a_training_cut_off_and_resumed_ends_in_the_very_same_weights(
        whole, views, tiny, tmp_path):
    path = tmp_path / 'run.safetensors'
    with pytest.raises(CutError):
        train(CONFIG, views, tiny, path, cut_after=5)  # the last checkpoint is of step 3
    resumed, told = train(CONFIG, views, tiny, path, seed=9, resume=True)
    assert_same(resumed, whole[0])
    assert told == whole[1][3:]


@pytest.mark.parametrize('asked', [signal.SIGINT, signal.SIGTERM])
def test_a_training_that_is_asked_to_stop_saves_its_step_and_goes_on_from_there(
        whole, views, tiny, tmp_path, asked):
    path = tmp_path / 'run.safetensors'
    told = []

    def show(step):
        told.append(step)
        os.kill(os.getpid(), asked)

    with pytest.raises(TrainingStoppedError, match='stopped at step 5 of 7; .*--resume'):
        train(CONFIG, views, tiny, path, show=show)  # asked at the validation after step 4
    assert told == [4]
    resumed, told = train(CONFIG, views, tiny, path, seed=9, resume=True)
    assert_same(resumed, whole[0])
    assert told == whole[1][5:]


def test_a_training_stopped_early_and_resumed_does_too(whole, views, tiny, tmp_path):
    path = tmp_path / 'run.safetensors'
    _, told = train(CONFIG, views, tiny, path, until=6)
    assert told == whole[1][:6]
    resumed, _ = train(CONFIG, views, tiny, path, seed=9, resume=True)
    assert_same(resumed, whole[0])


class Forgetful(Network2d3d):
    """A network that forgets some of what it sees, at random."""

    def encode(self, images, cameras):
        return functional.dropout(super().encode(images, cameras), 0.3, self.training)


def test_what_a_network_draws_is_the_same_where_the_training_is_resumed(views, tiny, tmp_path):
    def trained(path, **how):
        torch.manual_seed(0)
        network = Forgetful.from_config(tiny)
        train_reconstruction(network, views, CONFIG, LossConfig(), Run(
            make_fabric(False), path, lambda step, measured: None, **how), lambda model: {})
        return network

    whole = trained(tmp_path / 'whole.safetensors')
    trained(tmp_path / 'cut.safetensors', until=3)
    assert_same(trained(tmp_path / 'cut.safetensors', resume=True), whole)


def test_a_checkpoint_of_other_objects_or_cameras_is_refused(begun, views, tiny):
    for other in (part_of(views, slice(1, None)), replace(views, poses=views.poses.flip(1))):
        with pytest.raises(ConfigError, match='made under other settings'):
            train(CONFIG, other, tiny, begun, resume=True)


def test_a_checkpoint_that_does_not_tell_its_data_is_taken_up(begun, views, tiny, tmp_path):
    path = tmp_path / 'run.safetensors'
    with safe_open(begun, 'pt') as file:
        told = json.loads(file.metadata()['checkpoint'])
    del told['settings']['data']
    save_file(load_file(begun), path, {'checkpoint': json.dumps(told)})
    _, steps = train(CONFIG, views, tiny, path, resume=True)
    assert [step for step, _ in steps] == [4, 5, 6, 7]


def test_a_training_goes_on_where_the_processor_computes_in_another_precision(
        whole, views, tiny, tmp_path):
    path = tmp_path / 'run.safetensors'
    train(replace(CONFIG, bfloat16=True), views, tiny, path, until=3)
    _, told = train(CONFIG, views, tiny, path, resume=True)
    assert [step for step, _ in told] == [step for step, _ in whole[1][3:]]


def test_a_training_goes_on_with_other_checkpoints_to_the_same_weights(
        whole, views, tiny, tmp_path):
    path = tmp_path / 'run.safetensors'
    train(CONFIG, views, tiny, path, until=3)
    other = replace(CONFIG, checkpoint_every=2, validate_every=3)
    resumed, _ = train(other, views, tiny, path, resume=True)
    assert_same(resumed, whole[0])


def test_a_finished_training_that_is_resumed_does_nothing(whole, finished, views, tiny):
    resumed, told = train(CONFIG, views, tiny, finished, seed=9, resume=True)
    assert told == []
    assert_same(resumed, whole[0])
    assert not resumed.training


@pytest.mark.parametrize(('config', 'loss'), [
    (TrainingConfig(**(CONFIG.to_dict() | {'learning_rate': 2e-3})), LossConfig()),
    (CONFIG, LossConfig(volume_loss='bce'))])
def test_a_checkpoint_of_other_settings_is_refused(begun, views, tiny, config, loss):
    with pytest.raises(ConfigError, match='made under other settings: .*as before, got'):
        train(config, views, tiny, begun, loss=loss, resume=True)


def test_every_step_is_reported_and_validation_now_and_then_in_evaluation_mode(whole):
    network, told = whole
    assert [step for step, _ in told] == list(range(1, 8))
    assert all({'loss', 'volume', 'silhouette'} <= set(measured) for _, measured in told)
    validated = {step: measured['validation'] for step, measured in told
                 if 'validation' in measured}
    assert validated == {4: 0.0, 7: 0.0}  # not in training mode
    assert not network.training


def test_a_loss_that_is_not_finite_names_its_batch_and_leaves_the_checkpoint(
        begun, views, tiny):
    before = begun.read_bytes()
    config = CONFIG
    torch.manual_seed(0)
    network = Network2d3d.from_config(tiny)

    def poison(step, measured):
        network.decoder.grow[0].weight.data.fill_(torch.nan)

    with pytest.raises(TrainingDivergedError,
                       match=r'step 4: the loss is nan on the batch (lamp|table)-0.*, .*rate'):
        train_reconstruction(network, views, config, LossConfig(),
                             Run(make_fabric(False), begun, poison, resume=True), lambda model: {})
    assert begun.read_bytes() == before


def test_a_gradient_that_is_not_finite_names_its_batch_and_changes_nothing(views, tiny, tmp_path):
    network = Network2d3d.from_config(tiny)
    before = {name: tensor.clone() for name, tensor in network.state_dict().items()}
    network.decoder.grow[0].weight.register_hook(lambda gradient: gradient / 0)
    with pytest.raises(TrainingDivergedError,
                       match=r"step 0: the gradient's norm is (nan|inf) on the batch .*, .*rate"):
        train_reconstruction(network, views, CONFIG, LossConfig(),
                             Run(make_fabric(False), tmp_path / 'run.safetensors',
                                 lambda step, measured: None), lambda model: {})
    assert_close(network.state_dict(), before, rtol=0, atol=0)


@pytest.mark.parametrize('bfloat16', [False, pytest.param(True, marks=pytest.mark.slow)])
def test_the_loss_falls(views, tiny, tmp_path, bfloat16):
    one = part_of(views, slice(1))
    config = TrainingConfig(steps=24, batch_size=2, learning_rate=3e-2, max_views=2,
                            bfloat16=bfloat16, warmup_steps=5)
    _, told = train(config, one, tiny, tmp_path / 'run.safetensors',
                    loss=LossConfig(1.0, 0.0, 'bce'))
    losses = [measured['loss'] for _, measured in told]
    assert np.isfinite(losses).all()
    assert np.mean(losses[-10:]) < 0.9 * np.mean(losses[:10])


def test_the_learning_rate_rises_in_a_line_and_falls_as_half_a_cosine():
    shares = np.array([lr_factor(step, 10_000) for step in range(10_000)])
    assert shares[0] == pytest.approx(1 / 200)
    assert shares[99] == pytest.approx(0.5, abs=1e-3)
    assert shares.max() == pytest.approx(1, abs=1e-3)
    assert (np.diff(shares[:199]) > 0).all()
    assert (np.diff(shares[200:]) < 0).all()
    assert shares[5000] == pytest.approx(0.5)
    assert 0 < shares[-1] < 1e-6


def test_sequences_are_short_in_the_first_half_and_the_samples_are_counted_so():
    config = TrainingConfig(steps=1000, batch_size=8)
    longest = [longest_sequence(step, config) for step in range(1000)]
    assert longest == [2] * 500 + [5] * 500
    seen = sum(8 * (most + 1) / 2 for most in longest)
    assert steps_for(seen, 8, 5) == 1000
    assert longest_sequence(0, TrainingConfig(steps=9, max_views=1)) == 1


@pytest.mark.parametrize('rank', [0, 1])
def test_the_length_of_sequences_tells_nothing_of_the_objects_that_are_drawn(rank):
    config = TrainingConfig(1000, curriculum_fraction=0)
    drawn = [(length, rng.integers(1000)) for length, rng in (
        drawn_length(step, config, rank) for step in range(config.steps))]
    assert abs(np.corrcoef(drawn, rowvar=False)[0, 1]) < 0.1


def test_a_picture_shows_views_and_what_the_network_makes_of_them(network, views):
    picture = progress_picture(network, views)
    assert picture.shape == (4 * 128, 7 * 128, 3)
    assert picture.dtype == np.uint8
    truth = views.voxels[0].float().amax(1).T.flip(0).numpy()  # along y, upright
    side = picture[:128, 4 * 128:5 * 128, 0]
    assert np.array_equal(side[2::4, 2::4] > 0, truth > 0)
