"""Cameras and goals between ROS and numpy."""

import math

from active_recon.cameras import AZIMUTHS, CANONICAL_INTRINSICS, Intrinsics, orbit_camera
from active_recon.errors import MessageError
from geometry_msgs.msg import PoseStamped
from msg_tools.cameras import camera_from_msgs, camera_to_msgs, intrinsics_from_msg, pose_from_msg
from msg_tools.goals import (
    azimuth_goal_from_msg,
    azimuth_goal_to_msg,
    scores_from_msg,
    scores_to_msg,
    view_goal_from_msg,
    view_goal_to_msg,
)
import numpy as np
import pytest
from sensor_msgs.msg import CameraInfo, JointState
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


def test_a_quaternion_of_any_length_is_read():
    _, msg = camera_to_msgs(orbit_camera(1.0), Header())
    turn = msg.pose.orientation
    turn.x, turn.y, turn.z, turn.w = (3 * part for part in (turn.x, turn.y, turn.z, turn.w))
    np.testing.assert_allclose(pose_from_msg(msg), orbit_camera(1.0).pose, atol=1e-12)


def pose(frame='object', x=1.0, w=1.0):
    msg = PoseStamped(header=Header(frame_id=frame))
    msg.pose.position.x, msg.pose.orientation.w = x, w
    return msg


@pytest.mark.parametrize(('msg', 'kind', 'said'), [
    (pose(frame='map'), 'frame', "frame 'object', got 'map'"),
    (pose(w=0.0), 'quaternion', 'unit quaternion'),
    (pose(w=math.nan), 'pose', 'finite camera pose'),
    (pose(x=math.inf), 'pose', 'finite camera pose'),
    (pose(x=1e200), 'pose', 'finite camera pose'),
    (pose(x=0.0), 'pose', 'away from the object')])
def test_what_is_no_pose_is_refused_in_plain_words(msg, kind, said):
    with pytest.raises(MessageError, match=said) as caught:
        pose_from_msg(msg)
    assert caught.value.kind == kind


@pytest.mark.parametrize('info', [
    CameraInfo(), CameraInfo(width=4, height=4), CameraInfo(width=4, height=4, k=[math.nan] * 9),
    CameraInfo(width=4, height=4, k=[1e300] * 9)])
def test_camera_info_of_no_calibrated_camera_is_refused(info):
    with pytest.raises(MessageError, match='expected camera info'):
        intrinsics_from_msg(info)


@pytest.mark.parametrize('azimuth', [0.0, 1.0, 3.5, 6.0])
def test_both_forms_of_a_goal_say_the_same_azimuth(azimuth):
    view = view_goal_to_msg(azimuth, 0.5, 2.1, OBJECT)
    assert view_goal_from_msg(view) == pytest.approx(azimuth)
    assert azimuth_goal_from_msg(azimuth_goal_to_msg(azimuth, OBJECT)) == pytest.approx(azimuth)


def test_an_azimuth_goal_is_wrapped():
    assert azimuth_goal_from_msg(JointState(position=[-1.0])) == pytest.approx(math.tau - 1)


@pytest.mark.parametrize('positions', [[math.nan], [math.inf], [-math.inf], [], [1.0, 2.0]])
def test_what_is_no_azimuth_goal_is_refused(positions):
    with pytest.raises(MessageError, match='expected an azimuth goal.*got') as caught:
        azimuth_goal_from_msg(JointState(position=positions))
    assert caught.value.kind == 'goal'


def test_scores_come_back_as_they_were_beside_their_cameras():
    scores = np.random.default_rng(0).random(24, np.float32)
    msg = scores_to_msg(AZIMUTHS, scores, 0.5, 2.1, OBJECT)
    azimuths, back = scores_from_msg(msg)
    np.testing.assert_allclose(azimuths, AZIMUTHS, atol=1e-6)
    np.testing.assert_array_equal(back, scores)
