"""A camera on an arm is found again from rendered boards and the arm's poses."""

import math
import re

from active_recon.calibration.arm import fit_arm
from active_recon.calibration.board import detect_all, Detection
from active_recon.calibration.fit import overall_error, rigid
from active_recon.calibration.hand_eye import hand_eye
from active_recon.calibration.lens import project, write_lens
from active_recon.calibration.placement import Placement
from active_recon.cli.main import app
from active_recon.errors import DataError
from active_recon.geometry.cameras import orbit_camera
import cv2
import numpy as np
import pytest
from rendered_boards import BOARD, LENS, render, WIDE
from scipy.spatial.transform import Rotation
from typer.testing import CliRunner
import yaml

SIZE = 0.12
MOUNT_FROM_CAMERA = rigid(np.array([0.1, -0.2, 1.5]), np.array([0.03, -0.05, 0.08]))
BASE_FROM_OBJECT = rigid(np.array([0, 0, 0.7]), np.array([0.6, -0.1, 0.3]))
BOARD_FROM_OBJECT = Placement(SIZE).on_board(BOARD)
BASE_FROM_BOARD = BASE_FROM_OBJECT @ np.linalg.inv(BOARD_FROM_OBJECT)
VIEWS = [orbit_camera(azimuth, math.radians(elevation), distance).pose @ rigid(
    np.array([0, 0, roll]), np.zeros(3)) for azimuth, elevation, distance, roll in (
    (0.0, 50, 0.5, 0.0), (0.9, 40, 0.45, 0.3), (1.7, 65, 0.5, -0.4), (2.8, 55, 0.4, 0.8),
    (3.9, 45, 0.5, 0.1), (4.6, 60, 0.45, -0.7), (5.5, 50, 0.5, 0.5), (0.4, 75, 0.45, 0.0))]


def mounts_of(views):
    """Return base from mount, (N, 4, 4), where the camera sees the object from those poses."""
    return np.stack([BASE_FROM_OBJECT @ view @ np.linalg.inv(MOUNT_FROM_CAMERA)
                     for view in views])


def seen_from(views, lens=LENS, noise=0.0):
    images = [(f'{index}.png', image) for index, image in enumerate(
        rendered(views, lens, noise))]
    found, missing = detect_all(BOARD, images, len(images))
    assert not missing
    return found


def rendered(views, lens=LENS, noise=0.0):
    return [render(lens, np.linalg.inv(view) @ np.linalg.inv(BOARD_FROM_OBJECT), noise, seed=index)
            for index, view in enumerate(views)]


def assert_same(pose, expected, metres=1e-3, degrees=0.2):
    apart = Rotation.from_matrix(pose[:3, :3].T @ expected[:3, :3]).magnitude()
    assert np.linalg.norm(pose[:3, 3] - expected[:3, 3]) < metres
    assert math.degrees(apart) < degrees


@pytest.fixture(scope='module')
def seen():
    return seen_from(VIEWS)


@pytest.fixture(scope='module')
def found(seen):
    return fit_arm(seen, LENS, mounts_of(VIEWS))


def test_the_camera_on_its_mount_is_found_within_a_millimetre_and_a_fifth_of_a_degree(found):
    assert_same(found.mount_from_camera, MOUNT_FROM_CAMERA)
    assert_same(found.base_from_board, BASE_FROM_BOARD)
    assert overall_error(found.images) < 0.3


def test_it_is_found_through_a_bent_lens_and_noise():
    found = fit_arm(seen_from(VIEWS, WIDE, noise=4.0), WIDE, mounts_of(VIEWS))
    assert_same(found.mount_from_camera, MOUNT_FROM_CAMERA)
    assert_same(found.base_from_board, BASE_FROM_BOARD)


@pytest.mark.slow
def test_an_arm_that_is_not_quite_where_it_says_is_forgiven():
    rng = np.random.default_rng(5)
    views = [orbit_camera(rng.uniform(-3, 3), rng.uniform(0.6, 1.4), 0.45).pose
             @ rigid(np.array([0, 0, rng.normal(0, 0.3)]), np.zeros(3)) for _ in range(12)]
    mounts = mounts_of(views) @ np.stack([
        rigid(rng.normal(0, math.radians(0.1), 3), rng.normal(0, 0.0005, 3)) for _ in views])
    found = fit_arm(drawn_from(views), LENS, mounts)
    assert_same(found.mount_from_camera, MOUNT_FROM_CAMERA, 3e-3, 0.4)


def test_the_order_of_the_images_does_not_matter(seen, found):
    order = np.random.default_rng(0).permutation(len(seen))
    other = fit_arm([seen[index] for index in order], LENS, mounts_of(VIEWS)[order])
    np.testing.assert_allclose(other.mount_from_camera, found.mount_from_camera, atol=1e-6)
    np.testing.assert_allclose(other.base_from_board, found.base_from_board, atol=1e-6)


def test_another_base_moves_the_board_and_not_the_camera_on_its_mount(seen, found):
    moved = rigid(np.array([0.3, 1.0, -2.0]), np.array([3.0, -1.0, 0.5]))
    other = fit_arm(seen, LENS, moved @ mounts_of(VIEWS))
    assert_same(other.mount_from_camera, found.mount_from_camera, 1e-5, 1e-3)
    assert_same(other.base_from_board, moved @ found.base_from_board, 1e-5, 1e-3)


@pytest.mark.parametrize('scale', [1000.0, 1.2, 0.5])
def test_poses_of_another_scale_than_the_board_are_refused(seen, scale):
    mounts = mounts_of(VIEWS)
    mounts[:, :3, 3] *= scale
    with pytest.raises(DataError, match='by the poses the squares are .* measure a square'
                       ) as refusal:
        fit_arm(seen, LENS, mounts)
    assert refusal.value.kind == 'scale'


def test_views_of_one_point_from_one_distance_are_enough_and_tell_nothing_of_the_scale(found):
    views = [orbit_camera(azimuth, elevation, 0.45).pose @ rigid(
        np.array([0, 0, roll]), np.zeros(3)) for azimuth, elevation, roll in (
        (0.0, 0.9, 0.0), (1.0, 0.7, 0.3), (2.1, 1.1, -0.4), (3.2, 0.8, 0.8), (4.4, 1.0, 0.1))]
    orbit = fit_arm(drawn_from(views), LENS, mounts_of(views))
    assert_same(orbit.mount_from_camera, MOUNT_FROM_CAMERA, 1e-4, 0.01)
    assert found.scale_known
    assert not orbit.scale_known


def drawn_from(views):
    """Return what is seen without any error."""
    return [Detection(str(index), BOARD.corners, project(
        LENS, BOARD.corners, np.linalg.inv(BOARD_FROM_OBJECT @ view)), (640, 480))
        for index, view in enumerate(views)]


def test_poses_of_other_images_are_refused():
    with pytest.raises(DataError, match='wrong pose: expected the camera to turn') as refusal:
        fit_arm(drawn_from(VIEWS), LENS, np.roll(mounts_of(VIEWS), 1, axis=0))
    assert refusal.value.kind == 'rotation'


def test_a_pose_that_is_not_of_its_image_is_named():
    mounts = mounts_of(VIEWS)
    mounts[3, :3, :3] = Rotation.from_quat(  # w x y z
        np.roll(Rotation.from_matrix(mounts[3, :3, :3]).as_quat(), 1)).as_matrix()
    with pytest.raises(DataError, match='^3: wrong pose: .* quaternions x y z w'):
        fit_arm(drawn_from(VIEWS), LENS, mounts)


def test_a_board_that_moved_is_not_told_as_one_of_another_scale():
    moved = np.stack([np.linalg.inv(BOARD_FROM_OBJECT @ view) for view in VIEWS])
    moved[-1] = moved[-1] @ rigid(np.zeros(3), np.array([0.05, 0.02, 0]))
    assert hand_eye(mounts_of(VIEWS), moved, [str(index) for index in range(8)]).scale_known


def test_poses_about_one_axis_alone_are_refused():
    views = [orbit_camera(azimuth, 0.9, 0.5).pose for azimuth in (0.0, 0.5, 1.0, 1.5, 2.0)]
    with pytest.raises(DataError, match='rotate the camera about two axes') as refusal:
        fit_arm(seen_from(views), LENS, mounts_of(views))
    assert refusal.value.kind == 'poses'


def test_four_images_are_too_few(seen):
    with pytest.raises(DataError, match='5 images from known poses or more, got 4'):
        fit_arm(seen[:4], LENS, mounts_of(VIEWS[:4]))


def test_the_command_writes_the_transforms_of_camera_and_object(tmp_path):
    (tmp_path / 'images').mkdir()
    rows = ['image,x,y,z,qx,qy,qz,qw']
    for index, (image, mount) in enumerate(zip(rendered(VIEWS), mounts_of(VIEWS), strict=True)):
        cv2.imwrite(str(tmp_path / 'images' / f'{index}.png'), image)
        numbers = (*mount[:3, 3], *Rotation.from_matrix(mount[:3, :3]).as_quat())
        rows.append(','.join([f'{index}.png', *map(str, numbers)]))
    (tmp_path / 'poses.csv').write_text('\n'.join(rows))
    write_lens(LENS, tmp_path / 'lens.yaml')
    result = CliRunner().invoke(app, [
        'calibrate', str(tmp_path / 'images'), '--poses', str(tmp_path / 'poses.csv'),
        '--camera-info', str(tmp_path / 'lens.yaml'), '--object-size', str(SIZE),
        '--squares', f'{BOARD.columns}x{BOARD.rows}', '--mount-frame', 'flange',
        '--out', str(tmp_path / 'out')])
    assert result.exit_code == 0, result.output
    text = (tmp_path / 'out' / 'calibration.yaml').read_text()
    assert_same(transform_in(text, 'base_link', 'object'), BASE_FROM_OBJECT)
    assert_same(transform_in(text, 'flange', 'camera_optical_frame'), MOUNT_FROM_CAMERA)
    assert transform_in(result.output, 'base_link', 'object') is not None
    nodes = yaml.safe_load(text)
    assert nodes['/**/reconstructor']['ros__parameters']['pose_source'] == 'tf'
    assert nodes['/**/view_planner']['ros__parameters']['object_size'] == SIZE


def transform_in(text, parent, child):
    """Return the transform, (4, 4), of the command that publishes it."""
    words, = re.findall(rf'static_transform_publisher (.*) --frame-id {parent} '
                        f'--child-frame-id {child}', text)
    given = dict(re.findall(r'--(\w+) (\S+)', words))
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_quat(
        [float(given[name]) for name in ('qx', 'qy', 'qz', 'qw')]).as_matrix()
    pose[:3, 3] = [float(given[name]) for name in 'xyz']
    return pose
