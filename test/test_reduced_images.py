"""JPEG images are decoded at the scale that is used: what a network is shown stays the same."""

from active_recon.geometry.cameras import Camera, Intrinsics, orbit_camera
from active_recon.geometry.canonical import network_image, NetworkSpec, useful_reduction
from active_recon.geometry.lenses import Distortion
import cv2
from msg_tools.camera_images import compressed_image_from_msg, reduced_from_msg
from msg_tools.images import image_to_msg
from msg_tools.views import View
import numpy as np
import pytest
from sensor_msgs.msg import CompressedImage
from std_msgs.msg import Header

LIFTING, CANONICAL = NetworkSpec(128, 64, False), NetworkSpec(64, 32, True)


def picture(width, height):
    """Return an image of soft spots of all sizes, (height, width, 3)."""
    rng = np.random.default_rng(0)
    layers = [cv2.resize(rng.integers(0, 256, (side, side * 4 // 3, 3), np.uint8),
                         (width, height), interpolation=cv2.INTER_CUBIC)
              for side in (6, 12, 48)]
    return np.mean(layers, axis=0).astype(np.uint8)


def jpeg(image, quality=92):
    encoded = cv2.imencode('.jpg', image, [cv2.IMWRITE_JPEG_QUALITY, quality])[1]
    return CompressedImage(format='jpeg', data=encoded.tobytes())


def camera(width, height, distortion=None):
    focal = 1.1 * min(width, height)
    return orbit_camera(0.7, 0.5, 2.2, Intrinsics(
        focal, focal, width / 2 + 11, height / 2 - 7, width, height, distortion))


@pytest.mark.parametrize(('spec', 'by'), [(LIFTING, 4), (CANONICAL, 8)])
@pytest.mark.parametrize('distortion', [
    None, Distortion('plumb_bob', (-0.1, 0.02, 0.001, 0.002, 0.0))])
def test_a_network_is_shown_nearly_the_same_from_a_reduced_image(spec, by, distortion):
    taken = camera(1603, 1201, distortion)  # no multiple of anything
    view = View(0, jpeg(picture(1603, 1201)), taken)
    assert useful_reduction(taken, spec) == by
    whole, expected = network_image(view.image, taken, spec)
    found, known = network_image(*view.reduced(by), spec)
    away = np.abs(found.astype(int) - whole)
    assert away.mean() < 1
    assert np.quantile(away, 0.999) <= 6
    np.testing.assert_allclose(known.pose, expected.pose)
    np.testing.assert_allclose(known.intrinsics.matrix, expected.intrinsics.matrix)


def test_a_pixel_of_a_reduced_image_shows_what_its_pixels_of_the_whole_one_showed():
    image = np.repeat(np.repeat(picture(64, 48), 8, axis=0), 8, axis=1)
    found = reduced_from_msg(jpeg(image, 100), 8)
    np.testing.assert_allclose(found.astype(int), image[4::8, 4::8, ::-1], atol=3)


@pytest.mark.parametrize('by', [2, 4, 8])
def test_the_camera_of_a_reduced_image_sees_every_point_at_its_share_of_the_pixels(by):
    taken, points = camera(1603, 1201), np.random.default_rng(0).uniform(-0.5, 0.5, (20, 3))
    smaller = Camera(taken.pose, taken.intrinsics.reduced(by))
    np.testing.assert_allclose(smaller.project(points)[0] * by, taken.project(points)[0])
    image, known = View(0, jpeg(picture(1603, 1201)), taken).reduced(by)
    assert image.shape == (known.intrinsics.height, known.intrinsics.width, 3)
    assert known.intrinsics == smaller.intrinsics


def test_twice_the_pixels_can_be_reduced_twice_as_much():
    found = [useful_reduction(camera(400 * scale, 300 * scale), LIFTING)
             for scale in (1, 2, 4, 8, 16)]
    assert found == [1, 2, 4, 8, 8]


def test_what_else_needs_pixels_keeps_them():
    assert useful_reduction(camera(1600, 1200), CANONICAL, least=256) == 2


def test_a_camera_that_looks_away_reduces_nothing():
    turned = camera(1600, 1200).pose @ np.diag([-1.0, 1, -1, 1])
    assert useful_reduction(Camera(turned, camera(1600, 1200).intrinsics), LIFTING) == 1


def test_images_that_are_no_jpeg_stay_whole():
    image, taken = picture(160, 120), camera(160, 120)
    png = CompressedImage(format='png', data=cv2.imencode('.png', image)[1].tobytes())
    for msg in (png, image_to_msg(image, Header())):
        found, known = View(0, msg, taken).reduced(2)
        assert found.shape == image.shape
        assert known is taken
    np.testing.assert_array_equal(reduced_from_msg(jpeg(image), 1),
                                  compressed_image_from_msg(jpeg(image)))
