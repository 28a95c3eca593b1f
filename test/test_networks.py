"""Encoder, decoder and the network of both: shapes, memory, and that it can learn."""


from active_recon.models.network_2d3d import Network2d3d, Network2d3dConfig
from learning_by_heart import iou_by_heart
import pytest
from shown_views import cameras_at, known_after
import torch
from torch.testing import assert_close


def some_views(count, batch):
    torch.manual_seed(1)
    return torch.rand(count, batch, 3, 64, 64)


@torch.no_grad()
def run_network(network, images):
    """Return what is known after views (T, B, ...) from anywhere: it does not look at cameras."""
    return known_after(network, images, torch.rand(len(images)) * 6)


@pytest.fixture(autouse=True)
def one_thread():
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)


def test_images_become_a_latent_unit_and_occupancy(network, tiny):
    seen = run_network(network, some_views(1, 3))
    assert seen.logits.shape == (3, 32, 32, 32)
    assert seen.latent.shape == (3, 4 * tiny.latent_channels, 4, 4)
    assert seen.state['encoder_memory'].shape == (3, tiny.recurrent_channels, 4, 4)
    assert seen.state['decoder_memory'].shape == (3, tiny.volume_channels, 4, 4, 4)


def test_the_latent_unit_is_read_as_a_volume_without_loss(network, tiny):
    latent = torch.randn(2, 4 * tiny.latent_channels, 4, 4)
    seen = []
    network.decoder.memory.register_forward_hook(lambda _, inputs, __: seen.append(inputs[0]))
    network.decoder.update(latent, network.decoder.memory.initial_state(2))
    assert seen[0].shape == (2, tiny.latent_channels, 4, 4, 4)
    assert_close(seen[0].flatten(), latent.flatten())


def test_the_default_network_fits_the_budget_of_parameters():
    count = sum(part.numel() for part in
                Network2d3d.from_config(Network2d3dConfig()).parameters())
    assert 1_500_000 <= count <= 6_000_000


def test_most_of_the_grid_is_empty_before_any_training(network):
    assert run_network(network, some_views(1, 1)).logits.sigmoid().mean().item() == pytest.approx(
        0.1, abs=0.03)


@torch.no_grad()
def test_the_state_is_passed_and_not_kept(network):
    first, second = some_views(2, 2)
    at = cameras_at([0, 0])
    _, state = network(first, at, network.initial_state(2))
    before = {name: part.clone() for name, part in state.items()}
    once = network(second, at, state)
    network(first, at, state)
    again = network(second, at, state)
    assert_close(again, once, rtol=0, atol=0)
    assert_close(state, before, rtol=0, atol=0)


def test_before_any_view_the_memories_are_empty(network):
    assert not any(part.any() for part in network.initial_state(2).values())


def test_a_view_more_changes_what_is_known(network):
    images = some_views(2, 1)
    one, two = (run_network(network, images[:count]).logits for count in (1, 2))
    assert (two - one).abs().max() > 1e-4


def test_the_order_of_the_views_matters(network):
    images = some_views(2, 1)
    forth, back = run_network(network, images), run_network(network, images.flip(0))
    assert (forth.latent - back.latent).abs().max() > 1e-5


def test_the_order_of_the_batch_does_not(network):
    images, order = some_views(3, 3), torch.tensor([2, 0, 1])
    together, mixed = run_network(network, images), run_network(network, images[:, order])
    assert_close(mixed.logits, together.logits[order])
    assert_close(mixed.latent, together.latent[order])


def test_every_parameter_learns_from_two_views(network):
    images = some_views(2, 2)
    torch.nn.init.normal_(network.encoder.memory.peepholes)
    known_after(network, images).logits.square().mean().backward()
    for name, parameter in network.named_parameters():
        assert parameter.grad is not None, name
        assert parameter.grad.any(), name


@pytest.mark.slow
def test_a_small_network_learns_one_object_by_heart(views):
    torch.manual_seed(0)
    network = Network2d3d.from_config(Network2d3dConfig(
        stem_channels=8, block_channels=(8, 16, 16), recurrent_channels=16,
        bottleneck_channels=32, latent_channels=4, volume_channels=16, decoder_channels=(16, 8)))
    assert iou_by_heart(network, views) > 0.9


@torch.no_grad()
def test_the_azimuth_changes_nothing(network):
    images = some_views(1, 2)
    assert_close(known_after(network, images, [0]), known_after(network, images, [1]),
                 rtol=0, atol=0)


@torch.no_grad()
def test_encoding_updating_and_decoding_are_the_whole(network):
    images, at, state = some_views(1, 2)[0], cameras_at([0, 0]), network.initial_state(2)
    updated = network.update(network.encode(images, at), at, state)
    logits, known = network(images, at, state)
    assert_close(network.decode(updated), logits, rtol=0, atol=0)
    assert_close(known, updated, rtol=0, atol=0)
