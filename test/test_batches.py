"""Training batches: repeatable, mirrored, and true to the objects they show."""

import dataclasses

from active_recon.datasets.layout import ObjectFolder
from active_recon.datasets.making import Job, make_dataset
from active_recon.datasets.views import read_views
from active_recon.geometry.cameras import azimuth_difference
from active_recon.training.batches import draw_batch
from active_recon.volumes.voxels import iou
import numpy as np
import pytest
import torch
from torch.testing import assert_close
import trimesh


def draw(views, seed=0, size=64, length=3, augment=True):
    return draw_batch(views, size, length, np.random.default_rng([seed, 5]), augment)


def sources(views, batch, plain=None):
    """
    Return for each image (T, B) the view it was drawn from, and whether it was mirrored.

    `plain` is the same batch without augmentation, where the batch is augmented.
    """
    plain = plain or batch
    azimuths = batch.cameras.azimuths.numpy()
    index, mirrored = [], []
    for b, item in enumerate(batch.objects):
        own = views.azimuths[item].numpy()
        straight, flipped = ([int(np.abs(azimuth_difference(own, sign * at)).argmin())
                              for at in azimuths[:, b]] for sign in (1, -1))
        white = views.white(item.expand(len(straight)), torch.tensor(straight))
        mirrored.append(not white.equal(plain.images[:, b]))
        index.append(flipped if mirrored[-1] else straight)
        voxels = views.voxels[item]
        assert batch.voxels[b].bool().equal(voxels.flip(1) if mirrored[-1] else voxels)
    return np.array(index).T, np.array(mirrored)


def test_the_same_seed_and_step_draw_the_same_batch(views):
    first, again, other = draw(views), draw(views), draw(views, seed=1)
    for name in ('images', 'cameras', 'voxels', 'objects'):
        assert_close(getattr(again, name), getattr(first, name), rtol=0, atol=0)
    assert (other.images != first.images).any()


def test_shapes_and_ranges_are_those_of_the_network(views):
    batch = draw(views, size=5, length=4)
    assert batch.images.shape == (4, 5, 3, 64, 64)
    assert batch.cameras.poses.shape == (4, 5, 4, 4)
    assert batch.cameras.intrinsics.shape == (4, 5, 3, 3)
    assert batch.voxels.shape == (5, 32, 32, 32)
    assert 0 <= batch.images.min() <= batch.images.max() <= 1
    assert set(batch.voxels.unique().tolist()) == {0.0, 1.0}


def test_the_views_of_a_sequence_differ(views):
    chosen, _ = sources(views, draw(views, length=24), draw(views, length=24, augment=False))
    assert (np.sort(chosen, axis=0) == np.arange(24)[:, None]).all()


@pytest.mark.parametrize('augment', (False, True))
def test_a_sequence_has_no_more_views_than_its_objects(views, augment):
    few = dataclasses.replace(views, images=views.images[:, :2], poses=views.poses[:, :2],
                              intrinsics=views.intrinsics[:, :2])
    batch = draw(few, size=3, length=5, augment=augment)
    assert batch.images.shape[:2] == batch.cameras.poses.shape[:2] == (2, 3)


def test_every_object_is_drawn_and_half_of_the_sequences_are_mirrored(views):
    batch = draw(views, size=400, augment=False)
    _, mirrored = sources(views, batch)
    assert set(batch.objects.tolist()) == set(range(6))
    assert 0.4 < mirrored.mean() < 0.6


def test_without_augmentation_each_image_is_its_view_on_white_mirrored_with_its_object(views):
    batch = draw(views, size=32, augment=False)
    chosen, mirrored = sources(views, batch)
    for t, row in enumerate(chosen):
        white = views.white(batch.objects, torch.from_numpy(row))
        white[mirrored] = white[mirrored].flip(-1)
        assert_close(batch.images[t], white, rtol=0, atol=0)


def test_augmentation_changes_the_images_and_where_their_pixels_are_alone(views):
    augmented, plain = draw(views, size=40), draw(views, size=40, augment=False)
    for name in ('voxels', 'objects'):
        assert_close(getattr(augmented, name), getattr(plain, name), rtol=0, atol=0)
    assert_close(augmented.cameras.poses, plain.cameras.poses, rtol=0, atol=0)
    moved = (augmented.cameras.intrinsics - plain.cameras.intrinsics).abs().amax((0, 2, 3)) > 0
    assert 0 < moved.sum() < 40
    assert ((augmented.images - plain.images).abs().amax((0, 2, 3, 4)) > 0.01).all()


def test_voxels_come_in_the_set_s_resolution(views):
    fine = dataclasses.replace(views, voxels=torch.rand(6, 64, 64, 64) < 0.3)
    batch = draw(fine, size=20, augment=False)
    _, mirrored = sources(fine, batch)
    assert batch.voxels.shape == (20, 64, 64, 64)
    assert 0 < mirrored.sum() < 20


@pytest.fixture(scope='module')
def lopsided(tmp_path_factory):
    """Return a set of an object that no mirror maps onto itself, and of its mirror in y = 0."""
    boxes = [((1, 0.2, 0.2), (0, 0, -0.4)), ((0.2, 0.6, 0.2), (0.4, 0.2, -0.4)),
             ((0.2, 0.2, 0.9), (-0.1, -0.3, 0.05))]
    mesh = trimesh.util.concatenate([
        trimesh.creation.box(extents, trimesh.transformations.translation_matrix(at))
        for extents, at in boxes])
    mirrored = mesh.copy()
    mirrored.apply_transform(np.diag([1.0, -1.0, 1.0, 1.0]))
    out = tmp_path_factory.mktemp('lopsided')
    jobs = [Job(ObjectFolder(out, 'box', name), lambda made=made: made)
            for name, made in (('straight', mesh), ('mirrored', mirrored))]
    assert not any(outcome.refusal for outcome in make_dataset(jobs, samples=2))
    return tuple(read_views([job.folder]) for job in jobs)


def test_a_mirrored_sequence_is_the_mirrored_object_seen_from_the_mirrored_azimuths(lopsided):
    straight, mirrored = lopsided
    batch = draw(straight, size=16, length=4, augment=False)
    cells = mirrored.voxels[0].float()
    flipped = (batch.voxels - cells).abs().mean((1, 2, 3)) < 0.005
    assert 0 < flipped.sum() < 16  # both occur, and differ
    for b in range(16):
        shown = mirrored if flipped[b] else straight
        for t in range(4):
            own = batch.cameras.azimuths[t, b].item()
            away = azimuth_difference(shown.azimuths[0].numpy(), own)
            nearest = np.abs(away).argmin()
            assert abs(away[nearest]) < 1e-5
            outline = shown.images[0, nearest, :, :, 3] > 10
            found = (batch.images[t, b] - 1).abs().amax(dim=0) > 0.02
            assert iou(found, outline, (0, 1)) > 0.85
            assert iou(found.flip(1), outline, (0, 1)) < iou(found, outline, (0, 1))
