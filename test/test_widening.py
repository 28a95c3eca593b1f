"""A network made wider gives nearly what it gave, and every channel of it learns for itself."""

from dataclasses import replace

from active_recon.config import LossConfig
from active_recon.errors import ConfigError
from active_recon.geometry.cameras import orbit_camera
from active_recon.models.lifting import Lifting, LiftingConfig, SIZES
from active_recon.models.network import Cameras
from active_recon.models.weights import Bundle, load_weights
from active_recon.models.weights_files import find_weights
from active_recon.models.widening import widened
from active_recon.training.lifting import LiftingLearner
from command_line import refusal
import pytest
import torch

NARROW = LiftingConfig(
    encoder_channels=(4, 8, 8, 16), pyramid_channels=8, coarse_hidden=6, coarse_channels=6,
    fine_channels=2, volume_channels=(8, 16, 16), head_channels=4)
WIDE = LiftingConfig(
    encoder_channels=(6, 16, 16, 24), pyramid_channels=12, coarse_hidden=8, coarse_channels=8,
    fine_channels=3, volume_channels=(16, 24, 32), head_channels=6, encoder_depth=2)
DOUBLED = LiftingConfig(
    encoder_channels=(8, 16, 16, 32), pyramid_channels=16, coarse_hidden=12, coarse_channels=12,
    fine_channels=4, volume_channels=(16, 32, 32), head_channels=8)


def narrow(config=NARROW):
    torch.manual_seed(0)
    network = Lifting.from_config(config)
    with torch.no_grad():  # as after training: no layer without an effect
        for parameter in network.parameters():
            parameter.add_(0.05 * torch.randn_like(parameter))
    return Bundle(network, None, config, 0.4, {'step': 3}, 'lifting')


def shown(views=3):
    torch.manual_seed(1)
    cameras = [orbit_camera(0.9 * number).scaled(1.0) for number in range(views)]
    poses = torch.stack([torch.tensor(camera.pose) for camera in cameras])
    lenses = torch.stack([torch.tensor(camera.intrinsics.resized(128, 128).matrix)
                          for camera in cameras])
    return torch.rand(views, 3, 128, 128), Cameras(poses, lenses)


@torch.inference_mode()
def occupancy(network):
    images, cameras = shown()
    network.eval()
    state = network.initial_state(1)
    for number, image in enumerate(images):
        state = network.step(image[None], cameras.rows(slice(number, number + 1)), state)
    return network.decode(state).sigmoid()


def test_a_network_of_twice_the_channels_gives_nearly_the_same():
    before = narrow()
    found = occupancy(widened(before, DOUBLED).reconstruction)
    assert (found - occupancy(before.reconstruction)).abs().mean() < 0.01


def test_channels_of_normalised_layers_that_are_not_all_doubled_change_little():
    before = narrow()
    own = occupancy(before.reconstruction)
    fresh = occupancy(Lifting.from_config(WIDE))
    found = occupancy(widened(before, WIDE).reconstruction)
    assert (found - own).abs().mean() < 0.3 * (fresh - own).abs().mean()


def test_every_channel_of_a_wider_layer_learns_for_itself():
    wide = widened(narrow(), DOUBLED).reconstruction
    images, cameras = shown(1)
    voxels = torch.zeros(1, 64, 64, 64)
    voxels[:, 20:40, 20:40, 20:40] = 1
    whole = torch.cat([images, torch.ones_like(images[:, :1])], dim=1)[None]
    losses = LiftingLearner(wide, LossConfig(1, 0, 'bce+dice'))(
        whole, Cameras(cameras.poses[None], cameras.intrinsics[None]),
        torch.rand(1, 1, 128, 128), voxels)
    losses['loss'].backward()
    gradient = wide.decoder.at_4.layers[0].weight.grad.flatten(1)
    assert torch.unique(gradient, dim=0).shape[0] == len(gradient)


def test_the_weights_that_ship_widen_to_the_large_size():
    before = load_weights(find_weights('lifting'))
    after = widened(before, SIZES['large'])
    assert after.config == SIZES['large'] and after.threshold == before.threshold
    assert after.card['widened_from'] == before.config.to_dict()
    assert torch.equal(after.reconstruction.calibration, before.reconstruction.calibration)


def test_what_is_new_in_a_wider_network_is_the_same_each_time():
    found = []
    for begun in (1, 2):
        torch.manual_seed(begun)  # of a process: torch begins elsewhere in each
        found.append(widened(narrow(), replace(DOUBLED, encoder_depth=2)).reconstruction)
    for name, tensor in found[0].state_dict().items():
        assert torch.equal(tensor, found[1].state_dict()[name]), name


@pytest.mark.parametrize('sizes, said', [
    (replace(WIDE, head_channels=2), '4 channels cannot be widened to 2'),
    (replace(WIDE, head_channels=9), '4 channels cannot be widened to 9'),
    (replace(WIDE, volume_channels=(12, 24, 32)), 'multiples of 8'),
    (replace(WIDE, visibility=True), 'no visibility')])
def test_sizes_that_do_not_hold_the_network_are_refused(sizes, said):
    with pytest.raises(ConfigError, match=said):
        widened(narrow(), sizes)


def test_a_network_that_lifts_nothing_is_refused():
    with pytest.raises(ConfigError, match='expected a lifting network'):
        widened(load_weights(find_weights('carving')), WIDE)


@pytest.mark.parametrize('options, said', [
    (['--widen-to', 'large'], 'without --init-from'),
    (['--widen-to', 'large', '--init-from', '2d3d', '--model', '2d3d'], 'has no size'),
    (['--widen-to', 'published', '--init-from', '2d3d', '--model', '2d3d'], '--model lifting')])
def test_train_refuses_to_widen_what_it_cannot(options, said, tmp_path, monkeypatch, capsys):
    assert said in refusal(monkeypatch, capsys, 'train', tmp_path, '--validation', tmp_path,
                           '--out', tmp_path / 'run', *options)
