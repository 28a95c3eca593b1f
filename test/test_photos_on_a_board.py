"""What stands on a printed board is told from it, found, and reconstructed before clutter."""

from active_recon.errors import DataError
from active_recon.photos.board_masks import board_evidence, board_views
from active_recon.photos.cube import Cube
from active_recon.photos.reconstruct import reconstruct
from active_recon.photos.sources import BoardCameras
from active_recon.photos.views import PhotoView
from active_recon.volumes.voxelisation import voxelise
from active_recon.volumes.voxels import iou
import numpy as np
from photo_board import around, MIDDLE, photographed, standing
from photo_scene import thing
from PIL import Image
import pytest
from rendered_boards import BOARD

SIZE = 0.12


@pytest.fixture(scope='module')
def mesh():
    return standing(thing(), SIZE)


@pytest.fixture(scope='module')
def cameras():
    return around(5, 0.3 * SIZE)


@pytest.fixture(scope='module')
def taken(mesh, cameras):
    return photographed(mesh, cameras)


def views_of(images, cameras):
    return [PhotoView(f'{number}.png', image, camera)
            for number, (image, camera) in enumerate(zip(images, cameras, strict=True))]


def test_the_board_is_covered_where_the_object_is_before_it(taken, cameras):
    for image, mask, camera in zip(*taken, cameras, strict=True):
        found = board_evidence(image, camera, BOARD)
        there = found.known & mask
        assert (found.covered & there).sum() > 0.85 * there.sum()
        assert (found.covered & ~mask).sum() < 0.15 * there.sum()


def test_the_light_on_the_board_makes_no_difference(taken, cameras):
    image, camera = taken[0][0], cameras[0]
    light = np.linspace(0.5, 0.8, image.shape[1])[None, :, None] * [1, 0.9, 0.7]
    before, after = (board_evidence(each, camera, BOARD) for each in (
        image, np.rint(image * light).astype(np.uint8)))
    assert iou(before.covered[None], after.covered[None]) > 0.85


def test_masks_and_cube_are_found_together(taken, cameras, mesh):
    found, empty, cube = board_views(views_of(taken[0], cameras), BOARD, None)
    assert not empty
    for view, true in zip(found, taken[1], strict=True):
        assert view.mask_source == 'board' and iou(view.mask[None], true[None]) > 0.6
    np.testing.assert_allclose(cube.centre[:2], MIDDLE[:2], atol=0.1 * SIZE)
    assert SIZE < cube.side < 1.4 * SIZE


def test_an_empty_board_has_nothing_on_it(cameras, mesh):
    away = mesh.copy()
    away.apply_translation([5, 0, 0])
    images, _ = photographed(away, cameras[:3])
    with pytest.raises(DataError, match='object not found: expected one on the board'):
        board_views(views_of(images, cameras[:3]), BOARD, None)


def test_an_object_on_a_board_is_reconstructed_from_photos_alone(taken, mesh, tmp_path):
    for number, image in enumerate(taken[0]):
        Image.fromarray(image).save(tmp_path / f'{number}.png')
    shape = reconstruct(tmp_path, BoardCameras(BOARD))
    assert shape.background == 'what covers the printed board' and not shape.left_out
    placed = mesh.copy()
    placed.apply_transform(np.linalg.inv(shape.world_from_object))
    placed.apply_scale(1 / shape.size)
    truth = voxelise(placed, len(shape.occupancy)).occupied(0.5)
    assert iou(shape.occupancy > shape.threshold, truth) > 0.5
    assert SIZE < shape.size < 1.4 * SIZE  # the board is in metres
    low = shape.mesh().bounds[0, 2] + shape.world_from_object[2, 3]
    assert low > -0.02 * SIZE  # nothing is in the table
    other = reconstruct(tmp_path, BoardCameras(BOARD), 0.2, views=3)
    assert other.cube.side == 0.2 and other.cube.centre[2] == pytest.approx(0.1)


def test_a_cube_of_another_side_keeps_its_place_or_stands_on_the_ground():
    cube = Cube(np.array([1.0, 2, 3]), 0.5, np.array([0.0, 0, 2]))
    np.testing.assert_allclose(cube.of_side(0.8, grounded=False).centre, cube.centre)
    np.testing.assert_allclose(cube.of_side(0.8, grounded=True).centre, [1, 2, 0.4])
    assert cube.of_side(0.8, True).above_ground(4).all()
    below = Cube(np.zeros(3), 1.0, np.array([0.0, 0, 1])).above_ground(4)
    np.testing.assert_array_equal(below[0, 0], [False, False, True, True])
