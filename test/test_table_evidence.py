"""Photos tell what is the table under an object: there they show the same in its plane."""

from active_recon.geometry.cameras import orbit_camera
from active_recon.geometry.canonical import framed_image
from active_recon.photos.cube import Cube
from active_recon.photos.ground import Ground
from active_recon.photos.seen_photo import SeenPhoto
from active_recon.photos.segmented_views import agreed_shares
from active_recon.photos.table_evidence import above_table
from active_recon.segmentation import FramedShares
import cv2
import numpy as np
from photo_scene import thing
import photo_table
import pytest

SIZE, CELLS = 0.14, 128
CUBE = Cube(np.zeros(3), 1.1 * SIZE, np.array([0.0, 0.0, 1.0]))


@pytest.fixture(scope='module')
def mesh():
    return photo_table.centred(thing(), SIZE)


@pytest.fixture(scope='module')
def table(mesh):
    return Ground(np.array([0.0, 0.0, 1.0]), mesh.bounds[0, 2]).within(CUBE)


@pytest.fixture(scope='module')
def scene(mesh):
    return framed_scene(mesh, photo_table.PRINT)


def framed_scene(mesh, pattern):
    """Return framed photos of a thing on a table, and the true masks."""
    cameras = photo_table.around(6, 3 * SIZE, np.random.default_rng(3))
    images, masks = photo_table.photographed(mesh, cameras, pattern,
                                             np.random.default_rng(3))
    photos, inside = [], []
    for camera, image, mask in zip(cameras, images, masks, strict=True):
        where = CUBE.camera(camera, 1.0)
        photos.append(seen(*framed_image(image, where, 1.0, CELLS)))
        shown, _ = framed_image(np.repeat(np.uint8(mask[..., None]) * 255, 3, -1), where, 1.0,
                                CELLS)
        inside.append(shown[..., 0] > 127)
    return photos, inside


def seen(image, camera):
    colors = image[..., :3].astype(np.float32)
    known = image[..., 3] > 127 if image.shape[2] == 4 else np.full(image.shape[:2], True)
    return SeenPhoto(camera, colors, colors, known, np.zeros_like(colors))


def test_the_table_and_what_stands_on_it_are_told_apart(scene, table):
    photos, masks = scene
    on_table, on_object = [], []
    for mask, told in zip(masks, above_table(photos, table), strict=True):
        near = cv2.dilate(np.uint8(mask), np.ones((9, 9), np.uint8)) > 0  # edges show both
        within = cv2.erode(np.uint8(mask), np.ones((3, 3), np.uint8)) > 0
        on_table.append(told[CELLS // 2:][~near[CELLS // 2:] & (told[CELLS // 2:] != 0)])
        on_object.append(told[within])
    below, above = np.concatenate(on_table), np.concatenate(on_object)
    assert (below > 1).mean() < 0.08 and below.mean() < -1.5
    assert (above < -1).mean() < 0.15 and above.mean() > 2


def test_a_table_of_one_colour_tells_nothing(scene, table):
    even = [seen(np.full((CELLS, CELLS, 3), 180, np.uint8), photo.camera)
            for photo in scene[0]]
    for told in above_table(even, table):
        np.testing.assert_allclose(told, 0, atol=1e-6)


def test_one_photo_alone_and_what_no_photo_has_tell_nothing(scene, table):
    photos, _ = scene
    np.testing.assert_allclose(above_table(photos[:1], table)[0], 0, atol=1e-6)
    hidden = SeenPhoto(photos[0].camera, photos[0].image, photos[0].even,
                       np.full((CELLS, CELLS), False), photos[0].expected)
    told = above_table([hidden, *photos[1:]], table)
    np.testing.assert_allclose(told[0], 0, atol=1e-6)
    assert told[1].max() > 1


@pytest.mark.parametrize('height', [-0.2, 0.0, 0.04, 0.5])
def test_a_camera_may_be_as_low_as_the_table_or_lower_than_the_cube_s_top(height, scene, table):
    photos, _ = scene
    camera = orbit_camera(1.0, np.arcsin((table.level + height) / 3), 3.0,
                          photos[0].camera.intrinsics)
    low = SeenPhoto(camera, photos[0].image, photos[0].even, photos[0].known, photos[0].expected)
    told = above_table([low, *photos[1:]], table)
    assert all(np.isfinite(each).all() for each in told) and told[1].max() > 1
    assert bool(told[0].any()) == (height > 0.04)


def test_the_order_of_photos_that_are_all_compared_does_not_matter(scene, table):
    photos = scene[0][:5]
    for one, other in zip(above_table(photos, table), above_table(photos[::-1], table)[::-1],
                          strict=True):
        np.testing.assert_allclose(one, other, atol=1e-3)


def test_a_picture_on_the_table_is_no_object_though_the_segmenter_took_it_for_one(mesh, table):
    photos, masks = framed_scene(mesh, 'fine')
    place = np.array([[-0.3, 0.28], [0.3, 0.28], [0.3, 0.48], [-0.3, 0.48]])
    place = np.column_stack([place, np.full(4, table.level)])
    framed, pictures = [], []
    for photo, mask in zip(photos, masks, strict=True):
        pixels, _ = photo.camera.project(place)
        picture = cv2.fillPoly(np.zeros(mask.shape, np.uint8), [np.int32(pixels)], 1) > 0
        pictures.append(picture & ~mask)
        framed.append(FramedShares(np.uint8(photo.image),
                                   np.where(mask | picture, 0.97, 0.03).astype(np.float32),
                                   photo.camera))
    alone, with_table = (np.stack(agreed_shares(framed, ground)) for ground in (None, table))
    assert alone[np.stack(pictures)].mean() > 0.6 and with_table[np.stack(pictures)].mean() < 0.25
    assert with_table[np.stack(masks)].mean() > 0.85


@pytest.mark.parametrize('up', [[0.0, 0.0, 1.0], [0.3, -0.2, 0.9]])
def test_a_plane_is_as_high_in_the_object_frame_in_sides_of_the_cube(up):
    cube = Cube(np.array([0.2, -0.1, 0.4]), 0.3, np.array(up))
    ground = Ground(np.array([0.6, 0.0, 0.8]), 0.15)
    points = np.random.default_rng(0).normal(size=(20, 3))
    placed = points @ cube.world_from_object(1.0)[:3, :3].T + cube.centre
    np.testing.assert_allclose(ground.within(cube).height(points) * cube.side,
                               ground.height(placed))
