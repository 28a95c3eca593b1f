"""The attentive-recurrent visual model: what its proposal depends on, and who learns from whom."""

import math

import pytest
import torch
from torch.testing import assert_close


@pytest.fixture
def latent(tiny):
    torch.manual_seed(1)
    return torch.randn(4, 4 * tiny.latent_channels, 4, 4)


def proposed(attention, latent, azimuth, state=None):
    """Return the proposal and the next state after a view; without a state, the first."""
    return attention(latent, azimuth, state or attention.initial_state(len(latent)))


def at(azimuth, batch=4):
    return torch.full((batch,), float(azimuth))


def test_it_proposes_an_angle_and_a_baseline_for_each_episode(attention, latent, tiny):
    proposal, state = proposed(attention, latent, at(1.0))
    assert proposal.mean_azimuth.shape == proposal.baseline.shape == (4,)
    assert (proposal.mean_azimuth.abs() <= math.pi).all()
    assert {name: part.shape for name, part in state.items()} == {
        'hidden': (4, tiny.glimpse_channels), 'memory': (4, tiny.glimpse_channels)}


@pytest.mark.parametrize('azimuth', [0.0, 1.0, math.pi])
def test_the_latent_matters_even_where_the_azimuth_is_zero(attention, latent, azimuth):
    seeing, _ = proposed(attention, latent, at(azimuth))
    other, _ = proposed(attention, latent.roll(1, dims=0), at(azimuth))
    assert ((seeing.mean_azimuth - other.mean_azimuth).abs() > 1e-4).all()


@pytest.mark.parametrize('azimuth', [1.0, math.pi, 5.0])
def test_the_azimuth_matters(attention, latent, azimuth):
    here, _ = proposed(attention, latent, at(0.0))
    there, _ = proposed(attention, latent, at(azimuth))
    assert ((here.mean_azimuth - there.mean_azimuth).abs() > 1e-4).all()


@pytest.mark.parametrize('azimuth', [0.0, 1.0, 4.0])
def test_a_whole_turn_changes_nothing(attention, latent, azimuth):
    here, _ = proposed(attention, latent, at(azimuth))
    around, _ = proposed(attention, latent, at(azimuth - math.tau))
    assert_close(around, here, rtol=1e-4, atol=1e-5)


def test_the_state_is_passed_and_not_kept(attention, latent):
    _, state = proposed(attention, latent, at(1.0))
    once, _ = proposed(attention, latent, at(2.0), state)
    proposed(attention, latent.flip(0), at(3.0), state)
    again, _ = proposed(attention, latent, at(2.0), state)
    assert_close(again, once, rtol=0, atol=0)
    fresh, _ = proposed(attention, latent, at(2.0))
    assert ((fresh.mean_azimuth - once.mean_azimuth).abs() > 1e-5).all()


def test_episodes_of_a_batch_do_not_mix(attention, latent):
    together, _ = proposed(attention, latent, torch.arange(4.0))
    alone, _ = proposed(attention, latent[2:3], torch.tensor([2.0]))
    assert_close(together.mean_azimuth[2:3], alone.mean_azimuth)


def test_the_baseline_does_not_shape_the_policy(attention, latent):
    proposed(attention, latent, at(1.0))[0].baseline.sum().backward()
    learning = {name for name, parameter in attention.named_parameters()
                if parameter.grad is not None}
    assert learning == {'baseline.weight', 'baseline.bias'}


def test_the_location_teaches_all_but_the_baseline(attention, latent):
    proposed(attention, latent, at(1.0))[0].mean_azimuth.sum().backward()
    idle = {name for name, parameter in attention.named_parameters() if parameter.grad is None}
    assert idle == {'baseline.weight', 'baseline.bias'}
