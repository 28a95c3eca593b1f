"""Depth in the reconstruction: without it nothing changes, with it the order does not count."""

from dataclasses import replace
import json
import math

from active_recon.errors import ConfigError, DataError, WeightsError
from active_recon.exporting.export import export
from active_recon.geometry.cameras import orbit_camera
from active_recon.models.depth_refiner import DepthRefiner, DepthRefinerConfig, described
from active_recon.models.depth_weights import load_refiner, save_refiner
from active_recon.models.lifting import Lifting
from active_recon.models.weights import Bundle, save_weights
from active_recon.models.weights_files import depth_path, weights_hash
from active_recon.reconstructor import Reconstructor
from active_recon.runtimes import load_depth_runtime
from active_recon.runtimes.graph_files import graph_path, NETWORK_PARTS
from active_recon.runtimes.precision import has_bf16
from active_recon.saved_states import read_state, SavedState, write_state
from active_recon.volumes.depth_images import DepthImage
import numpy as np
import pytest
from test_lifting import TINY
import torch

CONFIG = DepthRefinerConfig(TINY.coarse_channels, 8, (8, 8, 8))
SIZE = 0.3


def fresh(seed=0, learned=True):
    torch.manual_seed(seed)
    refiner = DepthRefiner.from_config(CONFIG).eval()
    if learned:  # the last layer begins at zero
        torch.nn.init.normal_(refiner.to_64.weight, std=0.3)
    return refiner.requires_grad_(False)


def some_input(batch=1, seed=0):
    rng = torch.Generator().manual_seed(seed)
    return (torch.randn(batch, 64, 64, 64, generator=rng),
            3 * torch.rand(batch, 3, 64, 64, 64, generator=rng),
            torch.ones(batch, 1, 16, 16, 16),
            torch.randn(batch, TINY.coarse_channels, 16, 16, 16, generator=rng))


@pytest.fixture(scope='module')
def weights(tmp_path_factory):
    """Return a tiny lifting network's weights with a refiner beside them, both exported."""
    path = tmp_path_factory.mktemp('weights') / 'lifting.safetensors'
    torch.manual_seed(0)
    network = Lifting.from_config(TINY).eval()
    save_weights(path, Bundle(network, None, TINY, 0.4, model='lifting'))
    save_refiner(depth_path(path), fresh(), CONFIG, weights_hash(path), {'seed': 0})
    export(path)
    return path


def load(weights, **options):
    return Reconstructor.load(weights, object_size=SIZE, threads=1, runtime='torch', **options)


def view(number, depth=True):
    rng = np.random.default_rng(number)
    camera = orbit_camera(1.1 * number, 0.4, 2.1 * SIZE)
    image = rng.integers(0, 256, (137, 137, 3), np.uint8)
    metres = rng.uniform(1.9, 2.3, (137, 137)) * SIZE
    return image, camera, DepthImage(metres) if depth else None


def occupancy_after(reconstructor, views):
    reconstructor.reset()
    for each in views:
        known = reconstructor.add_view(*each)
    return known.grid.occupancy


def test_an_untrained_refiner_returns_what_it_is_given():
    given = some_input()
    torch.testing.assert_close(fresh(learned=False)(*given), given[0], rtol=0, atol=1e-5)
    assert (fresh()(*given) - given[0]).abs().max() > 0.1


def test_each_object_of_a_batch_is_refined_as_if_it_were_alone():
    refiner, given = fresh(), some_input(2)
    both = refiner(*given)
    for row in range(2):
        alone = refiner(*(part[row:row + 1] for part in given))
        torch.testing.assert_close(both[row:row + 1], alone, rtol=1e-3, atol=1e-3)


def test_evidence_is_described_by_shares():
    found = described(10 * torch.rand(1, 3, 4, 4, 4))
    assert found.shape == (1, 5, 4, 4, 4)
    assert 0 <= found.min() <= found.max() <= 1
    assert not described(torch.zeros(1, 3, 4, 4, 4)).any()


def test_a_refiner_without_channels_is_refused():
    with pytest.raises(ConfigError, match='DepthRefinerConfig: invalid channels'):
        DepthRefinerConfig(head_channels=0)


def test_without_depth_the_same_weights_give_what_they_gave_bit_by_bit(weights, tmp_path):
    alone = tmp_path / weights.name
    for path in (weights, *(graph_path(weights, part) for part in NETWORK_PARTS)):
        alone.with_name(path.name).write_bytes(path.read_bytes())
    views = [view(number, depth=False) for number in range(3)]
    for runtime in ('torch', 'openvino'):
        with_refiner, without = (occupancy_after(
            Reconstructor.load(path, object_size=SIZE, threads=1, runtime=runtime), views)
            for path in (weights, alone))
        np.testing.assert_array_equal(with_refiner, without)


def test_depth_changes_the_occupancy_and_its_order_does_not_count(weights):
    reconstructor = load(weights)
    views = [view(number) for number in range(3)]
    plain = occupancy_after(reconstructor, [(*each[:2], None) for each in views])
    deep = occupancy_after(reconstructor, views)
    assert np.abs(deep - plain).max() > 0.05
    np.testing.assert_allclose(occupancy_after(reconstructor, views[::-1]), deep, atol=1e-4)


def test_depth_of_some_views_is_kept_when_later_ones_have_none(weights):
    reconstructor = load(weights)
    some = occupancy_after(reconstructor, [view(0), view(1, depth=False)])
    late = occupancy_after(reconstructor, [view(1, depth=False), view(0)])
    np.testing.assert_allclose(some, late, atol=1e-4)
    none = occupancy_after(reconstructor, [view(0, depth=False), view(1, depth=False)])
    assert np.abs(some - none).max() > 0.05


def test_a_view_whose_depth_is_refused_goes_on_without_it(weights):
    reconstructor = load(weights)
    image, camera, depth = view(0)
    for bad, said in ((depth.metres[:100], 'wrong depth image'),
                      (depth.metres * math.nan, 'empty depth image'),
                      (depth.metres / 1000, 'metres read as millimetres')):
        reconstructor.reset()
        known = reconstructor.add_view(image, camera, DepthImage(bad))
        assert said in known.depth_refusal
        assert reconstructor.view_count == 1
        np.testing.assert_array_equal(
            known.grid.occupancy, occupancy_after(reconstructor, [(image, camera)]))
    assert not reconstructor.add_view(image, camera, depth).depth_refusal


def test_a_network_without_a_refiner_says_so_and_goes_on(weights, tmp_path):
    alone = tmp_path / weights.name
    alone.write_bytes(weights.read_bytes())
    known = load(alone).add_view(*view(0))
    assert 'takes no depth: expected lifting-depth.safetensors beside it' in known.depth_refusal
    with pytest.raises(WeightsError, match='takes no depth'):
        load(alone).warm_up(depth=True)


def test_a_state_with_depth_is_not_gone_on_from_without_a_refiner(weights, tmp_path):
    alone = tmp_path / weights.name
    alone.write_bytes(weights.read_bytes())
    deep, plain = load(weights), load(alone)
    deep.add_view(*view(0))
    plain.go_on_from(deep.progress)
    before = plain.progress
    with pytest.raises(WeightsError, match='takes no depth'):
        plain.add_view(*view(1))
    assert plain.progress.view_count == before.view_count == 1
    assert plain.progress.state is before.state


def refined(weights, runtime, precision):
    """Return what a runtime makes of numbers drawn at random."""
    rng = np.random.default_rng(0)
    occupancy = rng.random((64, 64, 64)).astype(np.float32)
    evidence = rng.random((3, 64, 64, 64)).astype(np.float32)
    state = {'coarse_count': np.full((1, 1, 16, 16, 16), 2, np.float32),
             'coarse_sum': rng.standard_normal((1, TINY.coarse_channels, 16, 16, 16), np.float32)}
    return load_depth_runtime(weights, runtime, threads=1, precision=precision).refine(
        occupancy, evidence, state)


def test_the_exported_refiner_answers_as_torch_does(weights):
    expected, *others = (refined(weights, name, 'f32')
                         for name in ('torch', 'openvino', 'onnxruntime'))
    for found in others:
        np.testing.assert_allclose(found, expected, atol=1e-4)


@pytest.mark.skipif(not has_bf16(), reason='this processor has no bf16')
def test_the_refiner_is_as_precise_as_the_network_is_asked_to_be(weights):
    exact = refined(weights, 'openvino', 'f32')
    for precision in ('auto', 'bf16'):
        half = refined(weights, 'openvino', precision)
        assert (half != exact).any()
        np.testing.assert_allclose(half, exact, atol=0.05)


def test_weights_are_read_as_they_were_written(weights):
    found, written = load_refiner(weights), fresh()
    for name, tensor in written.state_dict().items():
        torch.testing.assert_close(found.state_dict()[name], tensor.half().float())
    card = json.loads(depth_path(weights).with_suffix('.json').read_text())
    assert card['sha256'] == weights_hash(depth_path(weights))
    assert card['network_sha256'] == weights_hash(weights)


def test_a_refiner_of_other_weights_or_a_spoilt_one_is_refused(weights, tmp_path):
    own = tmp_path / weights.name
    own.write_bytes(weights.read_bytes())
    save_refiner(depth_path(own), fresh(), CONFIG, 'f' * 64, {})
    with pytest.raises(WeightsError, match='of other weights: expected one trained for'):
        load_refiner(own)
    depth_path(own).write_bytes(depth_path(weights).read_bytes()[:999])
    with pytest.raises(WeightsError, match='no whole safetensors file'):
        load_refiner(own)
    depth_path(own).write_bytes(weights.read_bytes())
    with pytest.raises(WeightsError, match='no depth refiner'):
        load_refiner(own)


def test_a_graph_of_another_refiner_is_refused(weights, tmp_path):
    own = tmp_path / weights.name
    own.write_bytes(weights.read_bytes())
    save_refiner(depth_path(own), fresh(1), CONFIG, weights_hash(own), {})
    graph = weights.with_name('lifting-depth.onnx')
    own.with_name(graph.name).write_bytes(graph.read_bytes())
    with pytest.raises(WeightsError, match='exported from another depth refiner'):
        load_depth_runtime(own, 'onnxruntime')


def test_a_saved_episode_goes_on_with_its_depth(weights, tmp_path):
    reconstructor = load(weights)
    reconstructor.reset()
    image, camera, depth = view(0)
    known = reconstructor.add_view(image, camera, depth)
    path = tmp_path / 'mug.state.safetensors'
    write_state(SavedState(reconstructor.progress, known, [], camera), reconstructor, path)
    expected = reconstructor.add_view(*view(1, depth=False)).grid.occupancy
    other = load(weights)
    other.go_on_from(read_state(path, other).progress)
    np.testing.assert_array_equal(other.add_view(*view(1, depth=False)).grid.occupancy, expected)


def test_a_saved_episode_with_spoilt_depth_is_refused(weights, tmp_path):
    from safetensors import safe_open
    from safetensors.numpy import load_file, save_file
    reconstructor = load(weights)
    known = reconstructor.add_view(*view(0))
    path = tmp_path / 'mug.state.safetensors'
    write_state(SavedState(reconstructor.progress, known, [], view(0)[1]), reconstructor, path)
    with safe_open(path, 'np') as file:
        facts = file.metadata()
    save_file({**load_file(path), 'depth_evidence': np.zeros((2, 2), np.float32)}, path, facts)
    with pytest.raises(DataError, match='depth evidence of'):
        read_state(path, reconstructor)


def test_begun_with_another_networks_it_corrects_as_that_where_there_are_no_features():
    given = fresh()
    logits, evidence, *_ = some_input()

    def corrected(refiner):
        nothing = torch.zeros(1, refiner.features + 1, 16, 16, 16)
        return refiner(logits, evidence, nothing[:, :1], nothing[:, 1:])

    with torch.inference_mode():
        for features in (given.features, given.features + 3):
            begun = DepthRefiner.begun_with(given, replace(CONFIG, features=features)).eval()
            assert torch.equal(corrected(begun), corrected(given))
    with pytest.raises(ConfigError, match='of other sizes'):
        DepthRefiner.begun_with(given, replace(CONFIG, head_channels=16))
