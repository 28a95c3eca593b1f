"""Batches in which images, cameras and voxels agree however they are turned, and what learns."""

from contextlib import nullcontext

from active_recon.config import LossConfig
from active_recon.datasets.drawn_cameras import Viewing
from active_recon.datasets.layout import list_objects
from active_recon.datasets.making import make_dataset, shape_jobs
from active_recon.datasets.views import read_views
from active_recon.models.carving import Carving
from active_recon.models.lifting import Lifting, LiftingConfig
from active_recon.models.network import Cameras
from active_recon.models.network_2d3d_posed import Network2d3dPosed, Network2d3dPosedConfig
from active_recon.models.volume_unet import depth_to_space
from active_recon.training import calibration
from active_recon.training.calibration import calibrate
from active_recon.training.lifting import LiftingLearner, train_lifting
from active_recon.training.loop import make_fabric, Run, TrainingConfig
from active_recon.training.losses import volume_loss
from active_recon.training.posed_augmentation import augment_posed, perturb_poses
from active_recon.training.posed_batches import draw_posed_batch, turned_by_quarters
from active_recon.training.supervised import train_reconstruction
from active_recon.volumes.voxels import iou
import numpy as np
import pytest
from shown_views import part_of
import torch
from torch.testing import assert_close

TINY = LiftingConfig(encoder_channels=(8, 8, 8, 8), pyramid_channels=8, coarse_hidden=8,
                     coarse_channels=4, fine_channels=2, volume_channels=(8, 8, 8),
                     head_channels=4)
TINY_POSED = Network2d3dPosedConfig(
    stem_channels=4, block_channels=(6, 8, 8), recurrent_channels=8, bottleneck_channels=16,
    latent_channels=2, volume_channels=6, decoder_channels=(6, 4), camera_channels=8)
LOSS = LossConfig(1, 0, 'bce+dice')


@pytest.fixture(scope='module')
def seen_anyhow(tmp_path_factory):
    """Return four chairs at any yaw, each seen by eight cameras of any kind."""
    out = tmp_path_factory.mktemp('any')
    list(make_dataset(shape_jobs('chair', range(4), out), 1, fine=True,
                      viewing=Viewing('any', 8, turned=True)))
    return read_views(list_objects(out), resolution=64, image_size=128, framed=True)


@pytest.fixture(scope='module')
def seen_four_times(seen_anyhow):
    """Return two of the chairs with four views of each."""
    return part_of(seen_anyhow, slice(2), slice(4))


@pytest.fixture(scope='module')
def seen_coarsely(seen_anyhow):
    """Return the same views with voxels of 32 cells."""
    return read_views(seen_anyhow.folders, resolution=32, image_size=128, framed=True)


def carved(batch):
    """Return what the true silhouettes of a batch leave, (B, 64, 64, 64) bool."""
    network = Carving(0)
    state = network.initial_state(len(batch.voxels))
    for alpha, image, number in zip(batch.alpha, batch.images, range(len(batch.images)),
                                    strict=True):
        shown = torch.cat([alpha[:, None].expand(-1, 3, -1, -1) * image[:, 3:], image[:, 3:]], 1)
        state = network.step(shown, batch.cameras.rows(number), state)
    return network.decode(state) > -3  # an eighth of a pixel is enough


@pytest.mark.parametrize('seed', range(3))
def test_mirrored_and_turned_batches_still_agree_with_their_voxels(seen_anyhow, seed):
    batch = draw_posed_batch(seen_anyhow, 6, 5, np.random.default_rng(seed), augment=False)
    left, truth = carved(batch), batch.voxels > 0
    assert ((left & truth).sum((1, 2, 3)) > 0.85 * truth.sum((1, 2, 3))).all()
    astray = carved(type(batch)(batch.images, batch.cameras.turned(torch.full((5, 6), 0.8)),
                                batch.alpha, batch.voxels, batch.objects))
    better = iou(left, truth) - iou(astray, truth)
    assert better.min() > 0 and better.mean() > 0.08


def test_voxels_turn_counter_clockwise():
    voxels = torch.zeros(4, 4, 2)
    voxels[3, 1, 0] = 1  # towards +x
    assert turned_by_quarters(voxels, 1)[2, 3, 0] == 1  # towards +y


def test_the_same_seed_draws_the_same_batch(seen_anyhow):
    first, again, other = (draw_posed_batch(seen_anyhow, 2, 2, np.random.default_rng(seed))
                           for seed in (1, 1, 2))
    assert_close(first.images, again.images)
    assert_close(first.cameras.poses, again.cameras.poses)
    assert not torch.equal(first.images, other.images)


@pytest.mark.parametrize('augment', (False, True))
def test_a_sequence_has_no_more_views_than_its_objects(seen_anyhow, augment):
    batch = draw_posed_batch(seen_anyhow, 2, 9, np.random.default_rng(0), augment)
    assert batch.images.shape[:2] == batch.cameras.poses.shape[:2] == (8, 2)


def test_pictures_are_in_range_and_lose_only_what_they_say(seen_anyhow):
    objects, chosen = torch.arange(4).expand(3, 4), torch.arange(3)[:, None].expand(3, 4)
    seen = seen_anyhow.seen[objects, chosen]
    pictures = augment_posed(seen_anyhow.images[objects, chosen], seen,
                             seen_anyhow.cameras(objects, chosen), seen_anyhow.voxels.float(),
                             seen_anyhow, np.random.default_rng(0))
    assert pictures.shape == (3, 4, 4, 128, 128)
    assert pictures.min() >= 0 and pictures.max() <= 1
    assert not (pictures[:, :, 3] > seen).any()
    assert not pictures[:, :, :3][(pictures[:, :, 3:] == 0).expand(-1, -1, 3, -1, -1)].any()


def test_poses_are_off_by_a_degree_and_a_hundredth_at_most(seen_anyhow):
    objects, chosen = torch.arange(4).repeat(5), torch.arange(20) % 8
    cameras = seen_anyhow.cameras(objects, chosen)
    cameras = Cameras(*(part[None] for part in cameras))
    off = perturb_poses(cameras, np.random.default_rng(0))
    turn = cameras.poses[..., :3, :3].transpose(-1, -2) @ off.poses[..., :3, :3]
    angles = torch.rad2deg(((turn.diagonal(dim1=-2, dim2=-1).sum(-1) - 1) / 2).clamp(-1, 1).acos())
    assert 0.3 < angles.max() <= 1.0001
    assert 0.2 < (angles < 1e-4).double().mean() < 0.8  # half of them stay where they are
    moved = (off.poses - cameras.poses)[..., :3, 3].norm(dim=-1)
    assert 0 < (moved / cameras.poses[..., :3, 3].norm(dim=-1)).max() <= 0.01 + 1e-9


@pytest.mark.parametrize(('network_class', 'config', 'train', 'views'), [
    (Lifting, TINY, train_lifting, 'seen_anyhow'),
    (Network2d3dPosed, TINY_POSED, train_reconstruction, 'seen_coarsely')],
    ids=['lifting', '2d3d-posed'])
def test_a_training_that_was_cut_off_goes_on_as_if_it_was_not_whoever_draws(
        network_class, config, train, views, tmp_path, request):
    seen = request.getfixturevalue(views)

    def learned(path, until=None, resume=False, draw_threads=0):
        torch.manual_seed(0)
        network = network_class.from_config(config)
        train(network, seen,
              TrainingConfig(2, 2, 3e-3, 2, bfloat16=False, warmup_steps=1, checkpoint_every=1,
                             validate_every=100), LOSS,
              Run(make_fabric(False), path, lambda step, measured: None, resume, until,
                  draw_threads=draw_threads), lambda model: {})
        return network

    whole = learned(tmp_path / 'whole.safetensors')
    learned(tmp_path / 'cut.safetensors', until=1)
    resumed = learned(tmp_path / 'cut.safetensors', resume=True, draw_threads=2)
    for name, weight in whole.state_dict().items():
        assert_close(resumed.state_dict()[name], weight, rtol=1e-4, atol=1e-5)


def test_the_loss_is_the_mean_of_those_after_the_first_and_after_the_last_view(seen_anyhow):
    torch.manual_seed(0)
    network = Lifting.from_config(TINY)
    learner = LiftingLearner(network, LOSS)
    batch = draw_posed_batch(seen_anyhow, 2, 3, np.random.default_rng(0), augment=False)

    def after(count):
        state = network.initial_state(2)
        for view in range(count):
            state = network.step(batch.images[view], batch.cameras.rows(view), state)
        logits = depth_to_space(network.logits(state).logits)[:, 0]
        return volume_loss(logits, batch.voxels, 'bce+dice')

    def volume(count):
        return learner(batch.images[:count], batch.cameras.rows(slice(count)),
                       batch.alpha[:count], batch.voxels)['volume']

    assert_close(volume(1), after(1))
    assert_close(volume(3), (after(1) + after(3)) / 2)


@pytest.mark.parametrize('bfloat16', [False, pytest.param(True, marks=pytest.mark.slow)])
def test_the_losses_fall(seen_anyhow, bfloat16):
    torch.manual_seed(0)
    learner = LiftingLearner(Lifting.from_config(TINY), LOSS)
    optimizer = torch.optim.AdamW(learner.parameters(), 2e-2)
    batch = draw_posed_batch(seen_anyhow, 1, 2, np.random.default_rng(0), augment=False)
    heard = []
    for _ in range(6):
        with torch.autocast('cpu', torch.bfloat16) if bfloat16 else nullcontext():
            losses = learner(batch.images, batch.cameras, batch.alpha, batch.voxels)
        optimizer.zero_grad()
        losses['loss'].backward()
        optimizer.step()
        heard.append({name: value.item() for name, value in losses.items()})
    assert heard[-1]['loss'] < 0.9 * heard[0]['loss']
    assert heard[-1]['silhouette'] < heard[0]['silhouette']


def test_calibration_makes_the_truth_of_validation_more_likely(seen_four_times):
    torch.manual_seed(0)
    network = Lifting.from_config(TINY).eval()
    with torch.no_grad():
        network.decoder.to_64.bias.mul_(8)  # far too confident

    def nats():
        state = network.initial_state(2)
        for view in range(2):
            own, chosen = torch.arange(2), torch.full((2,), view)
            state = network.step(seen_four_times.white(own, chosen),
                                 seen_four_times.cameras(own, chosen), state)
        return torch.nn.functional.binary_cross_entropy_with_logits(
            network.decode(state), seen_four_times.voxels.float()).item()

    with torch.no_grad():
        before = nats()
        calibrate(network, seen_four_times)
        assert nats() < before
    fitted = network.calibration[:4]  # as many views as there are
    assert len(fitted.unique(dim=0)) == 4
    assert_close(network.calibration[3:], fitted[-1:].expand(9, 3))


def test_calibration_twice_gives_what_it_gave_once(seen_four_times):
    torch.manual_seed(0)
    network = Lifting.from_config(TINY).eval()
    calibrate(network, seen_four_times)
    once = network.calibration.clone()
    calibrate(network, seen_four_times)
    assert_close(network.calibration, once)


@pytest.mark.parametrize('has', [True, False])
def test_calibration_is_in_mixed_precision_only_where_the_processor_has_it(
        seen_four_times, monkeypatch, has):
    kinds = set()

    class Told(Lifting):
        def encode(self, images, cameras):
            kinds.add(torch.is_autocast_enabled('cpu'))
            return super().encode(images, cameras)

    monkeypatch.setattr(calibration, 'has_bf16', lambda: has)
    calibrate(Told.from_config(TINY), part_of(seen_four_times, slice(1), slice(2)))
    assert kinds == {has}
