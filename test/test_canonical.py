"""Whatever camera saw the object, the network is shown what the canonical one would see."""

from dataclasses import replace
from functools import cache
import math

from active_recon.errors import ViewError
from active_recon.geometry.cameras import (
    Camera,
    CANONICAL_DISTANCE,
    CANONICAL_INTRINSICS,
    Intrinsics,
    orbit_camera,
)
from active_recon.geometry.canonical import (
    canonical_image,
    framed_image,
    network_image,
    NetworkSpec,
)
from active_recon.geometry.framing import cube_corners
from active_recon.geometry.lenses import Distortion
from active_recon.shapes import make_shape
from active_recon.volumes.rendering import composite, Renderer
from active_recon.volumes.voxels import iou
import cv2
import numpy as np
from PIL import Image
import pytest
from scipy.spatial.transform import Rotation

LENS = CANONICAL_INTRINSICS
PLACE = (0.7, math.radians(30), CANONICAL_DISTANCE)
CANONICAL = orbit_camera(*PLACE)


@pytest.fixture(scope='module')
def renderer():
    return Renderer(make_shape('chair', 3))


def shown_of(image, camera, **settings):
    """Return the canonical image alone."""
    shown, _ = canonical_image(image, camera, **settings)
    return shown


@cache
def rendered(renderer, camera):
    return renderer.render(camera, samples=3)


def seen(renderer, camera):
    return composite(rendered(renderer, camera), 255)


def covered(renderer, camera):
    return rendered(renderer, camera)[..., 3:].repeat(3, axis=-1)


def turned(camera, angles_deg):
    """Return the camera turned about its own x, y and z, the object still in its image."""
    pose = camera.pose.copy()
    pose[:3, :3] = pose[:3, :3] @ Rotation.from_euler('xyz', angles_deg, degrees=True).as_matrix()
    return Camera(pose, camera.intrinsics)


def test_a_canonical_camera_s_image_is_only_resized_by_area(renderer):
    camera = orbit_camera(*PLACE)
    image = seen(renderer, camera)
    np.testing.assert_array_equal(shown_of(image, camera),
                                  cv2.resize(image, (64, 64), interpolation=cv2.INTER_AREA))


OTHERS = {
    'large image': orbit_camera(*PLACE, LENS.resized(640, 640)),
    'wide image': orbit_camera(*PLACE, Intrinsics(400, 400, 330, 235, 640, 480)),
    'unequal focal lengths': orbit_camera(*PLACE, Intrinsics(420, 350, 320, 240, 640, 480)),
    'rolled': turned(orbit_camera(*PLACE), (0, 0, 90)),
    'rolled and aside': turned(
        orbit_camera(*PLACE, Intrinsics(300, 300, 320, 240, 640, 480)), (5, -8, 30)),
    'near': orbit_camera(0.7, math.radians(30), 1.7, Intrinsics(110, 110, 100, 100, 200, 200)),
    'far': orbit_camera(0.7, math.radians(30), 2.8, Intrinsics(400, 400, 160, 160, 320, 320)),
}


@pytest.mark.parametrize('camera', OTHERS.values(), ids=OTHERS)
def test_another_camera_s_image_becomes_nearly_the_canonical_one(camera, renderer):
    def brought(shown):
        return [shown_of(shown(renderer, one), one).astype(int)
                for one in (camera, CANONICAL)]

    image, expected = brought(seen)
    assert np.abs(image - expected).mean() < 3
    silhouette, expected = brought(covered)
    assert iou(silhouette[..., 0] > 127, expected[..., 0] > 127, (-2, -1)) > 0.9


def test_an_object_of_another_size_is_shown_at_the_same_size(renderer):
    near, far = orbit_camera(*PLACE), orbit_camera(*PLACE[:2], CANONICAL_DISTANCE * 0.3)
    image = seen(renderer, near)
    np.testing.assert_array_equal(shown_of(image, far, object_size=0.3),
                                  shown_of(image, near))


@pytest.mark.parametrize('image', [
    np.zeros((137, 136, 3), np.uint8), np.zeros((137, 137), np.uint8),
    np.zeros((137, 137, 4), np.uint8), np.zeros((137, 137, 3), np.float32)])
def test_an_image_that_is_not_the_camera_s_is_refused(image):
    with pytest.raises(ViewError, match='wrong image size or type: expected 137 x 137 x 3 '
                       'uint8') as refusal:
        shown_of(image, orbit_camera(0.0))
    assert refusal.value.kind == 'image_size'


@pytest.mark.parametrize('image', [Image.new('RGB', (137, 137)), [[[0, 0, 0]]], None])
def test_an_image_that_is_no_array_is_refused_by_the_name_of_its_type(image):
    with pytest.raises(ViewError, match=f'expected an array.*got a {type(image).__name__}'):
        shown_of(image, orbit_camera(0.0))


def test_a_camera_straight_above_has_no_canonical_one_and_is_refused_with_its_degrees():
    pose = np.diag([1.0, -1, -1, 1])
    pose[2, 3] = 2
    with pytest.raises(ViewError, match='invalid elevation: expected one within .*got 90 degrees; '
                       'move the camera aside'):
        shown_of(np.zeros((137, 137, 3), np.uint8), Camera(pose))


BENT = {
    'barrel': Distortion('plumb_bob', (-0.28, 0.07, 0.001, -0.002, 0.0)),
    'pincushion': Distortion('plumb_bob', (0.15, 0.05, 0.0, 0.0, 0.0)),
    'rational': Distortion('rational_polynomial',
                           (0.5, -0.2, 1e-4, -2e-4, -0.01, 0.8, -0.1, -0.05)),
    'fisheye': Distortion('equidistant', (0.05, -0.02, 0.01, -0.004))}


@pytest.mark.parametrize('distortion', BENT.values(), ids=BENT)
@pytest.mark.parametrize('aside_deg', [(0, 0, 0), (9, -12, 20)], ids=['straight', 'aside'])
def test_a_bent_image_becomes_nearly_what_a_straight_one_does(renderer, distortion, aside_deg):
    straight = turned(orbit_camera(*PLACE, Intrinsics(95, 100, 100, 88, 210, 180)), aside_deg)
    bent = Camera(straight.pose, replace(straight.intrinsics, distortion=distortion))
    images, silhouettes = [], []
    for camera in (straight, bent):
        shown = renderer.render(camera, samples=2)
        images.append(shown_of(composite(shown, 255), camera).astype(int))
        covered_ones = np.ascontiguousarray(shown[..., 3:].repeat(3, axis=-1))
        silhouettes.append(shown_of(covered_ones, camera)[..., 0] > 127)
    assert np.abs(images[1] - images[0]).mean() < 2
    assert iou(*silhouettes, (-2, -1)) > 0.93


def aside(width=300, height=260):
    lens = Intrinsics(120, 120, 140, 135, 300, 260).resized(width, height)
    return turned(orbit_camera(*PLACE, lens), (4, -6, 10))


@pytest.mark.parametrize('size', [(300, 260), (600, 520), (300, 520), (3300, 2860)])
def test_an_image_of_any_resolution_says_the_same(renderer, size):
    image = seen(renderer, aside())
    finer = cv2.resize(image, size, interpolation=cv2.INTER_NEAREST)
    apart = np.abs(shown_of(finer, aside(*size)).astype(int)
                   - shown_of(image, aside()))
    assert apart.mean() < 1.5


def test_finer_stripes_than_the_network_can_see_become_their_mean():
    camera = aside(1200, 1040)
    image = np.zeros((1040, 1200, 3), np.uint8)
    image[:, ::2] = 200
    np.testing.assert_allclose(shown_of(image, camera).astype(int), 100, atol=3)


@pytest.mark.parametrize('distortion', [None, BENT['barrel']], ids=['straight', 'bent'])
@pytest.mark.parametrize('size', [(300, 260), (997, 613)])
def test_a_camera_and_its_image_upside_down_show_the_same(renderer, size, distortion):
    camera = aside(*size)
    lens = replace(camera.intrinsics, distortion=distortion)
    over = replace(lens, cx=lens.width - lens.cx, cy=lens.height - lens.cy,
                   distortion=distortion and Distortion(
                       'plumb_bob', (*distortion.coefficients[:2], -distortion.coefficients[2],
                                     -distortion.coefficients[3], 0.0)))
    upside_down = Camera(turned(camera, (0, 0, 180)).pose, over)
    image = np.random.default_rng(0).integers(0, 256, (size[1], size[0], 3), np.uint8)
    expected = shown_of(image, Camera(camera.pose, lens))
    found = shown_of(np.ascontiguousarray(image[::-1, ::-1]), upside_down)
    np.testing.assert_allclose(found.astype(int), expected, atol=2)


def test_a_portrait_camera_shows_what_the_landscape_one_does(renderer):
    landscape = aside()
    lens = landscape.intrinsics
    portrait = Camera(turned(landscape, (0, 0, -90)).pose, Intrinsics(
        lens.fy, lens.fx, lens.height - lens.cy, lens.cx, lens.height, lens.width))
    image = seen(renderer, landscape)
    found = shown_of(np.ascontiguousarray(np.rot90(image, -1)), portrait)
    np.testing.assert_allclose(found.astype(int), shown_of(image, landscape), atol=2)


def test_a_farther_camera_with_a_longer_lens_shows_the_object_as_large(renderer):
    near = orbit_camera(*PLACE, Intrinsics(300, 300, 200, 200, 400, 400))
    far = orbit_camera(*PLACE[:2], 3 * PLACE[2], Intrinsics(900, 900, 200, 200, 400, 400))
    silhouettes = [shown_of(covered(renderer, one), one)[..., 0] > 127
                   for one in (near, far)]
    assert iou(*silhouettes, (-2, -1)) > 0.75  # from afar it is seen with less perspective
    assert silhouettes[0].sum() == pytest.approx(silhouettes[1].sum(), rel=0.1)


def test_an_image_of_one_color_stays_of_it_whatever_the_camera():
    for camera in OTHERS.values():
        lens = camera.intrinsics
        image = np.full((lens.height, lens.width, 3), (9, 100, 255), np.uint8)
        assert (shown_of(image, camera) == (9, 100, 255)).all()


def test_an_image_far_longer_than_wide_is_shown_too():
    camera = orbit_camera(*PLACE, Intrinsics(140, 140, 68.5, 39_000, 137, 40_000))
    image = np.full((40_000, 137, 3), 7, np.uint8)
    assert (shown_of(image, camera) == 7).all()


@pytest.mark.parametrize('camera', OTHERS.values(), ids=OTHERS)
def test_the_canonical_image_comes_with_the_canonical_camera(camera, renderer):
    _, found = canonical_image(seen(renderer, camera), camera)
    expected = orbit_camera(*PLACE, LENS.resized(64, 64))
    np.testing.assert_allclose(found.pose, expected.pose, atol=1e-9)
    assert found.intrinsics == expected.intrinsics


@pytest.mark.parametrize('size', [64, 128])
@pytest.mark.parametrize('camera', OTHERS.values(), ids=OTHERS)
def test_a_framed_image_shows_what_its_camera_sees_from_where_the_real_one_stands(
        camera, size, renderer):
    silhouette, found = framed_image(covered(renderer, camera), camera, image_size=size)
    assert silhouette.shape[:2] == (size, size)
    np.testing.assert_array_equal(found.position, camera.position)
    assert found.pose[2, 0] == pytest.approx(0, abs=1e-9)
    assert found.pose[2, 1] < 0  # upright: what is down in the image is down
    expected = covered(renderer, found)[..., 0] > 127
    assert iou(silhouette[..., 0] > 127, expected, (-2, -1)) > 0.93
    corners, _ = found.project(cube_corners())
    assert 0 <= corners.min() < corners.max() <= size
    assert max(-corners.min() + size / 2, corners.max() - size / 2) > 0.45 * size


def test_a_network_gets_the_image_that_its_spec_asks_for(renderer):
    camera = OTHERS['wide image']
    image = seen(renderer, camera)
    for spec, bring in ((NetworkSpec(64, 32, True), canonical_image),
                        (NetworkSpec(128, 64, False), framed_image)):
        (found, found_camera), (expected, expected_camera) = (
            network_image(image, camera, spec), bring(image, camera, 1.0, spec.image_size))
        np.testing.assert_array_equal(found, expected)
        np.testing.assert_array_equal(found_camera.pose, expected_camera.pose)
