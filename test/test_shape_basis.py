"""The shape basis: distances, principal shapes, and fitting them to silhouettes."""

from active_recon.errors import DataError
from active_recon.geometry.cameras import orbit_camera
from active_recon.models.registry import network_entry
from active_recon.models.shape_basis import (
    fit_shapes,
    frusta_at,
    outlines_of,
    ShapeBasis,
    ShapeBasisConfig,
    signed_distance,
    SIZES,
)
from active_recon.models.weights import Bundle, save_weights
from active_recon.shapes import CATEGORIES
from active_recon.volumes.silhouettes import frustum, project
from active_recon.volumes.voxels import iou
import numpy as np
import pytest
from shown_views import cameras_at
import torch
from torch.testing import assert_close


def box(x, y, z):
    """Return a box of so many cells, centred, (32, 32, 32)."""
    voxels = torch.zeros(32, 32, 32, dtype=torch.bool)
    sides = [slice(16 - side // 2, 16 + side // 2) for side in (x, y, z)]
    voxels[tuple(sides)] = True
    return voxels


def ball(radius):
    place = (torch.arange(32) - 15.5).square()
    return place[:, None, None] + place[:, None] + place < radius ** 2


def seen(voxels, azimuths):
    """Return black images on white, (B, 3, 64, 64), of voxels (B, 32, 32, 32)."""
    frusta = frustum([orbit_camera(azimuth) for azimuth in azimuths.tolist()], image_size=64)
    outline = project(voxels.float(), frusta) > 0.5
    return (~outline).float()[:, None].expand(-1, 3, -1, -1)


BOXES = torch.stack([box(x, y, z) for x in (10, 14, 18, 22) for y in (14, 20, 26) for z in (4, 8)])
BALLS = torch.stack([ball(radius) for radius in range(5, 14)])


@pytest.fixture(scope='module')
def model():
    """A model that knows boxes and balls, and has met no cones."""
    model = ShapeBasis(('cone', 'box', 'ball'), 5)
    names = np.array(['box'] * len(BOXES) + ['ball'] * len(BALLS))
    fit_shapes(model, torch.cat([BOXES, BALLS]), names)
    return model


def after_views(model, voxels, count):
    """Return the category's index and the IoU of objects (B, ...) after views from all around."""
    state = model.initial_state(len(voxels))
    for t in range(count):
        azimuths = torch.full((len(voxels),), 0.4 + 2 * t)
        state = model.step(seen(voxels, azimuths), cameras_at(azimuths), state)
    return state['features'][:, 0].long(), iou(model.decode(state) > 0, voxels)


def test_the_categories_known_by_default_are_those_of_the_data():
    assert SIZES['small'].categories == CATEGORIES


def test_the_sign_of_a_distance_is_occupancy():
    assert ((signed_distance(BOXES[3].numpy()) > 0) == BOXES[3].numpy()).all()


def test_distances_are_measured_from_the_surface_in_cells():
    along = signed_distance(box(12, 20, 20).numpy())[:, 16, 16]
    assert along[5:16].tolist() == [-4, -3.5, -2.5, -1.5, -0.5, 0.5, 1.5, 2.5, 3.5, 4, 4]


def test_beyond_the_grid_there_is_nothing():
    assert signed_distance(np.ones((32, 32, 32), bool))[0, 16, 16] == 0.5


def test_frusta_are_those_of_the_canonical_cameras():
    azimuths = torch.tensor([0.0, 1.0, 4.0, -2.0])
    expected = frustum([orbit_camera(azimuth) for azimuth in azimuths.tolist()])
    assert_close(frusta_at(azimuths), expected, rtol=0, atol=1e-5)


def test_the_silhouette_is_what_is_not_white():
    images = torch.ones(1, 3, 64, 64)
    images[:, 1, 10:20, 30:40] = 0.9
    outline = outlines_of(images)[0]
    assert outline[5:10, 15:20].eq(1).all()
    assert outline.sum() == 25


def test_as_many_modes_as_objects_less_one_hold_every_object():
    model = ShapeBasis(('box',), 3)
    members = BOXES[[0, 8, 13, 23]]
    fit_shapes(model, members, np.array(['box'] * 4))
    distances = torch.stack([torch.from_numpy(signed_distance(one.numpy())) for one in members])
    modes = model.modes[0].flatten(1)
    coefficients = (distances - model.means[0]).flatten(1) @ torch.linalg.pinv(modes)
    assert_close(coefficients.square().mean(dim=0), torch.ones(3), rtol=1e-3, atol=1e-3)
    features = torch.cat([torch.zeros(4, 1), coefficients], dim=1)
    assert (model.decode({'features': features}) > 0).equal(members)


def test_the_category_is_told_by_the_silhouettes(model):
    category, _ = after_views(model, torch.cat([BOXES[::8], BALLS[::4]]), 2)
    assert category.tolist() == [1] * 3 + [2] * 3


@pytest.mark.slow
def test_a_member_of_a_family_is_met_better_than_by_the_mean(model):
    thin = torch.stack([box(22, 16, 6), box(12, 24, 4)])  # neither was shown
    mean = iou((model.means[1] > 0).expand(2, -1, -1, -1), thin)
    _, once = after_views(model, thin, 1)
    _, often = after_views(model, thin, 4)
    assert (once > mean + 0.1).all()
    assert (often > mean + 0.1).all()


def test_coefficients_stay_at_the_mean_where_the_silhouettes_are_the_means(model):
    frusta = frusta_at(torch.tensor([0.4]))
    outline = project((2 * model.means[2:]).sigmoid(), frusta)
    coefficients = model.fitted(torch.tensor([2]), outline[:, None], torch.tensor([[0.4]]))
    assert coefficients.abs().max() < 0.1


@pytest.mark.parametrize('mode', [torch.inference_mode, torch.no_grad, torch.enable_grad])
def test_it_answers_alike_however_gradients_are_switched(model, mode):
    azimuths = torch.tensor([5.0])
    expected = model.step(seen(BOXES[:1], azimuths), cameras_at(azimuths),
                          model.initial_state(1))['features']
    with mode():
        images, at = seen(BOXES[:1], azimuths), azimuths.clone()
        once = model.step(images, cameras_at(at), model.initial_state(1))
        again = model.step(images, cameras_at(at + 1), once)
    assert_close(once['features'], expected)
    assert not again['features'].requires_grad
    assert again['features'].isfinite().all()


@pytest.mark.slow
def test_objects_of_other_categories_are_left_out(model):
    other = ShapeBasis(('box',), 5)
    fit_shapes(other, torch.cat([BALLS[:2], BOXES]), np.array(['ball'] * 2 + ['box'] * len(BOXES)))
    assert_close(other.means[0], model.means[1])


def test_a_model_that_knows_no_object_is_refused_in_words(model):
    with pytest.raises(DataError, match='no objects of its categories: expected cone, box, ball, '
                       'got lamp, table'):
        fit_shapes(model, BOXES[:2], np.array(['table', 'lamp']))


def test_all_categories_are_stored_in_9_megabytes(tmp_path):
    config = SIZES['small']
    model = ShapeBasis.from_config(config)
    assert isinstance(config, ShapeBasisConfig)
    save_weights(tmp_path / 'it.safetensors', Bundle(model, None, config, 0.4,
                                                     model='shape-basis'))
    assert (tmp_path / 'it.safetensors').stat().st_size < 9e6


def test_the_registry_fits_it_in_one_go():
    assert network_entry('shape-basis').fit is fit_shapes
