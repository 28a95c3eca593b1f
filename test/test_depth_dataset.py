"""Depth beside a dataset's images: written, read, framed, turned with them, and learned from."""

from dataclasses import replace
import errno
import math
from pathlib import Path

from active_recon.cli.train_depth import train_depth
from active_recon.cluster.results import is_no_room
from active_recon.datasets.drawn_cameras import Viewing
from active_recon.datasets.layout import list_objects, ObjectFolder, write_depths
from active_recon.datasets.making import make_object, shape_jobs
from active_recon.datasets.views import read_views
from active_recon.errors import DataError
from active_recon.models.depth_refiner import DepthRefiner, DepthRefinerConfig
from active_recon.models.depth_weights import load_refiner
from active_recon.models.lifting import Lifting
from active_recon.models.weights import Bundle, save_weights
from active_recon.models.weights_files import find_weights
from active_recon.training.depth import depth_sample, depth_view, LENGTHS
from active_recon.training.posed_batches import draw_posed_batch
from active_recon.volumes.depth_evidence import depth_evidence
from command_line import command
import numpy as np
import pytest
from safetensors.torch import load_file
from test_lifting import TINY
import torch

ANY = Viewing('any', 4)


@pytest.fixture(scope='module')
def deep(tmp_path_factory):
    """Return a folder of two tables seen from four cameras each, with depth."""
    out = tmp_path_factory.mktemp('deep')
    for job in shape_jobs('table', range(2), out):
        assert not make_object(job, 1, fine=True, viewing=ANY, depth=True).refusal
    return out


@pytest.fixture(scope='module')
def views(deep):
    return read_views(list_objects(deep), resolution=64, image_size=128, framed=True, depth=True)


def contents(folder):
    return {path: path.read_bytes() for path in sorted(folder.rglob('*')) if path.is_file()}


def test_depth_images_come_back_within_half_a_step(tmp_path):
    folder = ObjectFolder(tmp_path, 'table', 'one')
    folder.images_folder.mkdir(parents=True)
    depth = np.random.default_rng(0).uniform(0, 5, (20, 30)).astype(np.float32)
    depth[0, 0], depth[0, 1] = 0, 70
    assert not folder.has_depth
    write_depths(folder, [depth, depth + 1])
    assert folder.has_depth
    found = folder.depth(0)
    assert not found[0, :2].any()  # no value, and more than 16 bits hold
    depth[0, 1] = 0
    np.testing.assert_allclose(found, depth, atol=0.00051)


def test_a_missing_or_other_depth_image_is_refused(deep, tmp_path):
    folder = ObjectFolder(tmp_path, 'table', 'one')
    with pytest.raises(DataError, match='no readable depth image.*got no file.*`--depth`'):
        folder.depth(0)
    folder.images_folder.mkdir(parents=True)
    image = list_objects(deep)[0].images_folder / '00.png'
    folder.depth_path(0).write_bytes(image.read_bytes())
    with pytest.raises(DataError, match='expected a PNG of one channel of 16 bits'):
        folder.depth(0)


def test_depth_that_a_full_disk_does_not_hold_is_told_and_not_taken_for_whole(
        tmp_path, monkeypatch):
    def full(path, data):
        raise OSError(errno.ENOSPC, 'No space left on device', str(path))

    folder = ObjectFolder(tmp_path, 'table', 'one')
    folder.images_folder.mkdir(parents=True)
    monkeypatch.setattr(Path, 'write_bytes', full)
    with pytest.raises(DataError, match=r'_depth.png: cannot be written: No space') as told:
        write_depths(folder, [np.ones((20, 30), np.float32)])
    assert is_no_room(told.value)
    assert not folder.has_depth and not contents(tmp_path)


def test_an_object_that_is_made_anew_gets_its_depth_and_fine_voxels_again(tmp_path):
    job, = shape_jobs('lamp', range(1), tmp_path)
    assert not make_object(job, 1, fine=True, viewing=ANY, depth=True).refusal
    before = contents(tmp_path)
    job.folder.voxels_path(32).unlink()
    assert not make_object(job, 1, fine=True, viewing=ANY, depth=True).refusal
    assert contents(tmp_path) == before


def test_a_finished_object_gets_only_its_depth(tmp_path):
    job, = shape_jobs('lamp', range(1), tmp_path)
    assert not make_object(job, 1, viewing=ANY).refusal
    before = contents(tmp_path)
    assert not make_object(job, 1, viewing=ANY, depth=True).refusal
    after = contents(tmp_path)
    assert {path: after[path] for path in before} == before
    assert len(after) == len(before) + 4
    alpha, depth = job.folder.image(0)[..., 3], job.folder.depth(0)
    np.testing.assert_array_equal(alpha > 127, depth > 0)


def test_objects_without_depth_are_left_out_where_it_is_asked_for(deep, tmp_path):
    job, = shape_jobs('lamp', range(1), tmp_path)
    make_object(job, 1, fine=True, viewing=ANY)
    found = read_views([*list_objects(deep), job.folder], resolution=64, image_size=32,
                       framed=True, depth=True)
    assert len(found) == 2
    assert 'no depth images' in found.unreadable[0]


def test_framed_depth_lies_where_the_framed_image_shows_the_object(views):
    measured, shown = views.depths > 0, views.images[..., 3] > 127
    both, either = (each.sum(dim=(2, 3)) for each in (measured & shown, measured | shown))
    assert (both / either).min() > 0.8


@pytest.mark.parametrize('seed', range(3))
def test_depth_is_mirrored_and_turned_with_its_object(views, seed):
    batch = draw_posed_batch(views, 2, 3, np.random.default_rng(seed), augment=False)
    for row in range(2):
        evidence = sum(depth_evidence(*depth_view(batch.depths, batch.cameras, view, row))
                       for view in range(3))
        occupied = batch.voxels[row].numpy() > 0
        near, free = evidence[1] > 0.5, evidence[0] > 0.9
        assert occupied[near].mean() > 0.3
        assert occupied[free].mean() < 0.05


def test_a_sample_is_what_the_network_says_alone_and_what_its_seed_draws(views):
    torch.manual_seed(0)
    network = Lifting.from_config(TINY).eval()
    batch = draw_posed_batch(views, 2, 2, np.random.default_rng(0), augment=False)
    one, two = (depth_sample(network, batch, np.random.default_rng(1)) for _ in range(2))
    assert torch.equal(one.evidence, two.evidence)
    assert one.evidence.amax() > 0.9
    state = network.initial_state(2)
    for number in range(2):
        state = network.step(batch.images[number], batch.cameras.rows(number), state)
    torch.testing.assert_close(one.logits, network.decode(state), rtol=1e-3, atol=1e-3)


def test_the_longest_sequence_to_ask_for_is_the_longest_that_is_drawn():
    (option,) = train_depth.__annotations__['max_views'].__metadata__
    assert option.max == max(LENGTHS)


@pytest.fixture
def calibrated_on_few_views(monkeypatch):
    monkeypatch.setattr('active_recon.training.depth.LENGTHS', (1, 2))


def test_a_refiner_is_trained_and_loaded_from_the_command_line(
        deep, calibrated_on_few_views, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    torch.manual_seed(0)
    weights = tmp_path / 'lifting.safetensors'
    save_weights(weights, Bundle(Lifting.from_config(TINY).eval(), None, TINY, 0.4,
                                 model='lifting'))
    arguments = ('train-depth', deep, '--validation', deep, '--model', weights, '--steps', 2,
                 '--batch-size', 1, '--max-views', 1, '--out', 'run', '--threads', 1)
    assert command(monkeypatch, *arguments) == 0
    assert 'validation objects are trained on too: the calibr' in capsys.readouterr().err
    made = tmp_path / 'run' / 'lifting-depth.safetensors'
    (tmp_path / made.name).write_bytes(made.read_bytes())
    refiner = load_refiner(weights)
    fresh = DepthRefiner.from_config(DepthRefinerConfig(TINY.coarse_channels))
    assert refiner.to_64.weight.abs().sum() > 0 and not fresh.to_64.weight.any()
    assert math.isfinite(float(refiner.calibration.sum()))
    assert command(monkeypatch, *arguments) == 2  # holds another training


@pytest.mark.slow
def test_a_training_may_begin_with_the_refiner_of_another_network(
        deep, calibrated_on_few_views, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    torch.manual_seed(0)
    sizes = replace(TINY, coarse_channels=TINY.coarse_channels + 4)
    save_weights(tmp_path / 'lifting.safetensors',
                 Bundle(Lifting.from_config(sizes).eval(), None, sizes, 0.4, model='lifting'))
    arguments = ('train-depth', deep, '--validation', deep, '--model', 'lifting.safetensors',
                 '--steps', 1, '--learning-rate', 1e-9, '--batch-size', 1, '--max-views', 1,
                 '--threads', 1)
    assert command(monkeypatch, *arguments, '--init-from', 'lifting', '--out', 'run') == 0
    trained = load_file(tmp_path / 'run' / 'lifting-depth.safetensors')
    shipped = load_refiner(find_weights('lifting')).state_dict()
    different = {name for name, tensor in trained.items() if name != 'calibration' and (
        tensor.shape != shipped[name].shape
        or not torch.allclose(tensor.float(), shipped[name], atol=1e-3))}
    assert different == {'enter_16.weight'}
    assert command(monkeypatch, *arguments, '--init-from', 'lifting.safetensors',
                   '--out', 'other') == 2
    assert 'takes no depth: expected lifting-depth.safetensors' in capsys.readouterr().err
    assert command(monkeypatch, *arguments, '--init-from', 'none.safetensors',
                   '--out', 'other') == 2
    assert 'none.safetensors: cannot be read: expected weights' in capsys.readouterr().err
