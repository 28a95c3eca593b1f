"""R2N2's own images and voxels: seen by our cameras, the one falls onto the other."""

import json
import os
from pathlib import Path
import shutil

from active_recon.datasets.layout import list_objects
from active_recon.datasets.splits import list_split
from active_recon.datasets.views import read_views
from active_recon.geometry.cameras import orbit_camera
from active_recon.shapes import CATEGORIES
from active_recon.volumes.silhouettes import frustum, project_all
from active_recon.volumes.voxels import iou
import cv2
import numpy as np
import pytest
import torch

SAMPLE = Path(os.environ.get('ACTIVE_RECON_R2N2')
              or Path(__file__).parents[2] / 'shared/data/r2n2_sample')
pytestmark = pytest.mark.skipif(
    not SAMPLE.is_dir(), reason="needs objects of R2N2's dataset: name them by ACTIVE_RECON_R2N2")
SIDE = 64


@pytest.fixture(scope='module')
def objects():
    """Return grid, cameras and silhouettes of the first three objects, 24 views each."""
    return [(folder.voxels(), folder.cameras(), np.stack([
        alpha_of(folder.image(index)) for index in range(24)]))
        for folder in list_objects(SAMPLE)[:3]]


def alpha_of(rgba):
    return cv2.resize(rgba[..., 3], (SIDE, SIDE), interpolation=cv2.INTER_AREA) > 127


def mirrored(camera):
    return orbit_camera(-camera.azimuth, camera.elevation, camera.distance)


def transformed(grid, cameras):
    """Return the silhouettes by the perspective transformer, (cameras, SIDE, SIDE)."""
    samples = frustum(cameras, SIDE, 64, grid.size)
    return project_all(torch.from_numpy(grid.occupancy)[None], samples)[0].numpy() > 0.5


def test_the_voxels_cover_the_object_in_every_view(objects):
    agreement = np.array([iou(transformed(grid, cameras), alphas, (-2, -1))
                          for grid, cameras, alphas in objects])
    assert agreement.shape == (3, 24)
    assert agreement.min() >= 0.6
    assert agreement.mean() >= 0.8


@pytest.mark.slow
def test_they_do_not_where_the_azimuth_runs_the_other_way(objects):
    agreement = np.array([
        iou(transformed(grid, [mirrored(camera) for camera in cameras]), alphas, (-2, -1))
        for grid, cameras, alphas in objects])
    assert agreement.mean() < 0.55
    assert (agreement.min(axis=1) < 0.45).all()


def test_the_cameras_look_down_by_about_thirty_degrees(objects):
    elevations = np.degrees([camera.elevation for _, cameras, _ in objects for camera in cameras])
    assert ((elevations > 24) & (elevations < 31)).all()


def test_they_are_read_into_memory_as_they_are(objects):
    folders = list_objects(SAMPLE)[:3]
    views = read_views(folders)
    assert not views.unreadable
    assert views.images.shape == (3, 24, 64, 64, 4)
    assert set(views.categories) <= set(CATEGORIES)
    for index, (grid, cameras, alphas) in enumerate(objects):
        np.testing.assert_array_equal(views.voxels[index], grid.occupied(0.5))
        np.testing.assert_allclose(
            views.azimuths[index], [camera.azimuth for camera in cameras], atol=1e-6)
        assert (np.diff(np.sort(views.azimuths[index])) > 0).all()  # irregular, all different
        np.testing.assert_array_equal(views.images[index, ..., 3] > 127, alphas)


def test_a_split_that_names_more_than_the_sample_tells_what_it_lacks(tmp_path):
    first = list_objects(SAMPLE)[0]
    path = tmp_path / 'ShapeNet.json'
    path.write_text(json.dumps([{'taxonomy_id': first.category, 'taxonomy_name': 'chair',
                                 'train': [], 'val': [], 'test': [first.name, 'ffff']}]))
    found, missing = list_split(SAMPLE, path, 'test')
    assert found == [first]
    assert len(missing) == 1


def test_an_image_that_was_cut_off_leaves_its_object_out_and_is_told(tmp_path):
    shutil.copytree(SAMPLE, tmp_path / 'copy')
    folders = list_objects(tmp_path / 'copy')[:2]
    path = folders[0].images_folder / '17.png'
    path.write_bytes(path.read_bytes()[:-9])
    views = read_views(folders)
    assert views.folders == (folders[1],)
    assert '17.png: no readable image: expected a PNG, found no whole PNG' in views.unreadable[0]
