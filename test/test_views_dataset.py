"""A dataset in memory: what was written is what is drawn from, and what is amiss is listed."""

import re
import shutil

from active_recon.datasets.layout import list_objects, write_voxels
from active_recon.datasets.views import on_background, read_views
from active_recon.errors import DataError
from active_recon.geometry.cameras import azimuth_difference, AZIMUTHS
from active_recon.volumes.rendering import composite
from active_recon.volumes.voxels import VoxelGrid
import cv2
import numpy as np
import pytest
import torch


@pytest.fixture
def copied(dataset, tmp_path):
    """Return the folders of a copy that may be spoilt."""
    shutil.copytree(dataset, tmp_path / 'copy')
    return list_objects(tmp_path / 'copy')


def test_all_objects_are_there_in_order(views, dataset):
    assert len(views) == 6
    assert views.folders == tuple(list_objects(dataset))
    assert list(views.categories) == ['lamp'] * 3 + ['table'] * 3
    assert not views.unreadable
    assert views.images.shape == (6, 24, 64, 64, 4)
    assert views.images.dtype == torch.uint8


def test_the_azimuths_and_voxels_are_those_on_disk(views):
    np.testing.assert_allclose(
        azimuth_difference(views.azimuths, AZIMUTHS[None]), 0, atol=1e-5)
    for folder, voxels in zip(views.folders, views.voxels, strict=True):
        np.testing.assert_array_equal(voxels, folder.voxels().occupied(0.5))
        assert voxels.any()


def test_finer_voxels_are_read_where_asked_for_and_listed_where_they_lack(copied):
    for folder in copied[:5]:
        grid = VoxelGrid(folder.voxels().occupancy.repeat(2, 0).repeat(2, 1).repeat(2, 2))
        write_voxels(folder, grid)
    views = read_views(copied, resolution=64)
    assert views.voxels.shape == (5, 64, 64, 64)
    assert views.voxels.dtype == torch.bool
    assert views.folders == tuple(copied[:5])
    for folder, voxels in zip(views.folders, views.voxels, strict=True):
        np.testing.assert_array_equal(voxels[::2, 1::2, ::2], folder.voxels().occupied(0.5))
    assert len(views.unreadable) == 1
    assert 'ShapeNetVox64' in views.unreadable[0]


@pytest.mark.parametrize('grey', [0, 100, 255])
def test_an_image_on_a_background_is_the_rendered_one_made_smaller(views, grey):
    large = composite(views.folders[4].image(5), grey).astype(np.float32)
    expected = cv2.resize(large, (64, 64), interpolation=cv2.INTER_AREA) / 255
    found = on_background(views.images[4:5, 5], torch.full((1, 3), grey / 255))
    np.testing.assert_allclose(found[0].permute(1, 2, 0), expected, atol=1.5 / 255)


def test_white_is_the_background_of_measurement(views):
    objects, chosen = torch.tensor([0, 5]), torch.tensor([3, 20])
    white = views.white(objects, chosen)
    assert white.shape == (2, 3, 64, 64)
    assert (white[:, :, 0, 0] == 1).all()
    assert white.min() >= 0
    assert white.max() <= 1
    torch.testing.assert_close(white[1:], views.white(objects[1:], chosen[1:]))


def test_colours_never_outshine_their_alpha(views):
    assert (views.images[..., :3] <= views.images[..., 3:]).all()


def truncate(folder):
    path = folder.images_folder / '07.png'
    path.write_bytes(path.read_bytes()[:20])


def drop_view(folder):
    path = folder.images_folder / 'rendering_metadata.txt'
    path.write_text(''.join(path.read_text().splitlines(keepends=True)[:-1]))


def drop_voxels(folder):
    folder.voxels_path().unlink()


@pytest.mark.parametrize(('spoil', 'reason'), [
    (truncate, r'07\.png: no readable image: expected a PNG'),
    (drop_view, 'wrong number of views: expected 24, got 23'),
    (drop_voxels, r'model\.binvox')])
def test_what_cannot_be_read_is_left_out_and_listed(copied, spoil, reason):
    spoil(copied[1])
    told = []
    views = read_views(copied, lambda: told.append(1))
    assert views.folders == (copied[0], *copied[2:])
    assert len(views) == len(views.images) == len(views.azimuths) == 5
    assert len(views.unreadable) == 1
    assert re.search(reason, views.unreadable[0])
    assert len(told) == 6


def test_a_dataset_of_which_nothing_can_be_read_is_refused(copied):
    for folder in copied:
        drop_voxels(folder)
    with pytest.raises(DataError, match='(?s)no readable object.*binvox'):
        read_views(copied)
    with pytest.raises(DataError, match='no readable object'):
        read_views([])
