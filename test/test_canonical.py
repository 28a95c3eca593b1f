"""Whatever camera saw the object, the network is shown what the canonical one would see."""

import math

from active_recon.cameras import (
    Camera,
    CANONICAL_DISTANCE,
    CANONICAL_INTRINSICS,
    Intrinsics,
    orbit_camera,
)
from active_recon.canonical import canonical_image
from active_recon.errors import ViewError
from active_recon.rendering import composite, Renderer
from active_recon.shapes import make_shape
from active_recon.voxels import iou
import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

LENS = CANONICAL_INTRINSICS
PLACE = (0.7, math.radians(30), CANONICAL_DISTANCE)


@pytest.fixture(scope='module')
def renderer():
    return Renderer(make_shape('chair', 3))


def seen(renderer, camera):
    return composite(renderer.render(camera, samples=3), 255)


def covered(renderer, camera):
    return renderer.render(camera, samples=3)[..., 3:].repeat(3, axis=-1)


def turned(camera, angles_deg):
    """Return the camera turned about its own x, y and z, the object still in its image."""
    pose = camera.pose.copy()
    pose[:3, :3] = pose[:3, :3] @ Rotation.from_euler('xyz', angles_deg, degrees=True).as_matrix()
    return Camera(pose, camera.intrinsics)


def test_a_canonical_camera_s_image_is_only_resized_by_area(renderer):
    camera = orbit_camera(*PLACE)
    image = seen(renderer, camera)
    np.testing.assert_array_equal(canonical_image(image, camera),
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
        return [canonical_image(shown(renderer, one), one).astype(int)
                for one in (camera, orbit_camera(*PLACE))]

    image, expected = brought(seen)
    assert np.abs(image - expected).mean() < 3
    silhouette, expected = brought(covered)
    assert iou(silhouette[..., 0] > 127, expected[..., 0] > 127, (-2, -1)) > 0.9


def test_an_object_of_another_size_is_shown_at_the_same_size(renderer):
    near, far = orbit_camera(*PLACE), orbit_camera(*PLACE[:2], CANONICAL_DISTANCE * 0.3)
    image = seen(renderer, near)
    np.testing.assert_array_equal(canonical_image(image, far, object_size=0.3),
                                  canonical_image(image, near))


@pytest.mark.parametrize('image', [
    np.zeros((137, 136, 3), np.uint8), np.zeros((137, 137), np.uint8),
    np.zeros((137, 137, 4), np.uint8), np.zeros((137, 137, 3), np.float32)])
def test_an_image_that_is_not_the_camera_s_is_refused(image):
    with pytest.raises(ViewError, match='expected an image of 137 x 137 x 3 uint8') as refusal:
        canonical_image(image, orbit_camera(0.0))
    assert refusal.value.kind == 'image_size'


@pytest.mark.parametrize('camera', [turned(orbit_camera(0.0), (180, 0, 0)), Camera(np.eye(4))],
                         ids=['turned away', 'at the centre'])
def test_a_camera_that_looks_away_is_refused(camera):
    with pytest.raises(ViewError, match='expected a camera that looks at the object') as refusal:
        canonical_image(np.zeros((137, 137, 3), np.uint8), camera)
    assert refusal.value.kind == 'camera_direction'


def test_a_camera_straight_above_has_no_canonical_one_and_is_refused():
    pose = np.diag([1.0, -1, -1, 1])
    pose[2, 3] = 2
    with pytest.raises(ViewError, match='expected an elevation within'):
        canonical_image(np.zeros((137, 137, 3), np.uint8), Camera(pose))


def test_a_camera_that_nearly_touches_the_centre_costs_no_great_image():
    camera = orbit_camera(0.0, 0.5, 1e-3)
    assert canonical_image(np.full((137, 137, 3), 9, np.uint8), camera).shape == (64, 64, 3)
