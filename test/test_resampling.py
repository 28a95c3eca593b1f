"""How an image is resampled does not depend on what is only there to make it fast."""

import math

from active_recon.geometry import resampling
from active_recon.geometry.cameras import Camera, Intrinsics, orbit_camera
from active_recon.geometry.canonical import framing_camera
from active_recon.geometry.lenses import Distortion
import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

BENT = Distortion('plumb_bob', (0.1, -0.05, 0.001, 0.001, 0.0))
SIZE = 150  # no whole number of bands


def camera_of(seed, distortion=None):
    """Return a camera that looks past the object, with a lens of its own."""
    rng = np.random.default_rng(seed)
    pose = orbit_camera(rng.uniform(0, 6), rng.uniform(-1.2, 1.2), rng.uniform(1.5, 3)).pose.copy()
    pose[:3, :3] = pose[:3, :3] @ Rotation.from_rotvec(rng.normal(0, 0.2, 3)).as_matrix()
    width, height = (int(side) for side in rng.integers(60, 700, 2))
    focal = rng.uniform(0.5, 2) * width
    return Camera(pose, Intrinsics(focal, 1.1 * focal, 0.4 * width, height / 2, width, height,
                                   distortion))


def image_of(camera, seed):
    lens = camera.intrinsics
    return np.random.default_rng(seed).integers(0, 256, (lens.height, lens.width, 3), np.uint8)


@pytest.mark.parametrize('beyond', [cv2.BORDER_REPLICATE, cv2.BORDER_CONSTANT])
@pytest.mark.parametrize('distortion', [None, BENT], ids=['straight', 'bent'])
@pytest.mark.parametrize('seed', range(6))
def test_each_channel_is_resampled_as_if_it_were_alone(seed, distortion, beyond):
    camera = camera_of(seed, distortion)
    image, target = image_of(camera, seed), framing_camera(camera, 1.0, SIZE)
    together = resampling.seen_by(target, image, camera, beyond)
    for channel in range(3):
        alone = resampling.seen_by(
            target, np.ascontiguousarray(image[..., channel]), camera, beyond)
        np.testing.assert_array_equal(together[..., channel], alone)


@pytest.mark.parametrize('band', [1, 7, 10_000])
@pytest.mark.parametrize('distortion', [None, BENT], ids=['straight', 'bent'])
@pytest.mark.parametrize('seed', range(3))
def test_an_image_is_the_same_however_many_rows_are_computed_at_a_time(
        seed, distortion, band, monkeypatch):
    camera = camera_of(seed, distortion)
    image, target = image_of(camera, seed), framing_camera(camera, 1.0, SIZE)
    usual = resampling.seen_by(target, image, camera)
    monkeypatch.setattr(resampling, '_BAND', band)
    np.testing.assert_array_equal(resampling.seen_by(target, image, camera), usual)


@pytest.mark.parametrize('seed', range(20))
def test_as_many_samples_are_taken_as_the_usual_distance_of_neighbours_asks_for(seed):
    camera = camera_of(seed)
    seen = resampling._seen(camera, framing_camera(camera, 1.0, 40), 40)
    apart = np.median(np.concatenate([
        np.hypot(*(np.diff(each, axis=axis) for each in seen)).ravel() for axis in (0, 1)]))
    assert resampling._samples(seen) == min(max(math.ceil(apart / resampling.SAMPLE_EVERY), 1), 3)
