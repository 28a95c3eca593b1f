"""What the reconstructor and the turntable refuse, over real DDS: said, counted, and survived."""

from array import array
import math
import re

from geometry_msgs.msg import PoseStamped
from msg_tools.stamps import nanoseconds_from_stamp
import numpy as np
import pytest
from sensor_msgs.msg import JointState

from .conftest import ANY_WEIGHTS, FakeCamera

pytestmark = pytest.mark.ros


@pytest.fixture(scope='module')
def reconstructor(start_shared_node):
    return start_shared_node('reconstructor', weights=ANY_WEIGHTS, take_views='all')


@pytest.fixture(scope='module')
def listening_camera(shared_bench, reconstructor):
    return FakeCamera(shared_bench)


@pytest.fixture
def camera(shared_bench, listening_camera):
    assert shared_bench.call('start_episode').success
    listening_camera.show()
    return listening_camera


def image_of_no_size(camera):
    image, info, pose = camera.messages()
    image.height = image.width = 0
    camera.send(image, info, pose)


def image_of_unknown_encoding(camera):
    image, info, pose = camera.messages()
    image.encoding = 'yuv9'
    camera.send(image, info, pose)


def image_of_too_few_bytes(camera):
    image, info, pose = camera.messages()
    image.data = image.data[:1000]
    camera.send(image, info, pose)


def image_of_nan(camera):
    image, info, pose = camera.messages()
    pixels = np.full((137, 137, 3), np.nan, np.float32)
    image.encoding, image.step, image.data = '32FC3', 12 * 137, array('B', pixels.tobytes())
    camera.send(image, info, pose)


def image_with_no_pose(camera):
    image, info, _ = camera.messages()
    camera.send(image, info)


def image_with_no_camera_info(camera):
    image, _, pose = camera.messages()
    camera.send(image, pose=pose)


def pose_in_another_frame(camera):
    _, _, pose = camera.messages()
    pose.header.frame_id = 'map'
    camera.send(pose=pose)


def pose_with_a_zero_quaternion(camera):
    _, _, pose = camera.messages()
    turn = pose.pose.orientation
    turn.x = turn.y = turn.z = turn.w = 0.0
    camera.send(pose=pose)


def pose_of_nan(camera):
    _, _, pose = camera.messages()
    pose.pose.position.x = math.nan
    camera.send(pose=pose)


def camera_info_of_another_size(camera):
    image, info, pose = camera.messages()
    info.width, info.height = 640, 480
    camera.send(image, info, pose)


def image_that_arrives_twice(camera):
    camera.send(camera.messages(camera.show())[0])


def image_older_than_the_last(camera):
    camera.send(camera.messages(camera.show() - 1)[0])


def image_of_the_last_episode(camera):
    camera.send(*camera.messages(10**9))


def image_without_a_stamp(camera):
    camera.send(*camera.messages(0))


@pytest.mark.parametrize(('spoil', 'kind', 'said'), [
    (image_of_no_size, 'image_size', 'width and a height above 0, got 0 x 0'),
    (image_of_unknown_encoding, 'encoding', "expected one of rgb8.*, got 'yuv9'"),
    (image_of_too_few_bytes, 'image_bytes', 'expected 56307 bytes.*, got 1000'),
    (image_of_nan, 'image_values', r'out of range: expected 32FC3 in \[0, 1\], got nan'),
    (image_with_no_pose, 'no_pose', 'no pose for the image .*the nearest is'),
    (image_with_no_camera_info, 'no_camera_info', "camera info of the image's stamp.*the last is"),
    (pose_in_another_frame, 'frame', "frame .*expected 'object', got 'map'; .*by object_frame"),
    (pose_with_a_zero_quaternion, 'quaternion', r'expected a unit quaternion.*got \[0.0'),
    (pose_of_nan, 'pose', r'camera pose not finite: got position \[nan'),
    (camera_info_of_another_size, 'camera_info', 'camera info: expected 137 x 137, got 640 x 480'),
    (image_that_arrives_twice, 'duplicate', 'duplicate image: got that of'),
    (image_older_than_the_last, 'out_of_order', 'expected increasing stamps, got .* after'),
    (image_of_the_last_episode, 'last_episode', 'image of another episode: expected one of this '
                                                'episode.*got one of 1.000 s; for a record'),
    (image_without_a_stamp, 'no_stamp', 'image without a stamp: .*got 0; let its publisher fill'),
], ids=lambda value: value.__name__ if callable(value) else '')
def test_bad_input_is_said_once_counted_and_survived(
        reconstructor, shared_bench, camera, spoil, kind, said):
    # Images of noise are unusual views as well: that is said too, at any time
    complaints = 'refused: |ERROR|Traceback'
    said_before = len(reconstructor.log(complaints))
    spoil(camera)
    shared_bench.until(
        lambda: shared_bench.counts('reconstructor').get(f'refused/{kind}') == 1,
        f'refused/{kind} to be counted once')
    line, = reconstructor.log(complaints)[said_before:]
    assert re.search(f'refused: .*{said}', line)
    camera.show()


def test_what_is_late_of_the_last_episode_never_reaches_the_new_one(
        shared_bench, reconstructor, camera):
    late = shared_bench.now()
    assert shared_bench.call('start_episode').success
    refused = shared_bench.counts('reconstructor').get('refused/last_episode', 0)
    messages = camera.messages(late)

    def was_refused():
        camera.send(*messages)
        return shared_bench.counts('reconstructor').get('refused/last_episode', 0) > refused

    shared_bench.until(was_refused, 'the refusal of the late image')
    assert 'on its way when that began' in shared_bench.state('reconstructor').problem
    taken = camera.show()
    shared_bench.until(
        lambda: shared_bench.state('reconstructor').facts.get('Views of the episode') == '1',
        'one view in the new episode')
    assert late not in [nanoseconds_from_stamp(msg.header.stamp) for msg in camera.occupancy]
    assert taken > late


@pytest.fixture
def turntable(start_node, box):
    return start_node('turntable_camera', mesh=box, time_scale=100.0)


@pytest.fixture
def ask(bench, turntable):
    """Return what asks the turntable for an azimuth; it is known to listen."""
    goals = bench.advertise(JointState, 'next_azimuth')

    def heard():
        goals.publish(JointState(position=[0.0]))
        return bench.counts('turntable_camera').get('goals')

    bench.until(heard, 'the turntable to hear a goal')
    return lambda *azimuths: goals.publish(JointState(position=azimuths))


def test_a_stream_of_bad_input_is_no_stream_of_lines(bench, turntable, ask):
    for _ in range(50):
        ask(1.0, 2.0)
        bench.until(lambda: True, 'one turn of the executor')
    bench.until(lambda: bench.counts('turntable_camera').get('refused/goal', 0) >= 5,
                'the goals to be refused')
    assert len(turntable.log('refused')) == 1


def test_goals_that_are_not_finite_are_told_each_said_once_counted_and_survived(
        bench, turntable, ask):
    poses = bench.subscribe(PoseStamped, 'camera/pose')
    for count, azimuth in enumerate((math.nan, math.inf, -math.inf), 1):
        ask(azimuth)
        bench.until(lambda count=count: bench.counts('turntable_camera').get(
            'refused/goal') == count, 'the goal to be refused')
        told = bench.state('turntable_camera').problem
        assert f'azimuth goal not finite: expected radians, got {azimuth}' in told
    line, = turntable.log('WARN|ERROR|Traceback')
    assert 'azimuth goal not finite: expected radians, got nan' in line
    ask(math.pi)
    bench.until(lambda: poses and poses[-1].pose.position.x < -1, 'the camera on the other side')
