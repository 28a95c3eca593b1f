"""What stands on a printed board is told from it, found, and reconstructed before clutter."""

from dataclasses import replace

from active_recon.calibration.lens import board_pose
from active_recon.errors import DataError
from active_recon.geometry.cameras import Camera
from active_recon.geometry.lenses import Distortion
from active_recon.photos.backgrounds import cube_pixels
from active_recon.photos.board_masks import board_views
from active_recon.photos.board_print import seen_board, UNIFORM
from active_recon.photos.cube import Cube
from active_recon.photos.reconstruct import reconstruct
from active_recon.photos.silhouette_fusion import silhouettes
from active_recon.photos.sources import BoardCameras
from active_recon.photos.views import PhotoView
from active_recon.volumes.voxelisation import voxelise
from active_recon.volumes.voxels import iou
import cv2
import numpy as np
from photo_board import around, FACE_UP, MIDDLE, photographed, standing
from photo_scene import thing
from PIL import Image
import pytest
from rendered_boards import BOARD
import trimesh

pytestmark = pytest.mark.usefixtures('loaded_once')
SIZE = 0.12


@pytest.fixture(scope='module')
def mesh():
    return standing(thing(), SIZE)


@pytest.fixture(scope='module')
def cameras():
    return around(4, 0.3 * SIZE)


@pytest.fixture(scope='module')
def taken(mesh, cameras):
    return photographed(mesh, cameras)


def gone(mesh):
    """Return a copy of a mesh that no camera sees."""
    away = mesh.copy()
    away.apply_translation([5, 0, 0])
    return away


def views_of(images, cameras):
    return [PhotoView(f'{number}.png', image, camera)
            for number, (image, camera) in enumerate(zip(images, cameras, strict=True))]


def test_the_print_fits_where_the_board_is_seen_and_not_where_the_object_is(taken, cameras):
    for image, mask, camera in list(zip(*taken, cameras, strict=True))[:2]:
        seen = seen_board(image, camera, BOARD, max(image.shape))
        covered = seen.known & (seen.fit < UNIFORM)
        there = seen.known & mask
        assert (covered & there).sum() > 0.8 * there.sum()
        assert (covered & ~mask).sum() < 0.05 * there.sum()


def test_the_light_on_the_board_makes_no_difference(taken, cameras):
    image, camera = taken[0][0], cameras[0]
    light = np.linspace(0.5, 0.8, image.shape[1])[None, :, None] * [1, 0.9, 0.7]
    before, after = (seen_board(each, camera, BOARD, 360) for each in (
        image, np.rint(image * light).astype(np.uint8)))
    assert iou((before.known & (before.fit < UNIFORM))[None],
               (after.known & (after.fit < UNIFORM))[None]) > 0.75


def test_a_photo_is_searched_where_the_lens_of_its_smaller_image_says(cameras):
    lens = replace(cameras[0].intrinsics, height=110)
    image = np.broadcast_to(2 * np.arange(110, dtype=np.uint8)[:, None, None],
                            (110, lens.width, 3)).copy()
    seen = seen_board(image, Camera(cameras[0].pose, lens), BOARD, 300)
    rows = (np.arange(seen.camera.intrinsics.height) + 0.5) * lens.fy / seen.camera.intrinsics.fy
    np.testing.assert_allclose(seen.image[:, 0, 0], 2 * (rows - 0.5), atol=1)


def test_a_shadow_on_the_board_is_no_object(taken, cameras, mesh):
    bare, _ = photographed(gone(mesh), cameras[:1])
    shadow = np.ones(bare[0].shape[:2])
    shadow[150:300, 200:400] = 0.7
    image = np.rint(bare[0] * shadow[..., None]).astype(np.uint8)
    seen = seen_board(image, cameras[0], BOARD, max(image.shape))
    assert (seen.fit[seen.known] < UNIFORM).mean() < 0.02


def test_a_mask_never_leaves_the_projected_cube(taken, cameras):
    cube = Cube(MIDDLE + [0.01, 0, 0.03], 0.06, np.array([0.0, 0, 1]))  # in the object
    found, _, same = board_views(views_of(taken[0], cameras)[:2], BOARD, cube)
    assert same is cube
    for view in found:
        inside = cube_pixels(cube.camera(view.camera, 1.0), 1.0, view.image.shape[1::-1])
        grown = cv2.dilate(inside.astype(np.uint8), np.ones((13, 13), np.uint8)) > 0
        assert view.mask.any() and not (view.mask & ~grown).any()


def test_a_photo_from_within_the_cube_shows_the_object_whether_or_not_its_lens_bends(mesh):
    straight = [*around(2, 0.3 * SIZE), *around(1, 0, elevations=(1.2, 1.2), distance=0.31)]
    bent = [Camera(camera.pose, replace(camera.intrinsics, distortion=Distortion(
        'plumb_bob', (1e-9, 0, 0, 0, 0)))) for camera in straight]
    images, masks = photographed(mesh, straight)
    cube = Cube(MIDDLE + [0, 0, 0.155], 0.31, np.array([0, 0, 1.0]))
    found = [silhouettes([seen_board(image, camera, BOARD, 160) for image, camera in zip(
        images, cameras, strict=True)], cube, 0.3)[0][-1] for cameras in (straight, bent)]
    np.testing.assert_allclose(*found, atol=1e-3)
    mask = cv2.resize(masks[-1].astype(np.uint8), found[0].shape[::-1]) > 0
    assert iou((found[1] > 0.5)[None], mask[None]) > 0.8


@pytest.mark.parametrize(('level', 'photos'), [
    (10, 3), pytest.param(245, None, marks=pytest.mark.slow)])  # paper is harder: all photos
def test_an_object_of_the_colour_of_ink_or_of_paper_is_found(cameras, mesh, level, photos):
    painted = mesh.copy()
    painted.visual.face_colors = [level, level, level, 255]
    cameras = cameras[:photos]
    images, masks = photographed(painted, cameras)
    found, _, _ = board_views(views_of(images, cameras), BOARD, None)
    for view, true in zip(found, masks, strict=True):
        assert iou(view.mask[None], true[None]) > 0.6


@pytest.mark.slow
def test_what_stands_out_beyond_the_board_is_found(mesh):
    tall = mesh.copy()
    tall.apply_translation(-MIDDLE)
    tall.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, [0, 1, 0]))
    low = around(4, 0.5 * SIZE, elevations=(0.45, 0.7))
    images, masks = photographed(standing(tall, SIZE), low)
    found, _, cube = board_views(views_of(images, low), BOARD, None)
    beyond = [mask & ~seen_board(image, camera, BOARD, 640).known
              for image, mask, camera in zip(images, masks, low, strict=True)]
    assert np.mean([part.sum() / mask.sum()
                    for part, mask in zip(beyond, masks, strict=True)]) > 0.1
    assert np.mean([iou(view.mask[None], true[None])
                    for view, true in zip(found, masks, strict=True)]) > 0.85
    assert 0.95 * SIZE < cube.side < 1.4 * SIZE


def test_masks_and_cube_are_found_together(taken, cameras, mesh):
    found, empty, cube = board_views(views_of(taken[0], cameras), BOARD, None)
    assert not empty
    for view, true in zip(found, taken[1], strict=True):
        assert view.mask_source == 'board' and iou(view.mask[None], true[None]) > 0.85
    np.testing.assert_allclose(cube.centre[:2], MIDDLE[:2], atol=0.1 * SIZE)
    assert SIZE < cube.side < 1.4 * SIZE


def test_an_empty_board_has_nothing_on_it(cameras, mesh):
    images, _ = photographed(gone(mesh), cameras[:3])
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
    other = reconstruct(tmp_path, BoardCameras(BOARD), 0.2, views=1)
    assert other.cube.side == 0.2 and other.cube.centre[2] == pytest.approx(0.1)


def test_a_photo_finds_its_camera_where_only_a_rim_of_the_board_is_free():
    wide = trimesh.creation.box([0.15, 0.15, 0.06])
    wide.visual.face_colors = [150, 90, 70, 255]
    cameras = around(3, 0.03)
    images, _ = photographed(standing(wide, 0.15), cameras)
    for image, camera in zip(images, cameras, strict=True):
        found = BOARD.detect(image, 'wide')
        pose = board_pose(camera.intrinsics, found)
        np.testing.assert_allclose(np.linalg.inv(pose @ FACE_UP), camera.pose, atol=1e-2)
