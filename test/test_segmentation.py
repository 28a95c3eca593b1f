"""The object is put on white where a segmenter finds it, in the image of any camera."""

from active_recon.acquisition.background import Background
from active_recon.errors import ViewError
from active_recon.geometry.cameras import Camera, Intrinsics, orbit_camera
from active_recon.geometry.canonical import framed_image, framing_camera
from active_recon.geometry.lenses import Distortion
from active_recon.geometry.resampling import carried_back
from active_recon.photos.segmented_views import agreed_shares
from active_recon.segmentation import FramedShares, Segmentation
import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

LENS = Intrinsics(400, 400, 160, 120, 320, 240)
BENT = Intrinsics(400, 400, 160, 120, 320, 240,
                  Distortion('plumb_bob', (-0.2, 0.05, 0.0, 0.0, 0.0)))
OBJECT, WALL = (200, 30, 30), (20, 90, 160)


class Red:
    """Finds what is red."""

    image_size = 128
    provenance = {'computed_by': 'a test'}

    def segment(self, image):
        return ((image[..., 0] > 128) & (image[..., 1] < 100)).astype(np.float32)


def camera(lens=LENS, size=1.0):
    return orbit_camera(0.4, 0.5, 2.5 * size, lens)


def disc(radius=40, at=(150, 110)):
    shown = np.full((240, 320, 3), WALL, np.uint8)
    cv2.circle(shown, at, radius, OBJECT, -1)
    return shown


@pytest.mark.parametrize('lens', [LENS, BENT], ids=['pinhole', 'distorted'])
def test_what_is_framed_and_carried_back_is_the_image_where_the_frame_is(lens):
    where = camera(lens)
    shown = np.zeros((240, 320, 3), np.uint8)
    cv2.circle(shown, (150, 110), 40, (255, 255, 255), -1)
    framed, _ = framed_image(shown, where, 1.0, 128)
    back = carried_back(framed[..., 0].astype(np.float32), framing_camera(where, 1.0, 128), where)
    assert back.shape == (240, 320)
    inside = cv2.erode(shown[..., 0], np.ones((9, 9))) > 0
    outside = cv2.dilate(shown[..., 0], np.ones((9, 9))) == 0
    assert (back[inside] > 250).all() and (back[outside] < 5).all()


def test_nothing_is_carried_behind_the_frame():
    wide = orbit_camera(0.4, 0.5, 1.5, Intrinsics(31, 31, 160, 120, 320, 240))
    pose = wide.pose.copy()
    pose[:3, :3] = pose[:3, :3] @ Rotation.from_euler('yx', (-65, 15), degrees=True).as_matrix()
    turned = Camera(pose, wide.intrinsics)
    target = framing_camera(turned, 1.0, 128)
    back = carried_back(np.ones((128, 128), np.float32), target, turned)
    pixels, depth = target.project((turned.position + turned.ray_directions()).reshape(-1, 3))
    there = (depth > 0) & (pixels > 0).all(axis=1) & (pixels < 128).all(axis=1)
    assert (depth < 0).any() and 0 < there.mean() < 0.5
    assert np.abs(back.ravel() - there).mean() < 0.005


def test_a_lens_whose_distortion_is_nothing_is_a_pinhole():
    framed = np.random.default_rng(0).random((128, 128), np.float32)
    framed = cv2.GaussianBlur(framed, (9, 9), 3)
    straight = Intrinsics(400, 400, 160, 120, 320, 240,
                          Distortion('plumb_bob', (0.0,) * 5))
    one, two = (carried_back(framed, framing_camera(camera(lens), 1.0, 128), camera(lens))
                for lens in (LENS, straight))
    np.testing.assert_allclose(one, two, atol=2e-3)


@pytest.mark.parametrize('size', [1.0, 0.05])
def test_the_object_stays_as_it_is_and_the_rest_is_white(size):
    shown = disc()
    white = Segmentation(Red()).on_white(shown, camera(size=size), size)
    inside = np.all(cv2.erode(shown, np.ones((7, 7))) == OBJECT, axis=2)
    inside &= cv2.erode((shown[..., 0] == OBJECT[0]).astype(np.uint8), np.ones((7, 7))) > 0
    outside = cv2.dilate((shown[..., 0] == OBJECT[0]).astype(np.uint8), np.ones((7, 7))) == 0
    np.testing.assert_array_equal(white[inside], shown[inside])
    assert (white[outside] == 255).all()


def test_outside_of_the_cube_all_is_background():
    shown = disc(300)
    white = Segmentation(Red()).on_white(shown, camera(), 0.4)
    assert (white[:5] == 255).all() and (white[120, 160] == OBJECT).all()


def test_an_image_without_the_object_is_refused_in_words():
    with pytest.raises(ViewError, match='no object found: expected one in the image') as refusal:
        Segmentation(Red()).on_white(disc() * 0, camera(), 1.0)
    assert refusal.value.kind == 'no_object'
    away = Camera(camera().pose @ np.diag([1.0, -1, -1, 1]), LENS)
    with pytest.raises(ViewError):
        Segmentation(Red()).on_white(disc(), away, 1.0)


def test_a_background_that_is_to_be_segmented_needs_what_does_it():
    how = Background('segment')
    with pytest.raises(ViewError, match='no segmenter'):
        how.cleared(disc())
    assert how.cleared(disc(), segmented=lambda image: image + 1)[0, 0, 0] == WALL[0] + 1


def test_photos_that_agree_outvote_one_that_lacks_a_part_and_colours_find_it_again():
    framed = []
    for azimuth in np.arange(5) * 1.2:
        where = framing_camera(orbit_camera(azimuth, 0.4, 2.5, LENS), 1.0, 128)
        inside = ball(where)
        image = np.where(inside[..., None], np.uint8(OBJECT), np.uint8(WALL))
        framed.append(FramedShares(image, np.where(inside, 0.9, 0.1).astype(np.float32), where))
    true = framed[2].shares > 0.5
    lacking = framed[2].shares.copy()
    lacking[:60] = np.minimum(lacking[:60], 0.3)
    framed[2] = FramedShares(framed[2].image, lacking, framed[2].camera)
    agreed = agreed_shares(framed)
    lost, left = (true & ~(found > 0.5) for found in (lacking, agreed[2]))
    assert lost.sum() > 200 and left.sum() < 0.1 * lost.sum()
    assert all(share.shape == (128, 128) and share.min() >= 0 and share.max() <= 1
               for share in agreed)
    assert agreed_shares([]) == []


def test_the_colours_of_pixels_that_a_camera_did_not_see_tell_nothing():
    found = []
    for unseen in (0, 255):
        framed = []
        for azimuth in np.arange(5) * 1.2:
            where = framing_camera(orbit_camera(azimuth, 0.4, 2.5, LENS), 1.0, 128)
            inside = ball(where)
            image = np.where(inside[..., None], np.uint8(0), np.uint8(WALL))
            image = np.dstack([image, np.full(inside.shape, 255, np.uint8)])
            image[:, :60] = unseen, unseen, unseen, 0
            shares = np.where(inside & (image[..., 3] > 0), 0.8, 0.1).astype(np.float32)
            framed.append(FramedShares(image, shares, where))
        found.append(np.stack(agreed_shares(framed))[:, :, 68:])  # ties reach a few pixels
    np.testing.assert_allclose(*found, atol=0.03)


def ball(where, radius=0.3):
    """Return the pixels of a camera's image that show a ball about the origin."""
    rays = where.ray_directions()
    along = -(rays @ where.position)
    nearest = where.position + along[..., None] * rays / (rays ** 2).sum(-1, keepdims=True)
    return np.linalg.norm(nearest, axis=-1) < radius
