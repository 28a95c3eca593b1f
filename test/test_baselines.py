"""The two answers that know nothing of detail, and how good they may get."""

from dataclasses import replace

from active_recon.evaluation.baselines import (
    category_means,
    mean_shape_iou,
    nearest_image_iou,
    thumbnails,
)
from active_recon.evaluation.metrics import episodes
from active_recon.volumes.voxels import iou
import numpy as np
import torch


def part(views, items):
    """Return some objects of a set."""
    return replace(views, images=views.images[items], poses=views.poses[items],
                   intrinsics=views.intrinsics[items], voxels=views.voxels[items],
                   folders=tuple(views.folders[item] for item in items))


def test_the_nearest_image_of_a_training_image_is_itself(views):
    objects, starts = episodes(views, 24)
    np.testing.assert_array_equal(nearest_image_iou(views, views, objects, starts, batch=50), 1)


def test_an_unknown_object_gets_the_shape_of_a_known_one(views):
    known, asked = part(views, [0, 3]), part(views, [1, 4])
    objects, starts = episodes(asked, 4)
    found = nearest_image_iou(known, asked, objects, starts)
    possible = [{float(iou(shape, truth)) for shape in known.voxels} for truth in asked.voxels]
    assert all(any(np.isclose(value, choice) for choice in possible[item])
               for value, item in zip(found, objects.tolist(), strict=True))


def test_the_nearest_is_nearest_by_distance_and_not_by_brightness(views):
    known, asked = thumbnails(views).reshape(144, -1), thumbnails(views)[2, 5] + 0.01
    objects, starts = torch.tensor([2]), torch.tensor([5])
    expected = np.square(known - asked).sum(axis=1).argmin() // 24
    assert expected == 2
    assert nearest_image_iou(views, views, objects, starts)[0] == 1


def test_thumbnails_are_images_in_the_unit_range(views):
    small = thumbnails(views)
    assert small.shape == (6, 24, 16 * 16 * 4)
    assert small.min() == 0
    assert 0.5 < small.max() <= 1


def test_the_mean_shape_of_one_object_is_that_object(views):
    alone = part(views, [0, 3])
    np.testing.assert_array_equal(mean_shape_iou(category_means(alone), alone, 0.5), 1)


def test_the_mean_is_of_the_category_and_of_all_where_it_is_unknown(views):
    means = category_means(views)
    assert set(means) == {'lamp', 'table', ''}
    torch.testing.assert_close(means['table'], views.voxels[3:].float().mean(dim=0))
    torch.testing.assert_close(means[''], views.voxels.float().mean(dim=0))
    unknown = {'': means[''], 'car': means['lamp']}
    np.testing.assert_allclose(
        mean_shape_iou(unknown, views, 0.3),
        [float(iou(means[''] > 0.3, truth)) for truth in views.voxels])


def test_the_threshold_of_the_mean_decides(views):
    means = category_means(views)
    loose, strict = mean_shape_iou(means, views, 0.2), mean_shape_iou(means, views, 0.9)
    assert (loose != strict).any()
    assert ((loose > 0) & (loose <= 1)).all()
