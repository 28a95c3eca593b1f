"""Exported networks in the place of torch's, where networks are measured."""

from dataclasses import replace
import pickle
import shutil

from active_recon.datasets.views import ViewSet
from active_recon.errors import WeightsError
from active_recon.evaluation.exported_network import ExportedNetwork, network_in
from active_recon.evaluation.rollouts import Observer
from active_recon.exporting.export import export
from active_recon.geometry.cameras import orbit_camera
from active_recon.models.network import Cameras
from active_recon.models.registry import network_entry
from active_recon.models.weights import Bundle, load_weights, save_weights, state_hash
from active_recon.volumes.voxels import iou
import pytest
import test_lifting
import torch

pytest.importorskip('onnx')
pytest.importorskip('openvino')


@pytest.fixture(scope='module')
def weights(tmp_path_factory):
    """Return an exported weights file of a small network of any cameras."""
    torch.manual_seed(0)
    path = tmp_path_factory.mktemp('measured') / 'tiny.safetensors'
    network = network_entry('lifting').build(test_lifting.TINY).eval()
    save_weights(path, Bundle(network, None, test_lifting.TINY, 0.4, model='lifting'))
    export(path)
    return path


@pytest.fixture(scope='module')
def posed_views():
    """Return two balls of noise, each in three views, one of which lies half outside."""
    torch.manual_seed(1)
    cameras = Cameras.of([orbit_camera(azimuth, elevation, 2.1, test_lifting.LENS)
                          for azimuth, elevation in ((0.1, 0.3), (2.0, -0.4), (4.1, 0.9))])
    images = torch.zeros(2, 3, 128, 128, 4, dtype=torch.uint8)
    images[..., 30:90, 40:100, :3] = torch.randint(255, (2, 3, 60, 60, 3), dtype=torch.uint8)
    images[..., 30:90, 40:100, 3] = 255
    seen = torch.ones(2, 3, 128, 128, dtype=torch.bool)
    seen[:, 2, :60] = False
    axis = torch.linspace(-1, 1, 64)
    distance = axis[:, None, None] ** 2 + axis[:, None] ** 2 + axis ** 2
    voxels = torch.stack([distance < 0.3, distance < 0.5])
    return ViewSet(images, cameras.poses.expand(2, -1, -1, -1),
                   cameras.intrinsics.expand(2, -1, -1, -1), voxels, (), seen=seen)


def measured(weights, runtime):
    return network_in(runtime, weights, load_weights(weights), bfloat16=False, threads=1)


@torch.inference_mode()
def states_of(network, views):
    """Yield the states of some objects after each of three views."""
    observer = Observer(network, views)
    objects = torch.arange(len(views))
    state = observer.initial_state(len(views))
    for view in (0, 2, 1):
        state = observer.update(objects, torch.full_like(objects, view), state)
        yield observer, state


@pytest.mark.slow
def test_auto_measures_in_torch_what_was_not_exported_in_whatever_precision(weights, tmp_path):
    alone = tmp_path / weights.name
    shutil.copy(weights, alone)
    bundle = load_weights(alone)
    for bfloat16 in (True, False):
        assert network_in('auto', alone, bundle, bfloat16, threads=1) is bundle.reconstruction


@torch.inference_mode()
def test_an_exported_network_is_opened_anew_in_another_process(weights, posed_views):
    own = measured(weights, 'openvino')
    other = pickle.loads(pickle.dumps(own))
    for (first, found), (second, again) in zip(
            states_of(own, posed_views), states_of(other, posed_views), strict=True):
        torch.testing.assert_close(first.occupancy(found), second.occupancy(again))
    torch.testing.assert_close(own.provenance, other.provenance)


def test_an_exported_network_is_measured_as_in_torch(weights, posed_views):
    """Within .0005 of the IoU at any threshold, latents and occupancies within 1e-3."""
    graphs = measured(weights, 'openvino')
    assert isinstance(graphs, ExportedNetwork)
    for (by_graphs, found), (by_torch, expected) in zip(
            states_of(graphs, posed_views), states_of(measured(weights, 'torch'), posed_views),
            strict=True):
        torch.testing.assert_close(found['latent'], expected['latent'], atol=1e-3, rtol=1e-3)
        own, other = by_graphs.occupancy(found), by_torch.occupancy(expected)
        torch.testing.assert_close(own, other, atol=1e-3, rtol=0)
        truth = posed_views.voxels
        for threshold in other.quantile(torch.tensor([0.5, 0.9])):
            difference = iou(own > threshold, truth) - iou(other > threshold, truth)
            assert abs(float(difference.mean())) < 5e-4


def test_an_object_is_measured_the_same_whatever_is_beside_it(weights, posed_views):
    network = measured(weights, 'openvino')
    together = [state for _, state in states_of(network, posed_views)]
    second = replace(posed_views, **{name: getattr(posed_views, name)[1:] for name in (
        'images', 'poses', 'intrinsics', 'voxels', 'seen')})
    alone = [state for _, state in states_of(network, second)]
    for both, one in zip(together, alone, strict=True):
        torch.testing.assert_close(both['latent'][1:2], one['latent'], atol=0, rtol=0)


def test_what_was_measured_in_another_runtime_is_not_taken_from_a_cache(weights):
    identities = {state_hash(measured(weights, runtime)) for runtime in ('torch', 'openvino')}
    assert len(identities) == 2
    assert state_hash(measured(weights, 'openvino')) in identities


def test_a_network_that_was_not_exported_runs_in_torch_only_if_that_may_be(weights, tmp_path):
    alone = tmp_path / 'alone.safetensors'
    alone.write_bytes(weights.read_bytes())
    assert not isinstance(measured(alone, 'auto'), ExportedNetwork)
    with pytest.raises(WeightsError, match='not exported: expected alone-encode.onnx beside it'):
        measured(alone, 'openvino')
