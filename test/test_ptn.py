"""The Perspective Transformer Nets: the mean of codes, and learning from silhouettes alone."""

from active_recon.geometry.cameras import AZIMUTHS, orbit_camera
from active_recon.models.ptn import PerspectiveTransformerNet, PtnConfig, SIZES
from active_recon.models.registry import network_entry
from active_recon.training.losses import silhouette_loss
from active_recon.volumes.silhouettes import frustum, project_all
from active_recon.volumes.voxels import iou
import pytest
from shown_views import known_after
import torch
from torch.testing import assert_close


def test_the_two_variants_differ_in_their_loss_alone():
    alone, combined = network_entry('ptn'), network_entry('ptn-combined')
    assert (alone.loss.volume_weight, alone.loss.silhouette_weight) == (0, 1)
    assert (combined.loss.volume_weight, combined.loss.silhouette_weight) == (0.5, 0.5)
    assert combined.loss.volume_loss == 'mse'
    assert alone.sizes == combined.sizes


def test_several_views_are_decoded_from_the_mean_of_their_codes_in_any_order():
    torch.manual_seed(0)
    network = PerspectiveTransformerNet.from_config(SIZES['small'])
    images, codes = torch.rand(3, 2, 3, 64, 64), []
    for order in ((0, 1, 2), (2, 0, 1)):
        known = known_after(network, images[list(order)])
        codes.append(known.latent.flatten(1))
    assert_close(codes[0], codes[1])
    assert_close(codes[0], torch.stack([network.encoder(view) for view in images]).mean(0))
    assert known.latent.shape == (2, 256, 1, 1)


@pytest.mark.slow
def test_silhouettes_alone_teach_what_fills_them(views):
    torch.manual_seed(0)
    network = PerspectiveTransformerNet.from_config(PtnConfig(
        image_channels=(8, 8, 16), code_channels=(32, 32, 32), volume_channels=(16, 16, 8)))
    optimizer = torch.optim.Adam(network.parameters(), 5e-3)
    image = views.white(torch.tensor([3]), torch.tensor([0]))
    truth = views.voxels[3:4].float()
    frusta = frustum([orbit_camera(azimuth) for azimuth in AZIMUTHS])
    outlines = project_all(truth, frusta) > 0.5
    best = 0.0
    for step in range(400):
        seen = known_after(network, image[None])
        if step % 20 == 0:
            with torch.no_grad():
                found = project_all(seen.logits.sigmoid(), frusta) > 0.5
            best = iou(found, outlines, (-2, -1)).mean().item()
            if best > 0.9:
                break
        optimizer.zero_grad()
        silhouette_loss(seen.logits, truth, frusta[step * 7 % 24][None]).backward()
        optimizer.step()
    assert best > 0.9
