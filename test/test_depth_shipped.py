"""What the refiner that ships does with depth: on a known object, from photos, and in a bag."""

import json
from pathlib import Path

import active_recon
from active_recon.bags.replay.verification import verify
from active_recon.bags.runs.loop_setup import recorded_setup
from active_recon.bags.runs.photo_run import photo_run
from active_recon.bags.runs.reading import read_run
from active_recon.bags.runs.run_writing import write_run
from active_recon.geometry.cameras import Camera
from active_recon.models.depth_weights import load_refiner
from active_recon.models.weights_files import depth_path, find_weights, read_card, weights_hash
from active_recon.reconstructor import Reconstructor
from active_recon.volumes.depth_evidence import depth_evidence
from active_recon.volumes.depth_images import DepthImage
from active_recon.volumes.rendering import Renderer
from active_recon.volumes.voxelisation import voxelise
from active_recon.volumes.voxels import iou
import cv2
import numpy as np
from photo_scene import cameras, CENTRE, on_plain, rendered, SIDE, thing, write_photos
import pytest

pytestmark = pytest.mark.usefixtures('loaded_once')
ROOT = Path(__file__).parents[1]
SIZE = 1.1 * SIDE


@pytest.fixture(scope='module')
def placed():
    """Return an object about the origin, and two cameras in the object frame, metres."""
    mesh = thing()
    mesh.apply_translation(-CENTRE)
    views = []
    for camera in cameras(3)[:2]:
        pose = camera.pose.copy()
        pose[:3, 3] -= CENTRE
        views.append(Camera(pose, camera.intrinsics))
    return mesh, views


WITH_DEPTH = {'lifting': 'depth.json', 'lifting-large': 'depth-large.json'}


@pytest.mark.parametrize('model', WITH_DEPTH)
def test_the_refiner_belongs_to_the_weights_that_ship(model):
    weights = find_weights(model)
    load_refiner(weights)
    card = read_card(depth_path(weights))
    assert card['network_sha256'] == weights_hash(weights)
    assert card['sha256'] == weights_hash(depth_path(weights))


@pytest.mark.parametrize('page', ['doc/results.md', 'active_recon/weights/MODEL_CARD.md'])
@pytest.mark.parametrize('model', WITH_DEPTH)
def test_the_figures_are_those_that_were_measured_with_the_weights_that_ship(model, page):
    weights, result, text = find_weights(model), json.loads(
        (ROOT / 'docs/results' / WITH_DEPTH[model]).read_text()), (ROOT / page).read_text()
    assert result['weights_sha256'] == weights_hash(weights)
    assert result['depth_sha256'] == weights_hash(depth_path(weights))
    for way in ('color', 'depth'):
        assert all(f'{value:.3f}' in text for value in result['iou_64'][way])


def test_depth_makes_one_view_better_and_what_it_saw_free_is_free(placed):
    mesh, (camera, other) = placed
    metres = Renderer(mesh).depth(camera)
    image = on_plain(rendered_of(mesh, camera), (255, 255, 255))
    unit = mesh.copy()
    unit.apply_scale(1 / SIZE)
    truth = voxelise(unit, 64).occupied(0.5)
    reconstructor = Reconstructor.load(object_size=SIZE, threads=1)
    color = reconstructor.add_view(image, camera).grid
    reconstructor.reset()
    deep = reconstructor.add_view(image, camera, DepthImage(metres)).grid
    threshold = reconstructor.threshold
    before, after = (iou(grid.occupied(threshold), truth) for grid in (color, deep))
    assert after > before + 0.05
    free, near, _ = depth_evidence(metres / np.float32(SIZE), camera.scaled(1 / SIZE))
    assert deep.occupied(threshold)[free > 0.99].mean() < 0.01
    surface = (near > 0.5) & truth
    assert deep.occupied(threshold)[surface].mean() > 0.8
    assert color.occupied(threshold)[surface].mean() < deep.occupied(threshold)[surface].mean()


def rendered_of(mesh, camera):
    return Renderer(mesh).render(camera)


@pytest.mark.slow
def test_photos_with_depth_are_taken_in_and_their_bag_replays_to_the_same(tmp_path):
    views = cameras(3)[:2]
    folder = write_photos(tmp_path / 'photos', views, map(on_plain, rendered(views)))
    metres = Renderer(thing()).depth(views[0])
    (folder / 'depth').mkdir()
    cv2.imwrite(str(folder / 'depth' / 'photo0.png'), np.rint(1000 * metres).astype(np.uint16))
    cv2.imwrite(str(folder / 'depth' / 'photo1.png'), np.rint(metres).astype(np.uint16))
    shape = active_recon.reconstruct(folder, box=(*CENTRE, SIZE))
    assert [view.depth is not None for view in shape.views] == [True, False]
    assert sum('photo1.png: without its depth: depth contradicts' in warning
               for warning in shape.warnings) == 1
    plain = active_recon.reconstruct(
        [view.image for view in shape.views], [view.camera for view in shape.views], size=SIZE)
    assert np.abs(plain.occupancy - shape.occupancy).max() > 0.2

    write_run(photo_run(shape, tmp_path / 'bag'), tmp_path / 'bag')
    run = read_run(tmp_path / 'bag')
    found = verify(run, recorded_setup(run).load_reconstructor(), None)
    np.testing.assert_allclose(found.episodes[0].steps[-1].reconstruction.grid.occupancy,
                               shape.views[-1].known.grid.occupancy, atol=1e-5)
