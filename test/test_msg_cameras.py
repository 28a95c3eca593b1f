"""Cameras and goals between ROS and numpy."""

import math

from active_recon.errors import MessageError
from active_recon.geometry.cameras import (
    AZIMUTHS,
    Camera,
    CANONICAL_INTRINSICS,
    Intrinsics,
    orbit_camera,
)
from active_recon.geometry.lenses import Distortion
from geometry_msgs.msg import PoseStamped
from msg_tools.cameras import (
    camera_from_msgs,
    camera_to_msgs,
    intrinsics_from_msg,
    intrinsics_to_msg,
    pose_from_msg,
    pose_through_msg,
    poses_from_msg,
    poses_to_msg,
)
from msg_tools.goals import (
    azimuth_goal_from_msg,
    azimuth_goal_to_msg,
    joint_position_from_msg,
    scores_from_msg,
    scores_to_msg,
    view_goal_from_msg,
    view_goal_to_msg,
)
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from sensor_msgs.msg import CameraInfo, JointState, RegionOfInterest
from std_msgs.msg import Header

OBJECT = Header(frame_id='object')


@pytest.mark.parametrize('azimuth', np.linspace(0, 6.2, 9))
@pytest.mark.parametrize('elevation', [-1.2, 0.0, 0.5])
def test_a_camera_comes_back_as_it_was(azimuth, elevation):
    camera = orbit_camera(azimuth, elevation, 0.7, Intrinsics(500, 510, 321, 239, 640, 480))
    info, pose = camera_to_msgs(camera, Header(frame_id='lens'))
    assert (info.header.frame_id, pose.header.frame_id) == ('lens', 'object')
    back = camera_from_msgs(info, pose)
    np.testing.assert_allclose(back.pose, camera.pose, atol=1e-12)
    assert back.intrinsics == camera.intrinsics


def test_ros_counts_pixels_from_the_first_ones_centre():
    info, _ = camera_to_msgs(orbit_camera(0.0), Header())
    assert info.k[2] == CANONICAL_INTRINSICS.cx - 0.5
    assert list(info.p[:3]) == list(info.k[:3])


LENSES = {
    'pinhole': None,
    'plumb_bob': Distortion('plumb_bob', (-0.28, 0.07, 0.001, -0.002, 0.01)),
    'four coefficients': Distortion('plumb_bob', (-0.28, 0.07, 0.001, -0.002)),
    'rational_polynomial': Distortion('rational_polynomial', tuple(np.linspace(-0.3, 0.4, 8))),
    'equidistant': Distortion('equidistant', (0.05, -0.02, 0.01, -0.004))}


@pytest.mark.parametrize('distortion', LENSES.values(), ids=LENSES)
def test_a_lens_comes_back_exactly_in_both_directions(distortion):
    lens = Intrinsics(500.25, 510.1, 321.3, 239.9, 640, 480, distortion)
    info = intrinsics_to_msg(lens, OBJECT)
    assert intrinsics_from_msg(info) == lens
    assert intrinsics_to_msg(intrinsics_from_msg(info), OBJECT) == info


@pytest.mark.parametrize('model', ['', 'plumb_bob', 'rational_polynomial', 'equidistant'])
@pytest.mark.parametrize('count', [0, 4, 5, 8])
def test_coefficients_that_are_all_zero_are_a_pinhole(model, count):
    info = intrinsics_to_msg(CANONICAL_INTRINSICS, OBJECT)
    info.distortion_model, info.d = model, [0.0] * count
    assert intrinsics_from_msg(info) == CANONICAL_INTRINSICS


@pytest.mark.parametrize('name', LENSES)
def test_zeros_after_the_coefficients_of_a_model_change_nothing(name):
    lens = Intrinsics(500, 510, 320, 240, 640, 480, LENSES[name])
    info = intrinsics_to_msg(lens, OBJECT)
    info.d = [*info.d, *[0.0] * (14 - len(info.d))]
    points = [[0.3, -0.2, 0.1], [-0.4, 0.1, 0.3]]
    shown, same = (Camera(orbit_camera(0.5).pose, each).project(points)[0]
                   for each in (intrinsics_from_msg(info), lens))
    np.testing.assert_array_equal(shown, same)


@pytest.mark.parametrize(('model', 'coefficients', 'said'), [
    ('', [0.1] * 5, "model: expected one of plumb_bob.*got ''"),
    ('fov', [0.0] * 5, "model: expected one of plumb_bob.*got 'fov'"),
    ('plumb_bob', [0.1], 'coefficients: expected 4 or 5 of plumb_bob, got 1'),
    ('plumb_bob', [0.1] * 14, 'coefficients: expected 4 or 5 of plumb_bob, got 14'),
    ('equidistant', [math.nan] * 4, 'coefficients: expected finite')])
def test_a_distortion_of_no_known_lens_is_refused(model, coefficients, said):
    info = intrinsics_to_msg(CANONICAL_INTRINSICS, OBJECT)
    info.distortion_model, info.d = model, coefficients
    with pytest.raises(MessageError, match=said) as caught:
        intrinsics_from_msg(info)
    assert caught.value.kind == 'camera_info'


def cropped(roi, binning=(0, 0)):
    info = intrinsics_to_msg(Intrinsics(500, 510, 320, 250, 640, 480), OBJECT)
    info.roi, (info.binning_x, info.binning_y) = roi, binning
    return info


@pytest.mark.parametrize('distortion', [None, LENSES['plumb_bob']], ids=['straight', 'bent'])
def test_a_region_and_binning_show_every_point_where_the_image_has_it(distortion):
    info = cropped(RegionOfInterest(x_offset=100, y_offset=60, width=400, height=300), (2, 3))
    info.d = list(distortion.coefficients) if distortion else []
    lens = intrinsics_from_msg(info)
    assert (lens.width, lens.height) == (200, 100)
    points = np.random.default_rng(0).uniform(-0.3, 0.3, (50, 3))
    pose = orbit_camera(0.4).pose
    full = Camera(pose, Intrinsics(500, 510, 320, 250, 640, 480, distortion)).project(points)[0]
    found = Camera(pose, lens).project(points)[0]
    np.testing.assert_allclose(found, (full - [100, 60]) / [2, 3], atol=1e-9)


def test_a_region_that_says_no_size_and_binning_of_0_or_1_are_the_whole_image():
    whole = cropped(RegionOfInterest())
    for binning in ((0, 0), (1, 1), (0, 1)):
        assert intrinsics_from_msg(cropped(RegionOfInterest(), binning)) == (
            intrinsics_from_msg(whole))


@pytest.mark.parametrize(('info', 'said'), [
    (cropped(RegionOfInterest(x_offset=600, width=100, height=10)), 'region.*640 x 480.*100 x 10'),
    (cropped(RegionOfInterest(x_offset=2**32 - 1, y_offset=2**32 - 1)), 'region of interest'),
    (cropped(RegionOfInterest(width=2**32 - 1, height=2**32 - 1)), 'region of interest'),
    (cropped(RegionOfInterest(), (2**32 - 1, 1)), 'binning_x 4294967295')])
def test_a_region_or_binning_that_leaves_no_image_is_refused(info, said):
    with pytest.raises(MessageError, match=said) as caught:
        intrinsics_from_msg(info)
    assert caught.value.kind == 'camera_info'


def test_a_quaternion_of_any_length_is_read():
    _, msg = camera_to_msgs(orbit_camera(1.0), Header())
    turn = msg.pose.orientation
    turn.x, turn.y, turn.z, turn.w = (3 * part for part in (turn.x, turn.y, turn.z, turn.w))
    np.testing.assert_allclose(pose_from_msg(msg), orbit_camera(1.0).pose, atol=1e-12)


def test_poses_come_through_one_message_as_through_one_each():
    poses = [orbit_camera(azimuth).pose for azimuth in (0.0, 1.0, 4.0)]
    header = Header(frame_id='object')
    found = poses_from_msg(poses_to_msg(poses, header))
    np.testing.assert_array_equal(found, [pose_through_msg(each) for each in poses])
    assert poses_from_msg(poses_to_msg([], header)) == []
    with pytest.raises(MessageError, match="expected 'map', got 'object'"):
        poses_from_msg(poses_to_msg([], header), 'map')


def pose(frame='object', x=1.0, w=1.0):
    msg = PoseStamped(header=Header(frame_id=frame))
    msg.pose.position.x, msg.pose.orientation.w = x, w
    return msg


@pytest.mark.parametrize(('msg', 'kind', 'said'), [
    (pose(frame='map'), 'frame', "frame .* expected 'object', got 'map'"),
    (pose(w=0.0), 'quaternion', 'unit quaternion'),
    (pose(w=math.nan), 'pose', 'camera pose not finite'),
    (pose(x=math.inf), 'pose', 'camera pose not finite'),
    (pose(x=1e200), 'pose', 'camera pose not finite'),
    (pose(x=0.0), 'pose', "at the object's centre")])
def test_what_is_no_pose_is_refused_in_plain_words(msg, kind, said):
    with pytest.raises(MessageError, match=said) as caught:
        pose_from_msg(msg)
    assert caught.value.kind == kind


@pytest.mark.parametrize('info', [
    CameraInfo(), CameraInfo(width=4, height=4), CameraInfo(width=4, height=4, k=[math.nan] * 9),
    CameraInfo(width=4, height=4, k=[1e300] * 9)])
def test_camera_info_of_no_calibrated_camera_is_refused(info):
    with pytest.raises(MessageError, match='camera info'):
        intrinsics_from_msg(info)


@pytest.mark.parametrize('azimuth', [0.0, 1.0, 3.5, 6.0])
def test_both_forms_of_a_goal_say_the_same_azimuth(azimuth):
    view = view_goal_to_msg(orbit_camera(azimuth, 0.5), OBJECT)
    assert view_goal_from_msg(view).azimuth == pytest.approx(azimuth)
    assert azimuth_goal_from_msg(azimuth_goal_to_msg(azimuth, OBJECT)) == pytest.approx(azimuth)


@pytest.mark.parametrize('elevation', [-0.8, 0.0, math.pi / 4, 1.5])
def test_a_goal_that_is_written_and_read_back_is_the_same_camera(elevation):
    pose = orbit_camera(4.0, elevation, 0.6).pose.copy()
    pose[:3, :3] = pose[:3, :3] @ Rotation.from_euler('xyz', (0.1, -0.2, 2.0)).as_matrix()
    read = view_goal_from_msg(view_goal_to_msg(Camera(pose), OBJECT))
    np.testing.assert_allclose(read.pose, pose, atol=1e-12)
    np.testing.assert_array_equal(read.position, pose[:3, 3])
    np.testing.assert_array_equal(pose_through_msg(pose), read.pose)


def test_an_azimuth_goal_is_wrapped():
    assert azimuth_goal_from_msg(JointState(position=[-1.0])) == pytest.approx(math.tau - 1)


@pytest.mark.parametrize(('joint', 'names', 'positions', 'said'), [
    ('', ['table', 'arm'], [1.0, 2.0],
     'expected one of a single joint, got 2 of table, arm; name the turntable with joint_name'),
    ('', ['table'], [], 'expected one of a single joint, got 0 of table'),
    ('table', ['arm'], [1.0], 'expected one of table, got 1 of arm'),
    ('table', [], [1.0], 'expected one of table, got 1 of no names')])
def test_a_joint_that_is_not_there_is_told_beside_those_that_are(joint, names, positions, said):
    with pytest.raises(MessageError) as caught:
        joint_position_from_msg(JointState(name=names, position=positions), joint)
    assert str(caught.value) == f'no joint position: {said}'


@pytest.mark.parametrize('positions', [[math.nan], [math.inf], [-math.inf], [], [1.0, 2.0]])
def test_what_is_no_azimuth_goal_is_refused(positions):
    with pytest.raises(MessageError, match='azimuth goal.*got') as caught:
        azimuth_goal_from_msg(JointState(position=positions))
    assert caught.value.kind == 'goal'


def test_scores_come_back_as_they_were_beside_their_cameras():
    scores = np.random.default_rng(0).random(24, np.float32)
    cameras = [orbit_camera(azimuth, 0.5) for azimuth in AZIMUTHS]
    positions, azimuths, back = scores_from_msg(scores_to_msg(cameras, scores, OBJECT))
    np.testing.assert_allclose(azimuths, AZIMUTHS, atol=1e-6)
    np.testing.assert_allclose(positions, [camera.position for camera in cameras], atol=1e-6)
    np.testing.assert_array_equal(back, scores)
