"""The losses of the reconstruction: nothing where there is nothing to learn."""

from active_recon.config import LossConfig
from active_recon.geometry.cameras import AZIMUTHS, orbit_camera
from active_recon.training.losses import reconstruction_loss, silhouette_loss, volume_loss
from active_recon.volumes.silhouettes import frustum, project
import pytest
import torch
from torch.testing import assert_close

SURE = 30.0  # a logit: certain, and still finite


@pytest.fixture
def voxels(views):
    return views.voxels[[0, 3]].float()


@pytest.fixture
def frusta():
    return frustum([orbit_camera(AZIMUTHS[2]), orbit_camera(AZIMUTHS[11])])


def certain(voxels):
    return (2 * voxels - 1) * SURE


@pytest.mark.parametrize('kind', ['mse', 'bce', 'dice'])
def test_the_truth_costs_nothing_and_its_contrary_the_most(voxels, kind):
    assert volume_loss(certain(voxels), voxels, kind).item() == pytest.approx(0, abs=1e-6)
    worst = volume_loss(certain(1 - voxels), voxels, kind).item()
    unsure = volume_loss(torch.zeros_like(voxels), voxels, kind).item()
    assert 0 < unsure < worst


def test_mse_is_the_mean_over_the_cells(voxels):
    assert volume_loss(torch.zeros_like(voxels), voxels, 'mse').item() == pytest.approx(0.25)
    assert volume_loss(certain(1 - voxels), voxels, 'mse').item() == pytest.approx(1)


def test_bce_of_no_idea_is_the_logarithm_of_two(voxels):
    loss = volume_loss(torch.zeros_like(voxels), voxels, 'bce')
    assert_close(loss, torch.tensor(2.0).log())


def test_dice_counts_the_overlap_and_not_the_empty_cells(voxels):
    half = voxels.clone()
    half[:, 16:] = 0
    shared, union = half.sum((1, 2, 3)), half.sum((1, 2, 3)) + voxels.sum((1, 2, 3))
    expected = (1 - (2 * shared + 1) / (union + 1)).mean()
    assert_close(volume_loss(certain(half), voxels, 'dice'), expected, rtol=1e-4, atol=1e-5)


def test_silhouettes_of_the_truth_cost_nothing(voxels, frusta):
    assert silhouette_loss(certain(voxels), voxels, frusta).item() == pytest.approx(0, abs=1e-6)


def test_silhouettes_of_nothing_cost_the_outline(voxels, frusta):
    nothing = torch.full_like(voxels, -SURE)
    assert_close(silhouette_loss(nothing, voxels, frusta), project(voxels, frusta).square().mean())


def test_each_object_is_seen_from_its_own_camera(voxels, frusta):
    alone = [silhouette_loss(torch.zeros_like(voxels[:1]), voxels[b:b + 1], frusta[b:b + 1])
             for b in range(2)]
    together = silhouette_loss(torch.zeros_like(voxels), voxels, frusta)
    assert_close(together, torch.stack(alone).mean())
    assert abs(alone[0] - alone[1]) > 1e-4


def test_the_losses_are_weighted(voxels, frusta):
    logits = torch.zeros_like(voxels)
    total, parts = reconstruction_loss(logits, voxels, frusta, LossConfig())
    assert parts['volume'].item() == pytest.approx(0.25)
    assert parts['silhouette'].item() == pytest.approx(
        silhouette_loss(logits, voxels, frusta).item())
    assert total.item() == pytest.approx(0.4 * 0.25 + 0.6 * parts['silhouette'].item(), rel=1e-5)
    right, _ = reconstruction_loss(certain(voxels), voxels, frusta, LossConfig())
    assert right.item() == pytest.approx(0, abs=1e-6)


def test_squared_error_and_dice_may_be_joined(voxels):
    logits = torch.randn_like(voxels)
    assert_close(volume_loss(logits, voxels, 'mse+dice'),
                 volume_loss(logits, voxels, 'mse') + volume_loss(logits, voxels, 'dice') / 2)


def test_silhouettes_of_no_weight_are_not_computed(voxels):
    no_frusta = torch.empty(0)  # nothing could be projected with these
    total, parts = reconstruction_loss(torch.zeros_like(voxels), voxels, no_frusta,
                                       LossConfig(1.0, 0.0))
    assert set(parts) == {'volume'}
    assert total.item() == pytest.approx(0.25)


@pytest.mark.parametrize('kind', ['mse', 'bce', 'dice', 'mse+dice'])
def test_a_step_down_the_gradient_costs_less(voxels, frusta, kind):
    logits = torch.zeros_like(voxels, requires_grad=True)
    before, _ = reconstruction_loss(logits, voxels, frusta, LossConfig(volume_loss=kind))
    before.backward()
    step = logits - 0.1 * logits.grad / logits.grad.abs().max()
    after, _ = reconstruction_loss(step, voxels, frusta, LossConfig(volume_loss=kind))
    assert after < before
