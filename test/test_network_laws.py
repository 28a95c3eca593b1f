"""What holds for every network that the paper's is compared with, whatever is inside."""

from copy import deepcopy
from dataclasses import replace
from functools import cache

from active_recon.errors import ConfigError
from active_recon.geometry.cameras import CANONICAL_INTRINSICS, orbit_camera
from active_recon.models import shape_basis
from active_recon.models.network import Cameras
from active_recon.models.network_2d3d_posed import Network2d3dPosedConfig
from active_recon.models.ogn import OgnConfig
from active_recon.models.ptn import PtnConfig
from active_recon.models.r2n2 import R2n2Config
from active_recon.models.registry import network_config, network_entry
from active_recon.models.shape_basis import ShapeBasisConfig
from active_recon.models.weights import Bundle, load_weights, save_weights
from active_recon.runtimes.torch import TorchRuntime
import numpy as np
import pytest
from shown_views import cameras_at, known_after
import torch
from torch.testing import assert_close

TINY = {
    'r2n2': R2n2Config(encoder_channels=(4, 4, 4, 8, 8, 8), code_channels=16, hidden_channels=4,
                       decoder_channels=(8, 4)),
    'ptn': PtnConfig(image_channels=(4, 8, 8), code_channels=(16, 16, 16),
                     volume_channels=(8, 8, 4)),
    'ogn': OgnConfig(image_channels=(4, 8, 8), code_channels=(16, 16), level_channels=(8, 6, 4)),
    'shape-basis': ShapeBasisConfig(categories=('box', 'none'), modes=2),
    '2d3d-posed': Network2d3dPosedConfig(
        stem_channels=4, block_channels=(6, 8, 8), recurrent_channels=8, bottleneck_channels=16,
        latent_channels=2, volume_channels=6, decoder_channels=(6, 4), camera_channels=8),
}
TINY |= {'ptn-combined': TINY['ptn']}
AT_64 = replace(TINY['ogn'], level_channels=(8, 6, 4, 4), resolution=64)
CASES = [*TINY.items(), ('ogn', AT_64)]
LEARNED = [case for case in CASES if network_entry(case[0]).fit is None]


def name_of(case):
    return f'{case[0]}-{getattr(case[1], "resolution", 32)}'


@cache
def built(case):
    """Return the network of a case; what is fitted in one go is fitted to boxes."""
    torch.manual_seed(0)
    model, config = case
    entry = network_entry(model)
    network = entry.build(config).eval()
    if entry.fit:
        boxes = torch.zeros(6, 32, 32, 32, dtype=torch.bool)
        for index, box in enumerate(boxes):
            box[8 - index:24 + index, 4 + index:28 - index, 6 + index:20] = True
        entry.fit(network, boxes, np.array(['box'] * 6))
    return network


@pytest.fixture(autouse=True)
def shapes_are_fitted_in_few_steps(monkeypatch):
    monkeypatch.setattr(shape_basis, '_STEPS', 4)


@pytest.fixture(params=CASES, ids=name_of)
def case(request):
    return request.param


@pytest.fixture
def tiny_network(case):
    return deepcopy(built(case))


def some_views(network, count, batch):
    """Return views (T, B, 3, S, S): rectangles of noise on white, no two alike."""
    torch.manual_seed(1)
    views = torch.ones(count, batch, 3, 64, 64)
    for t in range(count):
        for index in range(batch):
            high, wide = 20 + 9 * t, 16 + 8 * index
            views[t, index, :, 10:10 + high, 12:12 + wide] = torch.rand(3, high, wide)
    return views.repeat_interleave(network.image_size // 64, dim=-1).repeat_interleave(
        network.image_size // 64, dim=-2)


def seen_from(network, azimuths):
    """Return canonical cameras of a network's images at azimuths, radians."""
    return cameras_at(azimuths, network.image_size)


@torch.no_grad()
def run_network(network, images):
    """Return what is known after views (T, B, ...)."""
    return known_after(network, images)


def test_a_sequence_is_answered_after_every_view(tiny_network):
    resolution, state = tiny_network.resolution, tiny_network.initial_state(2)
    for view in some_views(tiny_network, 3, 2):
        with torch.no_grad():
            logits, state = tiny_network(view, seen_from(tiny_network, [0, 0]), state)
        assert logits.shape == (2, *(resolution,) * 3)
        assert logits.isfinite().all()
        assert state['latent'].ndim == 4
        assert all(len(part) == 2 for part in state.values())


def test_a_state_has_the_same_names_before_any_view_and_after(tiny_network):
    before = tiny_network.initial_state(2)
    after = run_network(tiny_network, some_views(tiny_network, 1, 2)).state
    assert before.keys() == after.keys()
    assert before['latent'].shape == after['latent'].shape
    assert all(part.isfinite().all() for part in before.values())


def test_the_whole_camera_counts_where_no_front_is_needed_and_else_the_azimuth_alone(
        tiny_network):
    view, state = some_views(tiny_network, 1, 2)[0], tiny_network.initial_state(2)
    near = seen_from(tiny_network, [0.3, 1.9])
    longer = Cameras(near.poses, near.intrinsics * 1.3)
    far = Cameras(near.poses.clone(), near.intrinsics)
    far.poses[:, :3, 3] *= 2
    with torch.no_grad():
        expected, *others = (tiny_network(view, cameras, state)[0]
                             for cameras in (near, longer, far))
    for found in others:
        if tiny_network.needs_front:
            assert_close(found, expected, rtol=0, atol=0)
        else:
            assert (found - expected).abs().max() > 1e-3


def test_the_runtime_answers_as_the_network_does(tiny_network):
    images = (some_views(tiny_network, 2, 1)[:, 0] * 255).byte()
    runtime = TorchRuntime(tiny_network)
    state = runtime.initial_state()
    for t, image in enumerate(images):
        lens = CANONICAL_INTRINSICS.resized(*[tiny_network.image_size] * 2)
        occupancy, latent, state = runtime.step(
            image.permute(1, 2, 0).numpy(), orbit_camera(0.5 * t, intrinsics=lens), state)
    expected = run_network(tiny_network, images[:, None].float() / 255)
    assert_close(torch.from_numpy(occupancy), expected.logits[0].sigmoid())
    assert_close(torch.from_numpy(latent), expected.latent[0])


def test_a_view_more_changes_what_is_known(tiny_network):
    images = some_views(tiny_network, 2, 1)
    once, twice = run_network(tiny_network, images[:1]), run_network(tiny_network, images)
    assert (twice.latent - once.latent).abs().max() > 1e-4


def test_the_state_is_passed_and_not_kept(tiny_network):
    first, second = some_views(tiny_network, 2, 2)
    cameras = seen_from(tiny_network, [0, 0])
    with torch.no_grad():
        _, state = tiny_network(first, cameras, tiny_network.initial_state(2))
        before = {name: part.clone() for name, part in state.items()}
        once = tiny_network(second, cameras, state)
        tiny_network(first, cameras, state)
        again = tiny_network(second, cameras, state)
    assert_close(again, once, rtol=0, atol=0)
    assert_close(state, before, rtol=0, atol=0)


def test_an_object_is_reconstructed_alike_alone_and_among_others(tiny_network):
    images = some_views(tiny_network, 2, 3)
    together = run_network(tiny_network, images)
    for index in range(3):
        alone = run_network(tiny_network, images[:, index:index + 1])
        assert_close(together.logits[index:index + 1], alone.logits, rtol=1e-4, atol=1e-4)
        assert_close(together.latent[index:index + 1], alone.latent, rtol=1e-4, atol=1e-4)


@pytest.mark.parametrize('learned', LEARNED, ids=name_of)
def test_every_parameter_learns_from_two_views(learned):
    network = built(learned)
    voxels = torch.zeros(2, *(network.resolution,) * 3)
    voxels[:, 9:23, 9:23, 9:23] = 1
    seen = known_after(network, some_views(network, 2, 2))
    loss = network.objective(seen.state, voxels)
    if loss is None:
        loss = seen.logits.square().mean()
    loss.backward()
    for name, parameter in network.named_parameters():
        assert parameter.grad is not None, name
        assert parameter.grad.any(), name


def test_what_was_saved_answers_as_before(case, tiny_network, tmp_path):
    model, config = case
    path = tmp_path / 'weights.safetensors'
    save_weights(path, Bundle(tiny_network, None, config, 0.4, model=model))
    loaded = load_weights(path)
    assert (loaded.config, loaded.model, loaded.attention) == (config, model, None)
    expected, found = (run_network(part, some_views(part, 2, 2))
                       for part in (tiny_network, loaded.reconstruction))
    assert_close(found.latent, expected.latent, rtol=0, atol=0.02)


def parameters_of(model, size):
    with torch.device('meta'):
        network = network_entry(model).build(network_config(model, size))
    return sum(part.numel() for part in network.parameters())


@pytest.mark.parametrize('model', ['r2n2', 'ptn', 'ptn-combined', 'ogn', '2d3d-posed'])
def test_the_small_size_has_a_few_million_parameters_and_the_published_one_many(model):
    assert 2_000_000 <= parameters_of(model, 'small') <= 5_000_000
    assert parameters_of(model, 'published') > 20_000_000


@pytest.mark.parametrize(('model', 'wrong'), [
    ('r2n2', {'hidden_channels': 0}), ('r2n2', {'encoder_channels': (8, 8)}),
    ('r2n2', {'decoder_channels': (8,)}), ('ptn', {'volume_channels': (8, 8)}),
    ('ptn', {'code_channels': (8, 8, 0)}), ('ogn', {'resolution': 64}),
    ('ogn', {'level_channels': (8, 0, 8)}), ('ogn', {'image_channels': ()}),
    ('2d3d-posed', {'camera_channels': 0}),
    ('shape-basis', {'modes': 0}), ('shape-basis', {'categories': ('box', 'box')})])
def test_sizes_that_make_no_network_are_refused(model, wrong):
    with pytest.raises(ConfigError, match='expected'):
        replace(TINY[model], **wrong)
