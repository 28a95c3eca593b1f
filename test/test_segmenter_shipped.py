"""The segmenter that ships: exported, better than GrabCut, and worth it before clutter."""

import json
import os
from pathlib import Path

import active_recon
from active_recon.datasets.middlebury import read_photographs
from active_recon.evaluation.posed.photographs import averaged, even_views, hull, with_background
from active_recon.geometry.cameras import CANONICAL_INTRINSICS, orbit_camera
from active_recon.models.segmenter_weights import read_segmenter
from active_recon.models.weights_files import read_card, SEGMENTER, weights_hash
from active_recon.photos.backgrounds import grabcut
from active_recon.runtimes import load_segmenter_runtime
from active_recon.segmentation import Segmentation
from active_recon.shapes import make_shape
from active_recon.volumes.rendering import composite, Renderer
from active_recon.volumes.voxels import iou
from benchmarks import backgrounds
import numpy as np
import pytest

pytestmark = pytest.mark.usefixtures('loaded_once')
DINO = Path(os.environ.get('ACTIVE_RECON_DINO')
            or Path(__file__).parents[2] / 'shared/data/photos/dino_sparse_ring')
CAMERAS = [orbit_camera(azimuth, 0.5, 2.1, CANONICAL_INTRINSICS.resized(200, 200))
           for azimuth in (0.3, 2.4, 4.5)]


@pytest.fixture(scope='module')
def cluttered():
    """Return images of categories never trained on before tiles, their silhouettes, cameras."""
    found = []
    for category in ('bed', 'motorbike', 'bookshelf'):
        renderer = Renderer(make_shape(category, 3))
        for number, camera in enumerate(CAMERAS):
            rng = np.random.default_rng(number)
            tiles = np.kron(rng.integers(0, 256, (10, 10, 3), np.uint8),
                            np.ones((20, 20, 1), np.uint8))
            rgba = renderer.render(camera)
            found.append((composite(rgba, tiles), rgba[..., 3] > 127, camera))
    return found


def overlap(one, two):
    return (one & two).sum() / (one | two).sum()


def test_it_is_the_file_of_its_card_and_is_exported():
    assert read_card(SEGMENTER)['sha256'] == weights_hash(SEGMENTER)
    assert 'openvino' in load_segmenter_runtime().provenance['computed_by']
    assert sum(each.numel() for each in read_segmenter().parameters()) < 2e6


def test_it_finds_objects_of_new_categories_before_tiles_better_than_grabcut(cluttered):
    segmentation = Segmentation.load(threads=1)
    found = [overlap(segmentation.shares(image, camera) > 0.5, mask)
             for image, mask, camera in cluttered]
    simple = [0.0 if (cut := grabcut(image, camera, 1.0)) is None else overlap(cut, mask)
              for image, mask, camera in cluttered]
    assert np.mean(found) > 0.8
    assert np.mean(found) > np.mean(simple) + 0.1


@pytest.mark.parametrize('library', ['openvino', 'onnxruntime'])
def test_what_is_exported_finds_what_torch_does(cluttered, library):
    pytest.importorskip(library)
    one, two = (Segmentation.load(runtime=name, threads=1, precision='f32')
                for name in (library, 'torch'))
    for image, _, camera in cluttered[::3]:
        np.testing.assert_allclose(one.shares(image, camera), two.shares(image, camera),
                                   atol=1e-3)


@pytest.mark.slow
@pytest.mark.skipif(not DINO.is_dir(), reason='needs dinoSparseRing of Middlebury: name it by '
                                             'ACTIVE_RECON_DINO')
def test_photographs_before_clutter_gain_where_all_of_them_are_looked_at():
    photographs = read_photographs(DINO)
    truth, order = hull(photographs, range(len(photographs))), even_views(len(photographs))
    images = [with_background(photographs, view, 'clutter') for view in order]
    cameras = [photographs.cameras[view] for view in order]
    found = {}
    for background in ('network', 'segment'):
        shape = active_recon.reconstruct(images, cameras, size=1.0, background=background,
                                         ground=False)
        found[background] = iou(averaged(shape.occupancy, len(truth)) > shape.threshold, truth)
    assert 'the segmenter' in shape.background and not shape.left_out
    assert found['segment'] > found['network'] + 0.08


def test_the_table_of_backgrounds_is_of_what_was_measured():
    text = backgrounds.DOCUMENT.read_text()
    assert backgrounds.with_table(text) == text
    row = list(backgrounds.table())[-1]
    assert row in text and backgrounds.with_table(text.replace(row, '|')) == text
    result = json.loads(backgrounds.RESULTS.read_text())
    assert result['segmenter_sha256'] == weights_hash(SEGMENTER)
    assert result['weights_sha256'] == weights_hash()
