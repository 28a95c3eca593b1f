"""The attentive-recurrent visual model: what its proposal depends on, and who learns from whom."""

import math

import pytest
import torch
from torch.testing import assert_close


@pytest.fixture
def latent(tiny):
    torch.manual_seed(1)
    return torch.randn(4, 4 * tiny.latent_channels, 4, 4)


def at(azimuth, batch=4):
    return torch.full((batch,), float(azimuth))


def test_it_proposes_an_angle_and_a_baseline_for_each_episode(attention, latent, tiny):
    proposal, state = attention(latent, at(1.0))
    assert proposal.mean_azimuth.shape == proposal.baseline.shape == (4,)
    assert (proposal.mean_azimuth.abs() <= math.pi).all()
    assert [part.shape for part in state] == [(4, tiny.glimpse_channels)] * 2


@pytest.mark.parametrize('azimuth', [0.0, 1.0, math.pi])
def test_the_latent_matters_even_where_the_azimuth_is_zero(attention, latent, azimuth):
    seeing, _ = attention(latent, at(azimuth))
    other, _ = attention(latent.roll(1, dims=0), at(azimuth))
    assert ((seeing.mean_azimuth - other.mean_azimuth).abs() > 1e-4).all()


@pytest.mark.parametrize('azimuth', [1.0, math.pi, 5.0])
def test_the_azimuth_matters(attention, latent, azimuth):
    here, _ = attention(latent, at(0.0))
    there, _ = attention(latent, at(azimuth))
    assert ((here.mean_azimuth - there.mean_azimuth).abs() > 1e-4).all()


@pytest.mark.parametrize('azimuth', [0.0, 1.0, 4.0])
def test_a_whole_turn_changes_nothing(attention, latent, azimuth):
    here, _ = attention(latent, at(azimuth))
    around, _ = attention(latent, at(azimuth - math.tau))
    assert_close(around, here, rtol=1e-4, atol=1e-5)


def test_the_state_is_passed_and_not_kept(attention, latent):
    _, state = attention(latent, at(1.0))
    once, _ = attention(latent, at(2.0), state)
    attention(latent.flip(0), at(3.0), state)
    again, _ = attention(latent, at(2.0), state)
    assert_close(again, once, rtol=0, atol=0)
    fresh, _ = attention(latent, at(2.0))
    assert ((fresh.mean_azimuth - once.mean_azimuth).abs() > 1e-5).all()


def test_episodes_of_a_batch_do_not_mix(attention, latent):
    together, _ = attention(latent, torch.arange(4.0))
    alone, _ = attention(latent[2:3], torch.tensor([2.0]))
    assert_close(together.mean_azimuth[2:3], alone.mean_azimuth)


def test_the_baseline_does_not_shape_the_policy(attention, latent):
    attention(latent, at(1.0))[0].baseline.sum().backward()
    learning = {name for name, parameter in attention.named_parameters()
                if parameter.grad is not None}
    assert learning == {'baseline.weight', 'baseline.bias'}


def test_the_location_teaches_all_but_the_baseline(attention, latent):
    attention(latent, at(1.0))[0].mean_azimuth.sum().backward()
    idle = {name for name, parameter in attention.named_parameters() if parameter.grad is None}
    assert idle == {'baseline.weight', 'baseline.bias'}
