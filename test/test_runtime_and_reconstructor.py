"""The reconstructor: one episode after another, in the object's frame and size."""

import math
import pickle

from active_recon.errors import ConfigError, ViewError
from active_recon.geometry.cameras import Camera, CANONICAL_DISTANCE, Intrinsics, orbit_camera
from active_recon.models.network import Cameras
from active_recon.models.weights import Bundle, save_weights
from active_recon.reconstructor import Reconstructor
from active_recon.runtimes.torch import TorchRuntime
import numpy as np
import pytest


@pytest.fixture
def runtime(network) -> TorchRuntime:
    return TorchRuntime(network, 0.4)


def image_of(seed):
    return np.random.default_rng(seed).integers(0, 256, (137, 137, 3), np.uint8)


def add(reconstructor, seed, size=1.0):
    camera = orbit_camera(seed * 0.8, distance=CANONICAL_DISTANCE * size)
    return reconstructor.add_view(image_of(seed), camera)


def test_a_step_answers_with_occupancy_latent_and_state(runtime, tiny):
    image = np.zeros((64, 64, 3), np.uint8)
    camera = orbit_camera(0.0)
    occupancy, latent, state = runtime.step(image, camera, runtime.initial_state())
    assert occupancy.shape == (32, 32, 32)
    assert latent.shape == (4 * tiny.latent_channels, 4, 4)
    assert occupancy.dtype == latent.dtype == np.float32
    assert 0 <= occupancy.min() <= occupancy.max() <= 1
    again, _, _ = runtime.step(image, camera, runtime.initial_state())
    np.testing.assert_array_equal(again, occupancy)
    later, _, _ = runtime.step(image, camera, state)
    assert np.abs(later - occupancy).max() > 1e-6


def test_a_step_answers_as_the_network_itself(runtime, network):
    import torch
    pixels = np.random.default_rng(0).integers(0, 256, (64, 64, 3), np.uint8)
    image = torch.from_numpy(pixels).permute(2, 0, 1)[None] / 255
    with torch.no_grad():
        logits, state = network(image, Cameras.of([orbit_camera(0.0)]), network.initial_state(1))
    occupancy, latent, _ = runtime.step(pixels, orbit_camera(0.0), runtime.initial_state())
    np.testing.assert_allclose(occupancy, logits[0].sigmoid(), atol=1e-5)
    np.testing.assert_allclose(latent, state['latent'][0], atol=1e-5)


def test_what_is_reconstructed_without_quality_tables_can_be_pickled(runtime):
    known = add(Reconstructor(runtime), 0)
    again = pickle.loads(pickle.dumps(known))
    np.testing.assert_array_equal(again.grid.occupancy, known.grid.occupancy)
    assert again.quality is None


def test_a_reset_reconstructor_is_as_good_as_new(runtime):
    reconstructor = Reconstructor(runtime)
    fresh = [add(reconstructor, seed) for seed in range(3)]
    assert reconstructor.view_count == 3
    reconstructor.reset()
    assert reconstructor.view_count == 0
    for seed, before in enumerate(fresh):
        again = add(reconstructor, seed)
        np.testing.assert_array_equal(again.grid.occupancy, before.grid.occupancy)
        np.testing.assert_array_equal(again.latent, before.latent)


@pytest.mark.parametrize('wrong', [
    image_of(0)[:100], image_of(0)[..., :2], image_of(0).astype(np.float32),
    np.zeros((0, 0, 3), np.uint8)], ids=['size', 'channels', 'dtype', 'empty'])
def test_a_view_that_is_refused_changes_nothing(runtime, wrong):
    undisturbed, disturbed = Reconstructor(runtime), Reconstructor(runtime)
    add(undisturbed, 0)
    add(disturbed, 0)
    with pytest.raises(ViewError, match='wrong image size or type: expected 137 x 137 x 3'):
        disturbed.add_view(wrong, orbit_camera(1.0))
    assert disturbed.view_count == 1
    np.testing.assert_array_equal(add(disturbed, 1).grid.occupancy,
                                  add(undisturbed, 1).grid.occupancy)


def test_depth_that_is_no_depth_image_is_refused_and_changes_nothing(runtime):
    reconstructor = Reconstructor(runtime)
    with pytest.raises(ViewError, match=r'a DepthImage .*got a ndarray; DepthImage\(metres\)'):
        reconstructor.add_view(image_of(0), orbit_camera(1.0), np.ones((137, 137), np.float32))
    assert reconstructor.view_count == 0


@pytest.mark.parametrize('part', ['occupancy', 'latent'])
def test_a_network_s_answer_that_is_not_finite_is_refused_and_changes_nothing(
        runtime, monkeypatch, part):
    undisturbed, disturbed = Reconstructor(runtime), Reconstructor(runtime)
    step = runtime.step

    def overflowing(*given):
        occupancy, latent, state = step(*given)
        (occupancy if part == 'occupancy' else latent)[0, 0, 0] = np.nan
        return occupancy, latent, state

    with monkeypatch.context() as patched:
        patched.setattr(runtime, 'step', overflowing)
        with pytest.raises(ViewError, match='not finite.*from the network') as refusal:
            add(disturbed, 0)
    assert refusal.value.kind == 'not_finite' and disturbed.view_count == 0
    np.testing.assert_array_equal(add(disturbed, 1).grid.occupancy,
                                  add(undisturbed, 1).grid.occupancy)


def test_a_camera_that_looks_away_is_refused(runtime):
    away = orbit_camera(0.0).pose.copy()
    away[:3, :3] = away[:3, :3] @ np.diag([-1, 1, -1])
    with pytest.raises(ViewError, match='looks away from the object: expected one that looks'):
        Reconstructor(runtime).add_view(image_of(0), Camera(away))


@pytest.mark.parametrize('quarters', [1, 2, 3, -1])
def test_quarter_turns_of_the_object_turn_the_grid_exactly(runtime, quarters):
    straight = add(Reconstructor(runtime), 0).grid.occupancy
    turned = add(Reconstructor(runtime, object_yaw=quarters * math.pi / 2), 0).grid.occupancy
    np.testing.assert_allclose(turned, np.rot90(straight, quarters, axes=(0, 1)), atol=1e-5)


def test_the_objects_yaw_is_not_the_networks_business(runtime):
    straight, turned = (add(Reconstructor(runtime, object_yaw=yaw), 0) for yaw in (0.0, 1.0))
    np.testing.assert_array_equal(turned.latent, straight.latent)


@pytest.mark.parametrize('size', [0.1, 2.5])
def test_the_objects_size_scales_the_points_and_nothing_else(runtime, size):
    unit = add(Reconstructor(runtime), 0)
    scaled = add(Reconstructor(runtime, object_size=size), 0, size)
    np.testing.assert_allclose(scaled.grid.occupancy, unit.grid.occupancy, atol=1e-6)
    threshold = float(np.median(unit.grid.occupancy))
    np.testing.assert_allclose(scaled.grid.points(threshold)[:, :3],
                               unit.grid.points(threshold)[:, :3] * size, atol=1e-6)


def test_an_image_of_another_size_is_seen_alike(runtime):
    image, lens = np.full((274, 274, 3), 90, np.uint8), orbit_camera(0.0).intrinsics
    large = Camera(orbit_camera(0.0).pose, lens.resized(274, 274))
    expected = Reconstructor(runtime).add_view(image[:137, :137], orbit_camera(0.0))
    found = Reconstructor(runtime).add_view(image, large)
    np.testing.assert_allclose(found.grid.occupancy, expected.grid.occupancy, atol=1e-5)
    assert isinstance(large.intrinsics, Intrinsics)


@pytest.mark.parametrize(('settings', 'message'), [
    ({'threshold': 0.0}, r'probability in \(0, 1\), got 0'),
    ({'threshold': math.nan}, r'probability in \(0, 1\), got nan'),
    ({'object_size': 0.0}, 'metres above 0, got 0'),
    ({'object_size': math.nan}, 'metres above 0, got nan'),
    ({'object_yaw': math.inf}, 'not finite: expected radians, got inf'),
])
def test_settings_out_of_range_are_refused_with_the_range(runtime, settings, message):
    with pytest.raises(ConfigError, match=message):
        Reconstructor(runtime, **settings)


def test_the_threshold_comes_with_the_weights_unless_it_is_given(
        tmp_path, network, attention, tiny):
    path = tmp_path / 'weights.safetensors'
    save_weights(path, Bundle(network, attention, tiny, 0.35))
    loaded = Reconstructor.load(path)
    assert loaded.threshold == 0.35
    assert len(loaded.provenance['weights_sha256']) == 64
    assert Reconstructor.load(path, threshold=0.6).threshold == 0.6
