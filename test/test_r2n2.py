"""3D-R2N2: its memory, its last doubling, and that it can learn."""

from active_recon.models.r2n2 import ConvGRUCell, R2n2, R2n2Config, SIZES
from learning_by_heart import iou_by_heart
import pytest
from shown_views import known_after
import torch
from torch import nn
from torch.testing import assert_close


def test_the_latent_is_the_memory_laid_flat():
    network = R2n2.from_config(SIZES['small'])
    known = known_after(network, torch.rand(1, 2, 3, 64, 64))
    assert known.state['memory'].shape == (2, 32, 4, 4, 4)
    assert known.latent.shape == (2, 128, 4, 4)
    assert_close(known.latent.flatten(), known.state['memory'].flatten())


def test_the_memory_keeps_what_an_update_gate_of_1_tells_it_to_keep():
    cell = ConvGRUCell(3, 2)
    nn.init.constant_(cell.from_code.bias, 1e4)
    hidden = torch.rand(1, 2, 4, 4, 4)
    assert_close(cell(torch.zeros(1, 3), hidden), hidden)


def test_the_memory_stays_between_minus_1_and_1():
    cell, hidden = ConvGRUCell(3, 2), torch.zeros(1, 2, 4, 4, 4)
    for code in 50 * torch.randn(20, 1, 3):
        hidden = cell(code, hidden)
        assert hidden.abs().max() <= 1


def test_the_published_decoder_doubles_three_times_and_the_small_one_too():
    for config in (SIZES['small'], SIZES['published']):
        with torch.device('meta'):
            network = R2n2.from_config(config)
            logits = network.decode(network.initial_state(1))
        assert logits.shape == (1, 32, 32, 32)


@pytest.mark.slow
def test_a_small_network_learns_one_object_by_heart(views):
    torch.manual_seed(0)
    network = R2n2.from_config(R2n2Config(
        encoder_channels=(8, 8, 8, 16, 16, 16), code_channels=32, hidden_channels=16,
        decoder_channels=(16, 16)))
    assert iou_by_heart(network, views) > 0.9
