"""Variation when read: the same for the same numbers, true to the object, and of every kind."""

from dataclasses import replace

from active_recon.training import augmentation, posed_augmentation
from active_recon.training.augmentation import (
    augment,
    BACKGROUNDS,
    draw_kinds,
    MOST_SCALE,
    MOST_SHIFT,
    shift_and_scale,
)
import numpy as np
import pytest
import torch
from torch.nn.functional import max_pool2d
from torch.testing import assert_close

LENGTH, SIZE = 3, 60


def augmented(images, views, generator):
    """Return pictures and intrinsics of images (T, B, ...), all of the same camera before."""
    intrinsics = views.intrinsics[0, 0].expand(*images.shape[:2], 3, 3)
    return augment(images, intrinsics, views, generator)


def rng(seed=0):
    return np.random.default_rng([seed, 7])


@pytest.fixture(scope='module')
def images(views):
    """Return images (3, 60, 64, 64, 4) of the six objects."""
    objects = torch.arange(SIZE) % len(views)
    return views.images[objects, torch.arange(0, 15, 5)[:, None]]


@pytest.fixture(scope='module')
def planes(images):
    return images.permute(0, 1, 4, 2, 3).flatten(0, 1).float() / 255


def test_the_same_numbers_vary_alike_and_others_otherwise(images, views):
    first, again, other = (augmented(images, views, rng(seed)) for seed in (0, 0, 1))
    assert_close(again, first, rtol=0, atol=0)
    assert (other[0] != first[0]).any()


def test_pictures_are_in_range_and_their_originals_are_untouched(images, views):
    before = images.clone()
    pictures, _ = augmented(images, views, rng())
    assert pictures.shape == (LENGTH, SIZE, 3, 64, 64)
    assert pictures.isfinite().all()
    assert 0 <= pictures.min() < pictures.max() <= 1
    assert_close(images, before, rtol=0, atol=0)


@pytest.mark.parametrize('size', [1, 2, 3])
def test_the_smallest_batches_can_be_varied(size, images, views):
    for seed in range(8):
        pictures, _ = augmented(images[:1, :size], views, rng(seed))
        assert pictures.shape == (1, size, 3, 64, 64)


@pytest.mark.parametrize('module', [augmentation, posed_augmentation])
def test_every_kind_of_background_occurs_in_its_share(module):
    kinds = draw_kinds(module.SHARES, 4000, rng())
    assert set(module.BACKGROUNDS) == set(module.SHARES) - {'white'}
    assert sum(module.SHARES.values()) == pytest.approx(1)
    for kind, share in module.SHARES.items():
        assert (kinds == kind).mean() == pytest.approx(share, abs=0.03)


def test_half_of_the_sequences_stay_in_place_on_pure_white(images, views):
    pictures, _ = augmented(images, views, rng())
    alpha = images[..., 3].float()[:, :, None] / 255
    white = ((pictures == 1) | (alpha > 0)).all((0, 2, 3, 4))
    assert 0.35 < white.float().mean() < 0.65
    solid = (alpha == 1).expand_as(pictures)
    where_white = pictures[:, white]
    plain = images[:, white, ..., :3].permute(0, 1, 4, 2, 3).float() / 255
    assert (where_white != plain)[solid[:, white]].float().mean() > 0.5  # its colours changed


def centers_of(planes):
    """Return the centres of what is opaque in planes (N, 4, S, S), x and y in pixels, (2, N)."""
    alpha = planes[:, 3]
    along = torch.arange(alpha.shape[-1]) + 0.5
    return torch.stack([(alpha.sum(axis) * along).sum(1) / alpha.sum((1, 2)) for axis in (1, 2)])


def test_a_camera_told_of_the_motion_sees_a_point_where_its_image_went():
    dot = torch.zeros(200, 4, 64, 64)
    dot[:, :, 14:16, 44:46] = 1
    shown, motion = shift_and_scale(dot, rng())
    went = motion @ torch.tensor([45.0, 15.0, 1.0], dtype=torch.float64)  # (200, 3)
    assert_close(centers_of(shown), went[:, :2].T.float(), rtol=0, atol=0.1)
    assert (went[:, :2] - torch.tensor([45.0, 15.0])).abs().amax() > 1


def test_the_intrinsics_move_with_the_pictures_and_stay_where_they_stay(images, views):
    pictures, intrinsics = augmented(images, views, rng())
    stayed = (intrinsics == views.intrinsics[0, 0]).all((0, 2, 3))
    alpha = images[..., 3].float()[:, :, None] / 255
    white = ((pictures == 1) | (alpha > 0)).all((0, 2, 3, 4))
    assert (stayed == white).all()


def test_a_moved_object_keeps_its_shape_and_stays_within_the_shift(planes):
    shifted, _ = shift_and_scale(planes, rng())
    assert (shifted[:, :3] <= shifted[:, 3:] + 1e-5).all()  # the colours moved with the alpha
    reach = 1 + int(np.ceil(64 * MOST_SHIFT + MOST_SCALE * 32))
    grown = max_pool2d(planes[:, 3:], 2 * reach + 1, 1, reach)
    assert (shifted[:, 3:] <= grown + 1e-5).all()
    area = shifted[:, 3].sum((1, 2)) / planes[:, 3].sum((1, 2))
    assert (area > (1 - MOST_SCALE) ** 2 - 0.02).all()
    assert (area < (1 + MOST_SCALE) ** 2 + 0.02).all()


def test_objects_are_moved_each_in_its_own_way_and_by_up_to_two_pixels():
    dot = torch.zeros(400, 4, 64, 64)
    dot[:, :, 31:33, 31:33] = 1  # about the middle, which a change of scale leaves where it is
    centers = centers_of(shift_and_scale(dot, rng())[0])
    away = (centers - 32).abs().amax(dim=1)
    assert (away <= 64 * MOST_SHIFT + 0.1).all()
    assert (away > 64 * MOST_SHIFT - 0.3).all()
    assert len(centers.round(decimals=3).unique(dim=1)[0]) > 390


@pytest.mark.parametrize('kind', sorted(set(posed_augmentation.BACKGROUNDS) - {'black'}))
def test_a_background_fills_every_view_and_no_two_sequences_are_alike(kind, views):
    draw = posed_augmentation.BACKGROUNDS[kind]
    drawn = draw(views, LENGTH, 8, rng()).expand(LENGTH, 8, 3, 64, 64)
    assert 0 <= drawn.min() < drawn.max() <= 1
    for other in range(1, 8):
        assert (drawn[:, 0] != drawn[:, other]).any()


@pytest.mark.parametrize(('kind', 'moves'), [
    ('plain', False), ('gradient', False), ('noise', True), ('clutter', True), ('pieces', True)])
def test_plain_backgrounds_stay_through_a_sequence_and_others_move_by(kind, moves, views):
    drawn = BACKGROUNDS[kind](views, LENGTH, 8, rng()).expand(LENGTH, 8, 3, 64, 64)
    assert bool((drawn[0] != drawn[1]).any()) == moves


def test_a_plain_background_is_of_one_colour_and_a_gradient_runs_one_way(views):
    plain = BACKGROUNDS['plain'](views, 1, 4, rng()).expand(4, 3, 64, 64)
    assert (plain == plain[:, :, :1, :1]).all()
    steps = BACKGROUNDS['gradient'](views, 1, 4, rng()).diff(dim=-1)
    assert (steps.sign() == steps.sign()[..., :1, :1]).all()


def test_pieces_show_colours_of_the_set_s_own_images(views):
    plain = views.images.clone()
    plain[..., :3] = plain[..., 3:] // 2
    grey = replace(views, images=plain)
    drawn = BACKGROUNDS['pieces'](grey, 4, 30, rng())
    shown = ((drawn - 127 / 255).abs() < 0.01).all(dim=2).float().mean().item()
    covered = (plain[..., 3] == 255).float().mean().item()
    assert shown == pytest.approx(covered, abs=0.1)
    assert shown > 0.02
