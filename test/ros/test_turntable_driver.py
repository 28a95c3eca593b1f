"""The example driver of a turntable: it turns to the goals, and the loop goes round with it."""

import math
from pathlib import Path

from active_recon.geometry.cameras import azimuth_difference, CANONICAL_INTRINSICS, orbit_camera
from active_recon.geometry.turntable_pose import FixedCamera
from geometry_msgs.msg import PoseStamped
from msg_tools.cameras import intrinsics_to_msg, pose_from_msg
from msg_tools.goals import azimuth_goal_from_msg, azimuth_goal_to_msg, view_goal_from_msg
from msg_tools.images import image_to_msg
from msg_tools.stamps import nanoseconds_from_stamp, stamp_from_nanoseconds
import numpy as np
import pytest
from rclpy.qos import DurabilityPolicy, QoSProfile
from scipy.spatial.transform import Rotation
from sensor_msgs.msg import CameraInfo, Image, JointState
from std_msgs.msg import Header

from .conftest import ANY_WEIGHTS, BUDGET_S, STREAM_QOS

pytestmark = pytest.mark.ros
DRIVER = str(Path(__file__).parents[2] / 'examples' / 'turntable_driver.py')
AT_ZERO = 0.4  # the camera's azimuth
DIRECTION = -1
POSE_AT_ZERO = orbit_camera(AT_ZERO).pose
VIEWS = 2
KEPT = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
IMAGE = np.random.default_rng(0).integers(0, 256, (137, 137, 3), np.uint8)


def start(start_node):
    return start_node('turntable_driver', program=(DRIVER,), camera_azimuth_at_zero=AT_ZERO,
                      turntable_direction=DIRECTION)


@pytest.fixture(scope='module')
def driver(start_shared_node):
    return start(start_shared_node)


def test_a_direction_that_is_none_is_refused_in_one_line(start_node):
    node = start_node('turntable_driver', ready=False, program=(DRIVER,), turntable_direction=5)
    assert node.wait() == 1
    assert node.log() == ['turntable_direction: expected 1 or -1, got 5']


def test_whole_numbers_are_taken_for_the_driver_s_parameters(start_node):
    start_node('turntable_driver', program=(DRIVER,), camera_azimuth_at_zero=1,
               turntable_direction=-1.0)


@pytest.fixture
def joints(bench, driver):
    """Return the angles of the table as they are told."""
    return bench.subscribe(JointState, 'turntable/joint_states')


class Goals:
    """Goals in the bench's hand; each is sent until the table stands where it asks."""

    def __init__(self, bench, joints):
        self._bench = bench
        self._joints = joints
        self._publisher = bench.advertise(JointState, 'next_azimuth')

    def send(self, azimuth):
        header = Header(stamp=stamp_from_nanoseconds(self._bench.now()))
        msg = azimuth_goal_to_msg(azimuth, header)
        self._publisher.publish(msg)
        return msg

    def reach(self, azimuth):
        """Return the angle at which the table then stands."""
        msg = self.send(azimuth)

        def arrived():
            self._publisher.publish(msg)
            camera = FixedCamera(POSE_AT_ZERO, DIRECTION)
            return self._joints and abs(azimuth_difference(camera_azimuth(
                camera.pose_at(self._joints[-1].position[0])), azimuth)) < 1e-3

        self._bench.until(arrived, f'the table at the camera azimuth {azimuth}')
        return self._joints[-1].position[0]


def camera_azimuth(pose):
    return math.atan2(pose[1, 3], pose[0, 3])


def test_the_table_turns_until_the_camera_is_at_the_goal_the_short_way(bench, joints):
    goals = Goals(bench, joints)
    angles = [goals.reach(AT_ZERO + azimuth) for azimuth in (0.0, 0.5, -0.5)]
    np.testing.assert_allclose(np.diff(angles), [0.5, -1.0], atol=2e-3)
    turned = [msg.position[0] for msg in joints]
    assert max(np.abs(np.diff(turned))) < 2.0  # it turns, and does not jump


def test_a_goal_that_is_none_is_said_and_the_driver_goes_on(bench, driver, joints):
    goals = Goals(bench, joints)

    def said():
        goals.send(math.nan)
        return driver.log('expected one finite azimuth')

    bench.until(said, 'the refusal')
    goals.reach(AT_ZERO + 0.3)


def test_the_loop_goes_round_with_the_driver_and_a_camera_that_only_streams(
        bench, joints, start_node):
    views, done, asked = (bench.subscribe(kind, topic, KEPT) for kind, topic in (
        (PoseStamped, 'view'), (Header, 'done'), (JointState, 'next_azimuth')))
    start_node('reconstructor', weights=ANY_WEIGHTS, take_views='at_goal',
               pose_source='turntable_joint', turntable_direction=DIRECTION,
               camera_position=POSE_AT_ZERO[:3, 3].tolist(),
               camera_orientation=Rotation.from_matrix(POSE_AT_ZERO[:3, :3]).as_quat().tolist())
    start_node('view_planner', policy='farthest', max_views=VIEWS, entropy_tolerance=0.0)
    image, info = (bench.node.create_publisher(kind, f'camera/{topic}', STREAM_QOS)
                   for kind, topic in ((Image, 'image_raw'), (CameraInfo, 'camera_info')))

    def show():
        header = Header(stamp=bench.node.get_clock().now().to_msg(), frame_id='camera')
        info.publish(intrinsics_to_msg(CANONICAL_INTRINSICS, header))
        image.publish(image_to_msg(IMAGE, header))

    stream = bench.node.create_timer(0.1, show)
    end = bench.until(lambda: next((msg for msg in done if msg.frame_id), None),
                      'the end of the episode', 2 * BUDGET_S)
    bench.node.destroy_timer(stream)
    assert end.frame_id == 'max_views'
    bench.until(lambda: len(views) == VIEWS, 'the last view')
    goals = {nanoseconds_from_stamp(msg.header.stamp): azimuth_goal_from_msg(msg) for msg in asked}
    assert len(goals) == VIEWS
    for (_, goal), view in zip(sorted(goals.items()), views, strict=True):
        assert abs(azimuth_difference(view_goal_from_msg(view).azimuth, goal)) <= 0.14
    # What a view says is where the table stood at its stamp
    stamps = [nanoseconds_from_stamp(msg.header.stamp) for msg in joints]
    for view in views:
        at = nanoseconds_from_stamp(view.header.stamp)
        angle = np.interp(at, stamps, [msg.position[0] for msg in joints])
        np.testing.assert_allclose(
            pose_from_msg(view), FixedCamera(POSE_AT_ZERO, DIRECTION).pose_at(angle), atol=0.01)


def test_a_driver_that_is_asked_to_stop_ends_without_complaint(start_node):
    driver = start(start_node)
    assert driver.stop() == 0
    assert not driver.log('Traceback|ERROR')
