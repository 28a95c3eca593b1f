"""What the lifting network promises, whatever it has learned."""

import copy
from dataclasses import replace
import math

from active_recon.errors import ConfigError
from active_recon.geometry.cameras import Camera, Intrinsics, orbit_camera
from active_recon.models import volume_unet
from active_recon.models.lifted import (
    aggregate,
    cell_centers,
    child_matrices,
    initial_statistics,
    projected,
    projection,
    sampled,
    summarise,
)
from active_recon.models.lifting import Lifting, LiftingConfig
from active_recon.models.lifting_encoder import Maps
from active_recon.models.network import Cameras
from active_recon.models.visibility import add_visible, visible_mean
from active_recon.models.volume_unet import Conv3d, depth_to_space, finer, space_to_depth
from active_recon.models.weights import load_weights
from active_recon.models.weights_files import config_hash, read_metadata, SHIPPED
import numpy as np
import pytest
import torch
from torch.testing import assert_close

TINY = LiftingConfig(encoder_channels=(4, 4, 8, 8), pyramid_channels=8, coarse_hidden=8,
                     coarse_channels=4, fine_channels=2, volume_channels=(8, 8, 8),
                     head_channels=4)
LENS = Intrinsics(140, 140, 64, 64, 128, 128)


@pytest.fixture(params=[False, True], ids=['plain', 'visibility'])
def lifting(request):
    torch.manual_seed(0)
    return Lifting.from_config(replace(TINY, visibility=request.param)).eval()


def cameras_at(*places):
    """Return cameras at azimuths, elevations (degrees) and distances, (N, ...)."""
    return Cameras.of([orbit_camera(math.radians(azimuth), math.radians(elevation), distance,
                                    LENS) for azimuth, elevation, distance in places])


def some_images(count, seed=0):
    return torch.rand(count, 3, 128, 128, generator=torch.Generator().manual_seed(seed))


VIEWS = cameras_at((10, 30, 2.1), (130, -5, 2.5), (250, 70, 1.9))


def after(lifting, images, cameras, order):
    """Return the state of one object after some of the views."""
    state = lifting.initial_state(1)
    for view in order:
        state = lifting.step(images[view:view + 1], cameras.rows(slice(view, view + 1)), state)
    return state


@torch.inference_mode()
def test_any_order_of_the_views_gives_the_same_occupancy(lifting):
    images = some_images(3)
    there, back = (lifting.decode(after(lifting, images, VIEWS, order)).sigmoid()
                   for order in ((0, 1, 2), (2, 0, 1)))
    assert_close(there, back, rtol=0, atol=1e-5)


@torch.inference_mode()
def test_views_at_once_and_one_by_one_give_the_same_state(lifting):
    images = some_images(3)
    at_once = lifting.update_from_maps(lifting.maps(images), VIEWS, lifting.initial_state(1))
    assert_close(at_once, after(lifting, images, VIEWS, (0, 1, 2)), rtol=1e-5, atol=1e-4)


@torch.inference_mode()
def test_an_object_s_occupancy_does_not_depend_on_its_batch(lifting):
    images = some_images(3)
    together, _ = lifting(images, VIEWS, lifting.initial_state(3))
    for row in range(3):
        alone = lifting.decode(after(lifting, images, VIEWS, [row]))
        assert_close(together[row:row + 1], alone, rtol=1e-4, atol=1e-4)


@torch.inference_mode()
def test_the_state_is_of_one_size_and_zero_before_the_first_view(lifting):
    images, before = some_images(3), lifting.initial_state(1)
    assert not any(part.any() for part in before.values())
    known = after(lifting, images, VIEWS, (0, 1, 2, 0, 1))
    assert {name: (part.shape, part.dtype) for name, part in known.items()} == {
        name: (part.shape, part.dtype) for name, part in before.items()}


@torch.inference_mode()
def test_what_a_camera_does_not_see_it_says_nothing_of(lifting):
    away = Camera(orbit_camera(0.0, 0.3, 2.1).pose @ np.diag([-1.0, 1, -1, 1]), LENS)
    aside = Camera(orbit_camera(0.0, 0.3, 2.1).pose, replace(LENS, cx=-2000.0))
    for camera in (away, aside):
        state = lifting.step(some_images(1), Cameras.of([camera]), lifting.initial_state(1))
        assert not any(part.any() for part in state.values())


@torch.inference_mode()
def test_what_the_image_does_not_hold_says_nothing(lifting):
    unseen = torch.cat([some_images(1), torch.zeros(1, 1, 128, 128)], dim=1)
    state = lifting.step(unseen, VIEWS.rows(slice(0, 1)), lifting.initial_state(1))
    assert not any(part.any() for part in state.values())


@torch.inference_mode()
def test_an_image_without_a_fourth_channel_was_seen_whole(lifting):
    images = some_images(1)
    whole = torch.cat([images, torch.ones(1, 1, 128, 128)], dim=1)
    camera = VIEWS.rows(slice(0, 1))
    assert_close(lifting.encode(whole, camera), lifting.encode(images, camera))


@torch.inference_mode()
def test_the_state_turns_by_a_quarter_with_the_frame_and_the_cameras(lifting):
    images = some_images(3)
    maps = lifting.maps(images)
    turned = VIEWS.turned(torch.full((3,), math.pi / 2))
    here = lifting.update_from_maps(maps, VIEWS, lifting.initial_state(3))
    there = lifting.update_from_maps(maps, turned, lifting.initial_state(3))
    for state in (here, there):
        state['hull'] = depth_to_space(state['hull'])  # (3, 2, 64, 64, 64)
    for name in ('fine_sum', 'fine_count', 'hull'):
        assert_close(torch.rot90(here[name], 1, (2, 3)), there[name], rtol=0, atol=1e-3)


def test_points_are_projected_as_the_camera_projects_them():
    camera = orbit_camera(0.4, -0.1, 1.7, Intrinsics(150, 140, 60, 70, 128, 128))
    where, depth = projected(projection(Cameras.of([camera]), 128), 8)
    pixels, depths = camera.project(cell_centers(8).numpy())
    np.testing.assert_allclose((where[0].numpy() + 1) * 64, pixels, atol=1e-3)
    np.testing.assert_allclose(depth[0].numpy(), depths, atol=1e-5)


def test_the_halves_of_cells_are_the_cells_of_a_grid_of_twice_as_many():
    matrices = projection(VIEWS, 128)
    where, depth = projected(child_matrices(matrices, 4), 4)
    fine_where, fine_depth = projected(matrices, 8)
    assert_close(depth_to_space(depth.reshape(3, 8, 4, 4, 4)).flatten(1), fine_depth)
    assert_close(depth_to_space(where.reshape(3, 8, 4, 4, 4, 2).permute(0, 5, 1, 2, 3, 4)
                                .reshape(3, 16, 4, 4, 4)).flatten(2).transpose(1, 2), fine_where)


def test_a_map_is_sampled_at_the_centres_of_its_pixels():
    maps = torch.arange(16.0).reshape(1, 1, 4, 4)
    centers = torch.tensor([[[-0.75, -0.75], [0.75, -0.75], [-0.25, 0.75]]])
    assert_close(sampled(maps, centers)[0, 0], torch.tensor([0.0, 3.0, 13.0]))


def test_view_statistics_are_mean_deviation_and_extremes():
    known = initial_statistics(1, 1, 1, torch.device('cpu'))
    for value, weight in ((3.0, 1.0), (7.0, 0.0), (-1.0, 1.0)):
        known = aggregate(known, torch.full((1, 1, 1), value), torch.full((1, 1, 1), weight))
    statistics, inverse = summarise(known)
    mean, deviation, highest, lowest = statistics.flatten().tolist()
    assert (mean, highest, lowest, inverse.item()) == (1, 3, -1, 0.5)
    assert deviation == pytest.approx((4 + 0.01) ** 0.5)


def test_the_visible_mean_is_a_softmax_over_views_and_an_empty_slot():
    generator = torch.Generator().manual_seed(1)
    features = torch.randn(3, 2, 4, 8, generator=generator)
    logits = 3 * torch.randn(3, 2, 1, 8, generator=generator)
    inside = (torch.rand(3, 2, 1, 8, generator=generator) > 0.3).float()
    nothing = torch.zeros(2, 1, 2, 2, 2), torch.zeros(2, 4, 2, 2, 2)
    found = visible_mean(*add_visible(*nothing, features, logits, inside))
    shown = torch.where(inside > 0, logits, -torch.inf)
    shares = torch.cat([shown, torch.zeros(1, 2, 1, 8)]).softmax(dim=0)[:-1]
    assert_close(found, (shares * features).sum(dim=0).reshape(2, 4, 2, 2, 2))


@pytest.mark.parametrize('logit', [1e4, -1e4])
def test_no_logit_makes_a_visible_mean_overflow(logit):
    known = torch.zeros(1, 1, 1, 1, 1), torch.zeros(1, 1, 1, 1, 1)
    many = torch.full((1000, 1, 1, 1), 5.0)
    found = visible_mean(*add_visible(*known, many, many / 5 * logit, many / 5))
    assert 0 < found.item() <= 5


def test_sizes_without_visibility_are_written_as_before_it_was_an_option():
    plain, with_it = LiftingConfig(), LiftingConfig(visibility=True)
    assert 'visibility' not in plain.to_dict()
    for config in (plain, with_it):
        assert LiftingConfig.from_dict(config.to_dict()) == config
    assert config_hash(load_weights().config) == config_hash(read_metadata(SHIPPED).config)


def test_view_statistics_have_the_gradients_that_torch_derives():
    generator = torch.Generator().manual_seed(1)
    found = torch.randn(3, 2, 4, 8, generator=generator, dtype=torch.float64).requires_grad_()
    inside = (torch.rand(3, 2, 1, 8, generator=generator) > 0.3).double()
    nothing = {name: value.double() for name, value in initial_statistics(2, 4, 2, None).items()}

    def aggregated(features):
        known = aggregate(nothing, features, inside)
        return tuple(known[name] for name in ('sum', 'sum_squares', 'max', 'min'))

    assert torch.autograd.gradcheck(aggregated, (found,))


def test_depth_to_space_inverts_space_to_depth():
    cells = torch.rand(2, 3, 8, 8, 8)
    assert_close(depth_to_space(space_to_depth(cells)), cells)
    assert space_to_depth(cells)[1, 8 + 5, 1, 2, 3] == cells[1, 1, 3, 4, 7]  # 5 is x and z


def test_a_graph_has_the_same_finer_cells_by_a_transposed_convolution(monkeypatch):
    layer, cells = torch.nn.Conv3d(3, 16, 1), torch.rand(1, 3, 4, 4, 4)
    expected = finer(layer, cells)
    assert expected.shape == (1, 2, 8, 8, 8)
    monkeypatch.setattr(volume_unet, 'is_traced', lambda: True)
    assert_close(finer(layer, cells), expected)


@torch.inference_mode()
def test_a_cell_beyond_a_silhouette_is_emptier_by_the_hull_alone(lifting):
    for part in (lifting.decoder.to_64, lifting.decoder.to_32):
        torch.nn.init.zeros_(part.weight)
        torch.nn.init.zeros_(part.bias)
    maps = lifting.maps(some_images(1))
    only_left = torch.full((1, 1, 128, 128), 6.0)
    only_left[..., 64:] = -6.0
    front = cameras_at((0, 0, 2.1))
    state = lifting.update_from_maps(Maps(maps.coarse, maps.fine, maps.seen, only_left), front,
                                     lifting.initial_state(1))
    logits = lifting.decode(state)[0]
    # Seen from +x, the image's left is -y
    assert (logits[:, 40:].amax() < -2) and (logits[:, :24].amin() > -0.1)


def test_gradients_reach_every_weight(lifting):
    images = some_images(2)
    state = lifting.initial_state(2)
    maps = lifting.maps(images)
    for cameras in (VIEWS.rows(slice(0, 2)), VIEWS.rows(slice(1, 3))):
        state = lifting.update_from_maps(maps, cameras, state)
    logits, coarse, _ = lifting.logits(state)
    (logits.square().mean() + coarse.square().mean() + maps.foreground.mean()).backward()
    lacking = [name for name, weight in lifting.named_parameters()
               if weight.grad is None or not weight.grad.any()]
    assert lacking == []
    assert lifting.coarse.mix.weight.grad.flatten(1).any(dim=1).all()  # features, and the logit


@torch.inference_mode()
def test_weights_with_a_temperature_for_each_number_of_views_still_load(lifting):
    weights = lifting.state_dict()
    count = len(weights.pop('calibration'))
    loaded = copy.deepcopy(lifting)
    loaded.load_state_dict({**weights, 'temperatures': torch.linspace(1, 2, count)})
    for views, temperature in ((1, 1.0), (2, 1 + 1 / (count - 1))):
        state = after(lifting, some_images(2), VIEWS, range(views))
        logits = depth_to_space(lifting.logits(state).logits)[:, 0]
        assert_close(loaded.decode(state), logits / temperature)


@torch.inference_mode()
def test_half_precision_changes_little(lifting):
    images = some_images(1)
    exact = lifting.decode(after(lifting, images, VIEWS, [0])).sigmoid()
    with torch.autocast('cpu', torch.bfloat16):
        half = lifting.decode(after(lifting, images, VIEWS, [0])).sigmoid()
    assert (exact - half).abs().mean() < 0.02


def test_sizes_that_make_no_network_are_refused():
    with pytest.raises(ConfigError, match='invalid channels: expected 1 or more'):
        LiftingConfig(head_channels=0)


def test_a_convolution_gives_the_same_with_and_without_gradients():
    convolution, cells = Conv3d(6), torch.randn(1, 6, 5, 5, 5)
    with torch.no_grad():
        assert_close(convolution(cells), torch.nn.functional.conv3d(
            cells, convolution.weight, convolution.bias, padding=1))
    assert_close(convolution(cells).detach(), torch.nn.functional.conv3d(
        cells, convolution.weight, convolution.bias, padding=1).detach())


class OneView(torch.nn.Module):
    """A network's whole step, from tensors to tensors."""

    def __init__(self, network):
        super().__init__()
        self.network = network

    def forward(self, image, pose, intrinsics, state):
        """Return the logits and the next state."""
        return self.network(image, Cameras(pose, intrinsics), state)


def test_a_whole_step_looks_maps_up_in_two_dimensions(monkeypatch):
    dimensions, look_up = set(), torch.nn.functional.grid_sample
    monkeypatch.setattr(torch.nn.functional, 'grid_sample', lambda maps, *others, **more: (
        dimensions.add(maps.ndim), look_up(maps, *others, **more))[1])
    lifting = Lifting.from_config(replace(TINY, visibility=True)).eval()
    with torch.no_grad():
        lifting(some_images(1), VIEWS.rows(slice(0, 1)), lifting.initial_state(1))
    assert dimensions == {4}


@pytest.mark.slow
def test_a_whole_step_exports_and_looks_maps_up_in_two_dimensions():
    torch.manual_seed(0)
    lifting = Lifting.from_config(replace(TINY, visibility=True)).eval()
    image, camera = some_images(1), VIEWS.rows(slice(0, 1))
    arguments = image, camera.poses, camera.intrinsics, lifting.initial_state(1)
    with torch.no_grad():
        exported = torch.export.export(OneView(lifting), arguments)
        ours, _ = lifting(image, camera, arguments[3])
        theirs, _ = exported.module()(*arguments)
    assert_close(theirs, ours)
    dimensions = {node.meta['val'].ndim for node in exported.graph.nodes
                  if 'grid_sampler' in str(node.target)}
    assert dimensions == {4}
