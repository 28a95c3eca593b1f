"""A fixed camera beside a turntable is found again from rendered boards whose answer is known."""

from dataclasses import replace
import math

from active_recon.calibration.board import detect_all, Detection
from active_recon.calibration.fit import overall_error
from active_recon.calibration.lens import estimate_lens, project, read_lens, write_lens
from active_recon.calibration.placement import Placement
from active_recon.calibration.remarks import of_angles, of_errors
from active_recon.calibration.turntable import fit_turntable
from active_recon.errors import ConfigError, DataError
from active_recon.geometry.cameras import azimuth_difference, Camera
from active_recon.geometry.lenses import Distortion
from active_recon.geometry.turntable_pose import FixedCamera
import cv2
import numpy as np
import pytest
from recorded_messages import small_disk
from rendered_boards import BOARD, fixed_camera, LENS, on_table, render, WIDE
from scipy.spatial.transform import Rotation

ANGLES = np.radians([0, 25, 70, 130, 200, 260, 310])
SIZE = 0.2
CAMERA = fixed_camera()


def boards(lens, turned, noise=0.0, camera=CAMERA, **lying):
    """Return what is seen of a board on a table turned counter-clockwise."""
    images = [(f'{index}.png', render(lens, np.linalg.inv(camera.pose) @ on_table(angle, **lying),
                                      noise, seed=index)) for index, angle in enumerate(turned)]
    found, missing = detect_all(BOARD, images, len(images))
    assert not missing
    return found


def true_pose(azimuth=0.0, thickness=0.0, camera=CAMERA):
    """Return the camera in the object frame, whose origin is half a cube above the plate."""
    pose = camera.pose.copy()
    pose[2, 3] -= SIZE / 2 - thickness
    turn = np.eye(4)
    turn[:3, :3] = Rotation.from_euler('z', azimuth - Camera(pose).azimuth).as_matrix()
    return turn @ pose


def assert_same_camera(pose, expected, metres=1e-3, degrees=0.2):
    apart = Rotation.from_matrix(pose[:3, :3].T @ expected[:3, :3]).magnitude()
    assert np.linalg.norm(pose[:3, 3] - expected[:3, 3]) < metres
    assert math.degrees(apart) < degrees


@pytest.fixture(scope='module')
def seen():
    return boards(LENS, ANGLES)


@pytest.fixture(scope='module')
def found(seen):
    return fit_turntable(seen, LENS, ANGLES)


def test_the_camera_is_found_within_a_millimetre_and_a_fifth_of_a_degree(found):
    assert_same_camera(Placement(SIZE).on_table(found), true_pose())
    assert overall_error(found.images) < 0.3


def test_it_is_found_through_a_bent_lens_and_noise():
    found = fit_turntable(boards(WIDE, ANGLES, noise=4.0), WIDE, ANGLES)
    assert_same_camera(Placement(SIZE).on_table(found), true_pose())
    assert overall_error(found.images) < 0.5


def test_angles_that_were_not_told_are_found(seen, found):
    estimated = fit_turntable(seen, LENS)
    assert estimated.direction is None
    np.testing.assert_allclose(np.unwrap(estimated.turned), ANGLES, atol=math.radians(0.1))
    assert_same_camera(Placement(SIZE).on_table(estimated), Placement(SIZE).on_table(found))


def test_turning_the_other_way_flips_the_direction_and_nothing_else(seen, found):
    other = fit_turntable(seen, LENS, -ANGLES)
    assert (found.direction, other.direction) == (1, -1)
    np.testing.assert_allclose(Placement(SIZE).on_table(other), Placement(SIZE).on_table(found),
                               atol=1e-6)
    np.testing.assert_allclose(other.turned, found.turned)


def test_the_order_of_the_images_does_not_matter(seen, found):
    order = np.random.default_rng(1).permutation(len(seen))
    other = fit_turntable([seen[index] for index in order], LENS, ANGLES[order])
    assert other.direction == found.direction
    np.testing.assert_allclose(Placement(SIZE).on_table(other), Placement(SIZE).on_table(found),
                               atol=1e-6)


def test_where_the_board_lies_on_the_table_does_not_matter(found):
    other = fit_turntable(boards(LENS, ANGLES, shift=(-0.1, 0.13), yaw=2.0), LENS, ANGLES)
    assert_same_camera(Placement(SIZE).on_table(other), Placement(SIZE).on_table(found))


def test_whatever_angle_is_called_zero_the_camera_is_at_azimuth_zero_there(seen):
    pose = Placement(SIZE).on_table(fit_turntable(seen, LENS, ANGLES + 0.5))
    np.testing.assert_allclose(FixedCamera(pose).pose_at(0.0), pose)
    assert azimuth_difference(Camera(pose).azimuth, 0) == pytest.approx(0, abs=1e-9)
    assert_same_camera(pose, true_pose())


def test_a_point_of_the_turned_object_is_seen_where_the_parameters_say(found):
    """The board itself, carried into the object frame, must be where each image shows it."""
    pose = Placement(SIZE).on_table(found)
    board_at_zero = pose @ found.camera_from_table @ found.table_from_board
    for turned, image in zip(found.turned, found.images, strict=True):
        camera = FixedCamera(pose, found.direction).pose_at(found.direction * turned)
        pixels = project(LENS, image.seen.points, np.linalg.inv(camera) @ board_at_zero)
        np.testing.assert_allclose(pixels, image.fitted, atol=1e-6)


def test_the_front_is_where_it_was_asked_to_be(found):
    pose = Placement(SIZE, azimuth_at_zero=2.0).on_table(found)
    assert Camera(pose).azimuth == pytest.approx(2.0)
    assert_same_camera(pose, true_pose(azimuth=2.0))


def test_a_thick_board_lifts_the_camera_above_the_plate(found):
    pose = Placement(SIZE, board_thickness=0.01).on_table(found)
    assert_same_camera(pose, true_pose(thickness=0.01))


def test_a_board_that_lies_askew_gives_the_same_axis():
    askew = boards(LENS, ANGLES, tilt_deg=12.0)
    pose = Placement(SIZE).on_table(fit_turntable(askew, LENS, ANGLES))
    board = on_table(0.0, tilt_deg=12.0)
    height = board[:3, 3] @ board[:3, 2] / board[2, 2]  # where the axis meets the board
    expected = true_pose()
    expected[2, 3] -= height
    assert_same_camera(pose, expected)


def test_an_image_that_contradicts_its_angle_is_named(seen):
    told = ANGLES.copy()
    told[3] += math.radians(30)
    with pytest.raises(DataError, match=r'3.png: wrong angle: expected the table at 160.0 '
                                        r'degrees') as refusal:
        fit_turntable(seen, LENS, told)
    assert refusal.value.kind == 'angles'


def test_a_table_with_play_is_found_as_well_and_its_play_is_told(seen, found):
    play = np.radians([0.0, 1.5, -1.0, 0.5, -2.0, 1.0, 0.0])  # on average none
    other = fit_turntable(seen, LENS, ANGLES + play)
    np.testing.assert_allclose(Placement(SIZE).on_table(other), Placement(SIZE).on_table(found),
                               atol=1e-6)
    np.testing.assert_allclose(other.off, found.off - play, atol=math.radians(0.05))
    assert of_angles(found) == []
    remark, = of_angles(other)
    assert 'differ from those in the images by up to 2.0 degrees (4.png)' in remark


def test_half_turns_alone_do_not_tell_the_direction(seen):
    turned = np.array([0, math.pi, 0])
    with pytest.raises(DataError, match='direction unknown: .* half turns only') as refusal:
        fit_turntable(boards(LENS, turned), LENS, turned)
    assert refusal.value.kind == 'direction'


def test_a_table_that_hardly_turns_is_refused():
    with pytest.raises(DataError, match='hardly turned'):
        fit_turntable(boards(LENS, np.radians([0, 2, 4])), LENS)


def test_two_images_are_too_few(seen):
    with pytest.raises(DataError, match='3 images .* got 2'):
        fit_turntable(seen[:2], LENS)


def test_a_camera_that_slipped_is_refused(seen):
    elsewhere = boards(LENS, ANGLES[4:], camera=fixed_camera(aside=0.06))
    with pytest.raises(DataError, match='neither the camera nor the board slipped') as refusal:
        fit_turntable([*seen[:4], *elsewhere], LENS, ANGLES)
    assert refusal.value.kind == 'reprojection'


def test_the_lens_of_another_camera_is_among_the_causes_of_a_large_error(seen):
    longer = replace(LENS, fx=1.4 * LENS.fx, fy=1.4 * LENS.fy)
    (remark,) = of_errors(fit_turntable(seen, longer, ANGLES).images)
    assert 'the camera info, if given, that of this camera' in remark
    assert not of_errors(fit_turntable(seen, LENS, ANGLES).images)


@pytest.mark.parametrize('size', [0.0, -1.0, math.nan, math.inf])
def test_a_cube_without_a_size_is_refused(size):
    with pytest.raises(ConfigError, match='object_size: out of range: expected metres above 0'):
        Placement(size)


def test_a_flat_board_on_a_table_tells_the_focal_length_alone(seen):
    estimated = estimate_lens(seen)
    assert not estimated.whole
    assert estimated.lens.fx == pytest.approx(LENS.fx, rel=0.01)
    found = fit_turntable(seen, estimated.lens, ANGLES)
    assert_same_camera(Placement(SIZE).on_table(found), true_pose(), metres=3e-3)


def test_corners_that_no_lens_fits_are_refused():
    rng, refused = np.random.default_rng(0), []
    for _ in range(8):
        anywhere = [Detection(f'{name}.png', BOARD.corners, rng.uniform(
            0, LENS.height, (len(BOARD.corners), 2)), (LENS.width, LENS.height))
            for name in range(3)]
        try:
            estimate_lens(anywhere)
        except DataError as error:
            refused.append(str(error))
    assert refused and all('got corners that no lens fits (3 images)' in each for each in refused)


def test_boards_held_every_way_tell_the_whole_lens():
    rng = np.random.default_rng(2)
    held = []
    for index in range(12):
        pose = np.eye(4)
        pose[:3, :3] = cv2.Rodrigues(rng.uniform(-0.7, 0.7, 3))[0]
        pose[:3, 3] = pose[:3, :3] @ [-0.135, -0.105, 0] + [*rng.uniform(-0.08, 0.08, 2), 0.42]
        held.append((f'{index}', render(WIDE, pose)))
    estimated = estimate_lens(detect_all(BOARD, held, 8)[0])
    assert estimated.whole
    corners = np.random.default_rng(0).uniform([-0.2, -0.15, 0.5], [0.2, 0.15, 0.6], (50, 3))
    np.testing.assert_allclose(project(estimated.lens, corners, np.eye(4)),
                               project(WIDE, corners, np.eye(4)), atol=2.5)


def test_a_lens_comes_back_from_its_file(tmp_path):
    coefficients = tuple(np.arange(8) / 100)
    for lens in (LENS, WIDE, replace(WIDE, distortion=Distortion('rational_polynomial',
                                                                 coefficients))):
        write_lens(lens, tmp_path / 'camera_info.yaml')
        assert read_lens(tmp_path / 'camera_info.yaml') == lens


@pytest.mark.parametrize('model', ['plumb_bob', ''])
def test_an_ideal_lens_may_have_no_coefficients_as_a_camera_info(model, tmp_path):
    path = tmp_path / 'camera_info.yaml'
    write_lens(LENS, path)
    text = path.read_text()
    written = text.replace('cols: 5', 'cols: 0').replace('data: [0.0, 0.0, 0.0, 0.0, 0.0]',
                                                         'data: []')
    assert written != text
    path.write_text(written.replace('plumb_bob', model or "''"))
    assert read_lens(path) == LENS


def test_a_lens_is_written_as_ros_counts_pixels_from_the_first_one_s_centre(tmp_path):
    write_lens(LENS, tmp_path / 'lens.yaml')
    text = (tmp_path / 'lens.yaml').read_text()
    assert 'data: [730.0, 0.0, 319.5, 0.0, 730.0, 239.5, 0.0, 0.0, 1.0]' in text


def test_a_lens_that_finds_no_room_leaves_the_one_that_stood_there(tmp_path):
    path = tmp_path / 'camera_info.yaml'
    write_lens(LENS, path)
    with small_disk(50), pytest.raises(OSError):
        write_lens(WIDE, path)
    assert read_lens(path) == LENS and list(tmp_path.iterdir()) == [path]


def test_a_fisheye_that_is_known_serves_too():
    fisheye = replace(LENS, distortion=Distortion('equidistant', (-0.05, 0.01, 0.0, 0.0)))
    camera = fixed_camera(aside=0.0).object_to_camera
    seen = [Detection(str(index), BOARD.corners, project(
        fisheye, BOARD.corners, camera @ on_table(angle)), (640, 480))
        for index, angle in enumerate(ANGLES)]
    found = fit_turntable(seen, fisheye, ANGLES)
    assert_same_camera(Placement(SIZE).on_table(found),
                       true_pose(camera=fixed_camera(aside=0.0)), 1e-5, 1e-3)


@pytest.mark.parametrize(('old', 'new', 'said'), [
    ('plumb_bob', 'equidistant', 'coefficients: expected 4 of equidistant, got 5'),
    ('camera_matrix', 'matrix', 'no calibration: .* a YAML file of ROS.s camera_calibration'),
    ('[530.0', '[.nan', 'camera not calibrated: expected'),
    ('[530.0', '[0.0', 'camera not calibrated: expected'),
    ('image_width', '{', 'no calibration: .* a YAML file of ROS.s camera_calibration'),
])
def test_a_file_that_is_no_lens_is_refused(tmp_path, old, new, said):
    path = tmp_path / 'lens.yaml'
    write_lens(WIDE, path)
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    with pytest.raises(DataError, match=said):
        read_lens(path)
