"""Whether the object's cube is in the image, and how much of it is not."""

from dataclasses import replace
import math

from active_recon.errors import ViewError
from active_recon.geometry.cameras import AZIMUTHS, Camera, Intrinsics, orbit_camera
from active_recon.geometry.framing import require_in_image, share_outside
from active_recon.geometry.lenses import Distortion
from active_recon.volumes.rendering import Renderer
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
import trimesh

LENS = Intrinsics(150, 150, 100, 75, 200, 150)


def aimed(azimuth=0.4, distance=4.0, turn_deg=(0, 0, 0), lens=LENS):
    pose = orbit_camera(azimuth, 0.5, distance).pose
    pose[:3, :3] = pose[:3, :3] @ Rotation.from_euler('xyz', turn_deg, degrees=True).as_matrix()
    return Camera(pose, lens)


def refusal(camera, size=1.0):
    with pytest.raises(ViewError) as caught:
        require_in_image(camera, size)
    assert caught.value.kind == 'out_of_image'
    return str(caught.value)


@pytest.mark.parametrize('azimuth', AZIMUTHS[:7])
@pytest.mark.parametrize('size', [0.01, 30.0])
def test_the_canonical_camera_has_the_whole_cube_in_its_image(azimuth, size):
    assert share_outside(orbit_camera(azimuth, distance=2.1 * size), size) < 1e-6


@pytest.mark.parametrize('seed', range(3))
@pytest.mark.parametrize('distortion', [None, Distortion('plumb_bob', (-0.2, 0.03, 0, 0))],
                         ids=['straight', 'bent'])
def test_the_share_outside_is_that_of_the_pixels_of_a_cube(seed, distortion):
    rng = np.random.default_rng(seed)
    turn_deg = rng.uniform((-30, -35, -180), (30, 35, 180))
    camera = aimed(rng.uniform(0, math.tau), 3.5, turn_deg, replace(LENS, distortion=distortion))
    wide = replace(camera.intrinsics, cx=LENS.cx + 150, cy=LENS.cy + 150, width=500, height=450)
    shown = Renderer(trimesh.creation.box((1, 1, 1))).render(
        Camera(camera.pose, wide), samples=1)[..., 3] > 0
    inside = shown[150:300, 150:350].sum() / shown.sum()
    assert share_outside(camera, 1.0) == pytest.approx(1 - inside, abs=0.02)


def test_an_object_that_goes_out_of_the_image_is_more_and_more_outside():
    shares = [share_outside(aimed(turn_deg=(0, angle, 0)), 1.0) for angle in range(0, 60, 2)]
    assert (np.diff(shares) > -1e-6).all()
    assert (shares[0], shares[-1]) == pytest.approx((0, 1))


@pytest.mark.parametrize(('azimuth_deg', 'elevation_deg', 'focal'), [(0, 45, 800), (75, 10, 384)])
def test_so_it_is_on_round_angles_too(azimuth_deg, elevation_deg, focal):
    """For some of them OpenCV's area of an intersection is wrong."""
    camera = orbit_camera(math.radians(azimuth_deg), math.radians(elevation_deg), 3.0,
                          Intrinsics(focal, focal, 320, 240, 640, 480))
    shares = []
    for pan_deg in np.arange(0, 56, 0.5):
        pose = camera.pose.copy()
        pose[:3, :3] = pose[:3, :3] @ Rotation.from_euler('y', pan_deg, degrees=True).as_matrix()
        shares.append(share_outside(replace(camera, pose=pose), 1.0))
    assert (np.diff(shares) > -1e-6).all()
    assert (shares[0], shares[-1]) == pytest.approx((0, 1))


def test_a_part_outside_is_refused_with_its_share_and_what_to_do():
    said = refusal(aimed(turn_deg=(0, 31, 0)))
    assert 'got 43 % of it outside' in said
    assert 'move the camera back' in said
    assert '100 %' in refusal(aimed(turn_deg=(0, 55, 0)))
    assert '% of it outside' in refusal(aimed(distance=1.5))


def test_what_is_a_little_outside_as_poses_are_inexact_is_none():
    shares = []
    for angle in np.linspace(18, 32, 60):
        camera = aimed(turn_deg=(0, angle, 0))
        shares.append(share_outside(camera, 1.0))
        if shares[-1] <= 0.02:
            require_in_image(camera, 1.0)
        else:
            refusal(camera)
    assert 0 < min(share for share in shares if share > 1e-6) < 0.02 < max(shares)


@pytest.mark.parametrize('camera', [
    aimed(turn_deg=(180, 0, 0)), aimed(turn_deg=(0, 170, 0)), aimed(turn_deg=(0, 90, 0)),
    aimed(distance=1.1, turn_deg=(90, 0, 0))])
def test_a_camera_that_looks_away_or_past_is_refused(camera):
    assert 'camera looks away from the object: expected one that looks at it' in refusal(camera)


@pytest.mark.parametrize('camera', [
    Camera(np.eye(4)), orbit_camera(0.0, 0.5, 1e-3), aimed(distance=0.7, turn_deg=(0, 90, 0)),
    orbit_camera(0.0, 0.0, 0.5), orbit_camera(math.pi / 4, math.atan(0.5**0.5), 0.9)])
def test_a_camera_in_the_cube_or_beside_it_is_refused(camera):
    told = refusal(camera)
    assert "camera in the object's cube or beside it: expected a distance" in told
    assert told.endswith("set the cube's side (object_size; of photos --box)")


@pytest.mark.parametrize('distance', [100, 2100, 1e5, 1e8, 9e8])
def test_a_cube_too_far_away_to_be_seen_as_with_poses_in_millimetres_is_refused(distance):
    assert 'object too small in the image: expected its cube of 1 m' in refusal(
        orbit_camera(1, 0.5, distance))
    assert 0 <= share_outside(orbit_camera(1, 0.5, distance), 1.0) <= 1


def test_what_counts_is_how_large_the_object_is():
    camera = aimed(distance=1.0)
    refusal(camera)
    require_in_image(camera, 0.3)
