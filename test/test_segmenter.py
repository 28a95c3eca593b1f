"""The segmenter: its laws, its files, its exported graph, and its training."""

from functools import partial
import json
import math
from types import SimpleNamespace

from active_recon.datasets.layout import list_objects
from active_recon.datasets.making import make_dataset, shape_jobs
from active_recon.datasets.views import read_views
from active_recon.errors import ConfigError, WeightsError
from active_recon.exporting.export import export
from active_recon.models.lifting import Lifting
from active_recon.models.segmenter import Segmenter, SegmenterConfig
from active_recon.models.segmenter_weights import (
    begin_with,
    is_segmenter,
    read_segmenter,
    save_segmenter,
)
from active_recon.models.weights import Bundle, save_weights
from active_recon.models.weights_files import find_weights, SHIPPED
from active_recon.runtimes import load_runtime, load_segmenter_runtime, REMARK
from active_recon.training import segmenter as training
from active_recon.training import silhouettes
from active_recon.training.loop import Run, TrainingConfig
from active_recon.training.segmenter import SegmenterLearner, SHARES
from active_recon.training.silhouettes import silhouette_ious
from command_line import command
import numpy as np
import pytest
from test_lifting import TINY
import torch

CONFIG = SegmenterConfig((4, 6, 8, 10), (4, 4, 6, 8))


def fresh(seed=0):
    torch.manual_seed(seed)
    return Segmenter.from_config(CONFIG).eval()


def images(count=2, channels=4, seed=0):
    found = torch.rand(count, channels, 128, 128, generator=torch.Generator().manual_seed(seed))
    found[:, 3:] = 1
    return found


def test_each_pixel_has_a_logit_and_images_do_not_depend_on_each_other():
    segmenter, shown = fresh(), images(3)
    with torch.inference_mode():
        together = segmenter(shown)
        assert together.shape == (3, 1, 128, 128)
        torch.testing.assert_close(together[1:2], segmenter(shown[1:2]), rtol=1e-4, atol=1e-4)


def test_what_a_camera_saw_nothing_of_has_no_say_and_a_missing_mask_is_all_seen():
    segmenter, shown = fresh(), images()
    with torch.inference_mode():
        torch.testing.assert_close(segmenter(shown), segmenter(shown[:, :3]))
        shown[:, 3, :40] = 0
        other = shown.clone()
        other[:, :3, :40] = 0.3
        torch.testing.assert_close(segmenter(shown), segmenter(other))


def test_sizes_that_make_no_network_are_refused():
    with pytest.raises(ConfigError, match='invalid channels'):
        SegmenterConfig(channels=(0, 1, 1, 1))


def test_a_segmenter_is_written_and_read_and_other_files_are_refused(tmp_path):
    path = tmp_path / 'one.safetensors'
    save_segmenter(path, fresh(), CONFIG, {'seed': 0})
    assert is_segmenter(path) and not is_segmenter(SHIPPED) and not is_segmenter(tmp_path / 'no')
    read, shown = read_segmenter(path), images()
    with torch.inference_mode():
        torch.testing.assert_close(read(shown), fresh()(shown), rtol=0.02, atol=0.02)
    with pytest.raises(WeightsError, match='no segmenter: expected one that `active-recon train-'):
        read_segmenter(SHIPPED)
    (tmp_path / 'half.safetensors').write_bytes(path.read_bytes()[:1000])
    with pytest.raises(WeightsError, match='no whole safetensors'):
        read_segmenter(tmp_path / 'half.safetensors')


@pytest.mark.parametrize('runtime', ['auto', 'torch', 'openvino', 'onnxruntime'])
def test_weights_that_are_not_there_are_told_by_every_runtime(runtime, tmp_path):
    if runtime not in ('auto', 'torch'):
        pytest.importorskip(runtime)
    for load in (load_segmenter_runtime, load_runtime):
        with pytest.raises(WeightsError, match='nothing.safetensors: '):
            load(tmp_path / 'nothing.safetensors', runtime)


def test_it_is_no_reconstruction_network():
    with pytest.raises(WeightsError) as refusal:
        find_weights('nothing')
    assert 'segmenter' not in str(refusal.value)


def test_it_begins_with_another_or_with_the_way_down_of_a_lifting_network(tmp_path):
    torch.manual_seed(1)
    network = Lifting.from_config(TINY).eval()
    path = tmp_path / 'lifting.safetensors'
    save_weights(path, Bundle(network, None, TINY, 0.4, model='lifting'))
    segmenter = Segmenter.from_config(SegmenterConfig(TINY.encoder_channels, (4, 4, 6, 8)))
    begin_with(segmenter, path)
    torch.testing.assert_close(segmenter.down_8.state_dict(),
                               network.encoder.down_8.state_dict(), rtol=2e-3, atol=1e-3)
    other = tmp_path / 'segmenter.safetensors'
    save_segmenter(other, fresh(3), CONFIG, {})
    taken = fresh()
    begin_with(taken, other)
    torch.testing.assert_close(taken.state_dict(), read_segmenter(other).state_dict())
    for wrong in (path, find_weights('carving')):
        with pytest.raises(WeightsError):
            begin_with(fresh(), wrong)


def test_an_encoder_of_other_sizes_is_refused_in_one_line_that_tells_which_fits():
    with pytest.raises(WeightsError, match='encoder like that of lifting, got: ') as refusal:
        begin_with(fresh(), find_weights('lifting-large'))
    assert '\n' not in str(refusal.value)


def test_a_perfect_silhouette_costs_nothing_and_a_wrong_one_much():
    alpha = torch.zeros(2, 128, 128)
    alpha[:, 40:90, 30:80] = 1

    class Told(torch.nn.Module):
        def __init__(self, logits):
            super().__init__()
            self.logits = logits

        def forward(self, images):
            return self.logits[:, None]

    right, wrong = (SegmenterLearner(Told(sign * 30 * (alpha - 0.5)))(images(), alpha)
                    for sign in (1, -1))
    assert right['loss'] < 1e-4 and right['soft IoU'] > 0.999
    assert wrong['loss'] > 10 and wrong['soft IoU'] < 0.01
    unseen = images()
    unseen[:, 3] = 0
    unseen[:, 3, :, 100:] = 1  # nothing of the object was seen, and nothing found
    assert SegmenterLearner(Told(30 * (alpha - 0.5)))(unseen, alpha)['loss'] < 1e-3


@pytest.fixture(scope='module')
def lamps(tmp_path_factory):
    out = tmp_path_factory.mktemp('lamps')
    assert not [each.refusal for each in make_dataset(
        shape_jobs('lamp', range(2), out), samples=1, fine=True) if each.refusal]
    return out


def test_the_shares_of_backgrounds_are_those_of_all_images():
    assert math.isclose(sum(SHARES.values()), 1)


def test_silhouettes_are_measured_where_they_were_seen(lamps):
    views = read_views(list_objects(lamps), resolution=64, image_size=128, framed=True)
    everything = silhouette_ious(lambda shown: torch.ones(len(shown), 1, 128, 128), views,
                                 'white', 8)
    nothing = silhouette_ious(lambda shown: -torch.ones(len(shown), 1, 128, 128), views,
                              'white', 8)
    assert (nothing == 0).all() and (everything > 0).all() and (everything < 0.9).all()


def test_it_is_trained_and_resumed_from_the_command_line(lamps, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(silhouettes, 'silhouette_figures',
                        partial(silhouettes.silhouette_figures, count=2))
    arguments = ('train-segmenter', lamps, '--validation', lamps, '--steps', 2, '--batch-size', 1,
                 '--init-from', '', '--out', 'run', '--threads', 1)
    assert command(monkeypatch, *arguments) == 0
    said = capsys.readouterr()
    assert 'IoU of silhouettes on validation: white ' in said.out
    assert 'validation: 7/7' in said.out
    assert 'warning: 2 of 2 validation objects are trained on too: their IoU is too h' in said.err
    assert is_segmenter(tmp_path / 'run/segmenter.safetensors')
    assert command(monkeypatch, *arguments) == 2  # holds another training
    assert command(monkeypatch, *arguments, '--resume') == 0
    capsys.readouterr()
    assert command(monkeypatch, *arguments, '--resume', '--init-from', 'lifting') == 2
    assert "begun_with: expected '' as before, got" in capsys.readouterr().err


def test_a_stop_after_the_last_step_says_how_to_go_on(lamps, tmp_path, monkeypatch, capsys):
    def stopped(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(silhouettes, 'silhouette_figures', stopped)
    assert command(monkeypatch, 'train-segmenter', lamps, '--validation', lamps, '--steps', 1,
                   '--batch-size', 1, '--init-from', '', '--out', tmp_path, '--threads', 1) == 130
    assert 'stopped; continue with --resume' in capsys.readouterr().out


@pytest.mark.parametrize('library', [
    'openvino', pytest.param('onnxruntime', marks=pytest.mark.slow)])
def test_an_exported_segmenter_answers_as_in_torch(library, tmp_path):
    pytest.importorskip('onnx')
    pytest.importorskip(library)
    path = tmp_path / 'segmenter.safetensors'
    save_segmenter(path, fresh(), CONFIG, {})
    assert [each.name for each in export(path)] == ['segmenter-segment.onnx']
    one, two = (load_segmenter_runtime(path, name, threads=1, precision='f32')
                for name in (library, 'torch'))
    assert library in one.provenance['computed_by']
    for channels in (3, 4):
        shown = np.random.default_rng(0).integers(0, 256, (128, 128, channels), np.uint8)
        if channels == 4:
            shown[..., 3] = 255 * (shown[..., 3] > 60)
        np.testing.assert_allclose(one.segment(shown), two.segment(shown), atol=1e-3)
    save_segmenter(path, fresh(1), CONFIG, {})
    with pytest.raises(WeightsError, match='exported from other weights'):
        load_segmenter_runtime(path, library)
    again = load_segmenter_runtime(path)
    assert 'torch' in again.provenance['computed_by'] and 'other weights' in again.provenance[
        REMARK]


def test_an_exported_segmenter_that_contradicts_what_it_says_is_refused(tmp_path):
    onnx = pytest.importorskip('onnx')
    pytest.importorskip('openvino')
    path = tmp_path / 'segmenter.safetensors'
    save_segmenter(path, fresh(), CONFIG, {})
    file, = export(path)
    graph = onnx.load(file)
    told = json.loads(graph.metadata_props[0].value)
    for facts, words in (
            ({}, 'its metadata cannot be used: expected image_size as int'),
            ({'image_size': 64}, 'contradicts its metadata: expected images of 64 pixels')):
        graph.metadata_props[0].value = json.dumps({**told, 'facts': facts})
        onnx.save(graph, file)
        with pytest.raises(WeightsError, match=words):
            load_segmenter_runtime(path, 'openvino')
        assert 'torch' in load_segmenter_runtime(path).provenance['computed_by']


def test_processes_that_share_a_batch_draw_other_objects(lamps, tmp_path, monkeypatch):
    views = read_views(list_objects(lamps), resolution=64, image_size=128, framed=True)
    drawn = []
    monkeypatch.setattr(training, 'train_steps',
                        lambda *given, **more: drawn.append(given[6](0).arguments[0]))
    config = TrainingConfig(1, batch_size=4)
    for rank in range(2):
        fabric = SimpleNamespace(world_size=2, global_rank=rank)
        training.train_segmenter(fresh(), views, config, Run(fabric, tmp_path, print))
    assert [len(images) for images in drawn] == [4, 4]  # two objects of two images each
    assert not torch.equal(*drawn)
