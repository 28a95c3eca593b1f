"""Where the camera's poses come from: tf2 and a turntable's joint say what the topic would."""

from contextlib import nullcontext
import sys
from types import SimpleNamespace

from active_recon.errors import ConfigError, MessageError
from active_recon.geometry.cameras import CANONICAL_INTRINSICS, orbit_camera
from active_recon.geometry.turntable_pose import FixedCamera
from active_recon.nodes.camera.pose_sources import check_pose_source, TfPoses, TurntablePoses
from active_recon.parameters.reconstructor import ReconstructorParameters
from geometry_msgs.msg import PoseStamped, Transform, TransformStamped, Vector3
from msg_tools.cameras import intrinsics_to_msg, pose_from_msg, pose_to_msg
from msg_tools.images import image_to_msg
from msg_tools.stamps import stamp_from_nanoseconds
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from sensor_msgs.msg import CameraInfo, Image, JointState, PointCloud2
from std_msgs.msg import Header

from .conftest import ANY_WEIGHTS, BUDGET_S, LATCHED_QOS, SEND_AGAIN_S
from .test_clock import FakeClock

pytestmark = pytest.mark.ros
POSE = orbit_camera(1.2).pose
ANGLE = 0.7
TURNED = FixedCamera(POSE, -1).pose_at(ANGLE)
IMAGE = np.random.default_rng(0).integers(0, 256, (137, 137, 3), np.uint8)


class TransformException(Exception):
    """What tf2 raises on a transform that it cannot tell."""


class FakeBuffer:
    """Knows the camera's transform at the stamps of `known`, nanoseconds."""

    known = set()

    def clear(self):
        self.known.clear()

    def lookup_transform(self, target, source, time):
        if (target, source) != ('object', 'camera') or time.nanoseconds not in self.known:
            raise TransformException(f'nothing known at {time.nanoseconds}')
        pose = pose_to_msg(POSE, Header()).pose
        return TransformStamped(transform=Transform(
            translation=Vector3(x=pose.position.x, y=pose.position.y, z=pose.position.z),
            rotation=pose.orientation))


@pytest.fixture
def fake_tf(monkeypatch):
    monkeypatch.setattr(FakeBuffer, 'known', set())
    monkeypatch.setitem(sys.modules, 'tf2_ros', SimpleNamespace(
        Buffer=FakeBuffer, TransformException=TransformException,
        TransformListener=lambda buffer, node: None))
    return FakeBuffer


@pytest.fixture
def tf_poses(bench, fake_tf):
    """Return the source, what it handed on, and what it refused."""
    taken, refused = [], []
    source = TfPoses(bench.node, taken.append, SimpleNamespace(reject=refused.append), 'object')
    return source, taken, refused


def image_header(stamp, frame='camera'):
    return Header(stamp=stamp_from_nanoseconds(stamp), frame_id=frame)


def test_the_pose_of_an_image_is_what_tf_says_at_its_stamp(bench, tf_poses, fake_tf):
    source, taken, refused = tf_poses
    heard = bench.subscribe(PoseStamped, 'camera/pose')
    bench.until(lambda: bench.node.count_publishers('camera/pose'), 'a publisher of poses')
    fake_tf.known.add(5)
    source.on_image(image_header(5))
    pose, = taken
    assert pose.header == Header(stamp=stamp_from_nanoseconds(5), frame_id='object')
    np.testing.assert_allclose(pose_from_msg(pose), POSE, atol=1e-12)

    def told_again():
        source.on_image(image_header(5))
        return heard

    assert bench.until(told_again, 'the pose on camera/pose')[0] == pose
    assert not refused


def test_an_image_waits_for_a_transform_that_comes_after_it(bench, tf_poses, fake_tf):
    source, taken, refused = tf_poses
    source.on_image(image_header(5))
    assert not taken
    fake_tf.known.add(5)
    bench.until(lambda: taken, 'the pose')
    assert not refused


def test_an_image_whose_transform_does_not_come_is_refused_once_with_tf_s_reason(
        bench, tf_poses, fake_tf):
    source, taken, refused = tf_poses
    source.on_image(image_header(5))
    error, = bench.until(lambda: refused, 'a refusal')
    assert error.kind == 'tf'
    assert "the image's frame 'camera' in 'object' at its stamp: nothing known at 5" in str(error)
    fake_tf.known.add(6)
    source.on_image(image_header(6))
    assert len(taken) == len(refused) == 1


def test_what_is_forgotten_is_looked_up_anew(bench, tf_poses, fake_tf):
    source, taken, refused = tf_poses
    source.on_image(image_header(4))
    fake_tf.known.add(5)
    source.forget()
    source.on_image(image_header(5))
    assert not fake_tf.known
    error, = bench.until(lambda: refused, 'the refusal of the later one')
    assert 'nothing known at 5' in str(error)
    assert not taken


def test_where_tf2_is_missing_it_is_said_what_to_do(bench, monkeypatch):
    monkeypatch.setitem(sys.modules, 'tf2_ros', None)
    with pytest.raises(ConfigError, match='pose_source: tf2_ros is not installed: '
                                          '.*ros-jazzy-tf2-ros-py'):
        TfPoses(bench.node, print, None, 'object')


class Eye:
    """A camera that shows one image, and something that tells where it stands."""

    def __init__(self, bench, kind, topic):
        self._bench = bench
        self._place = bench.advertise(kind, topic) if topic else None
        self._publishers = [bench.advertise(each, f'camera/{name}') for each, name in (
            (CameraInfo, 'camera_info'), (Image, 'image_raw'))]
        self.cells = bench.subscribe(PointCloud2, 'probabilities', LATCHED_QOS)

    def show(self, place):
        """Show the image until there is a view of it; return the cells of the first."""
        for _ in range(round(BUDGET_S / SEND_AGAIN_S)):
            header = Header(stamp=stamp_from_nanoseconds(self._bench.now()), frame_id='camera')
            if self._place:
                self._place.publish(place(header.stamp))
            for publisher, msg in zip(self._publishers, (
                    intrinsics_to_msg(CANONICAL_INTRINSICS, header), image_to_msg(IMAGE, header)),
                    strict=True):
                publisher.publish(msg)
            if found := self._bench.within(SEND_AGAIN_S, lambda: self.cells):
                return found[0].data
        raise AssertionError('shown in vain')


def start(start_node, **parameters):
    return start_node('reconstructor', take_views='all', weights=ANY_WEIGHTS, **parameters)


def posed(stamp):
    return pose_to_msg(TURNED, Header(stamp=stamp, frame_id='object'))


def test_a_turntable_s_joint_gives_the_occupancy_that_the_poses_give(bench, start_node):
    node = start(start_node)
    expected = Eye(bench, PoseStamped, 'camera/pose').show(posed)
    assert node.stop() == 0
    bench.until(lambda: not bench.node.count_publishers('probabilities'), 'the end of the node')

    start(start_node, pose_source='turntable_joint', joint_name='table', turntable_direction=-1,
          camera_position=POSE[:3, 3].tolist(),
          camera_orientation=Rotation.from_matrix(POSE[:3, :3]).as_quat().tolist())
    poses = bench.subscribe(PoseStamped, 'camera/pose')
    eye = Eye(bench, JointState, 'turntable/joint_states')
    bench.until(lambda: bench.node.count_publishers('camera/pose') == 2, 'a publisher of poses')
    cells = eye.show(lambda stamp: JointState(
        header=Header(stamp=stamp), name=['arm', 'table'], position=[9.0, ANGLE]))
    assert cells == expected
    told = bench.until(lambda: poses and poses[-1], 'a pose')
    np.testing.assert_allclose(pose_from_msg(told), TURNED, atol=1e-9)


def test_a_joint_that_is_not_there_or_nowhere_is_refused_and_said(bench, start_node):
    node = start(start_node, pose_source='turntable_joint', joint_name='table',
                 camera_position=[1.0, 0.0, 1.0], camera_orientation=[0.0, 0.0, 0.0, 1.0])
    joints = bench.advertise(JointState, 'turntable/joint_states')

    def refused(name, position):
        before = bench.counts('reconstructor').get('refused/joint', 0)

        def counted():
            joints.publish(JointState(name=[name], position=[position]))
            return bench.counts('reconstructor').get('refused/joint', 0) > before

        return counted

    bench.until(refused('arm', 1.0), 'the other joint to be refused')
    assert node.log('refused: no joint position: expected one of table, got 1 of arm')
    bench.until(refused('table', float('nan')), 'the position to be refused')


def test_joints_of_another_publisher_are_refused_only_until_the_turntable_s_was_there():
    poses = []
    source = TurntablePoses(
        SimpleNamespace(create_publisher=lambda *_: SimpleNamespace(publish=lambda _: None)),
        poses.append, SimpleNamespace(rejecting=nullcontext),
        SimpleNamespace(subscribe=lambda *_: None), FixedCamera(POSE, -1), 'table', 'object')
    arm = JointState(name=['elbow', 'wrist'], position=[1.0, 2.0])
    with pytest.raises(MessageError, match='no joint position: expected one of table'):
        source._on_joint(arm)
    for msg in (JointState(name=['table'], position=[ANGLE]), arm):
        source._on_joint(msg)
    [told] = poses
    np.testing.assert_allclose(pose_from_msg(told), TURNED, atol=1e-9)


TF = """
class TransformException(Exception):
    pass


class Buffer:
    def lookup_transform(self, target, source, time):
        from geometry_msgs.msg import Quaternion, Transform, TransformStamped, Vector3
        assert (target, source) == ('object', 'camera')
        return TransformStamped(transform=Transform(
            translation=Vector3(x={0}, y={1}, z={2}),
            rotation=Quaternion(x={3}, y={4}, z={5}, w={6})))

    def clear(self):
        print('the transforms are forgotten', flush=True)


class TransformListener:
    def __init__(self, buffer, node):
        pass
"""


@pytest.fixture
def put_tf(tmp_path):
    """Return what puts a module in the place of tf2_ros, for the first node of the test."""
    def put(code):
        (tmp_path / '0').mkdir()
        (tmp_path / '0' / 'tf2_ros.py').write_text(code)
    return put


def test_a_view_is_taken_from_where_tf_says(bench, start_node, put_tf):
    told = posed(stamp_from_nanoseconds(0)).pose
    place, turn = told.position, told.orientation
    put_tf(TF.format(place.x, place.y, place.z, turn.x, turn.y, turn.z, turn.w))
    start(start_node, pose_source='tf')
    views = bench.subscribe(PoseStamped, 'view', LATCHED_QOS)
    Eye(bench, None, '').show(None)
    view = bench.until(lambda: views, 'a view')[0]
    np.testing.assert_allclose(pose_from_msg(view), TURNED, atol=1e-9)


def test_transforms_are_forgotten_where_the_clock_goes_back(bench, start_node, put_tf):
    put_tf(TF.format(0, 0, 1, 0, 0, 0, 1))
    node = start_node('reconstructor', weights=ANY_WEIGHTS, pose_source='tf', use_sim_time=True)
    clock = FakeClock(bench)

    def went_back():
        clock.tell(100.0)
        clock.tell(50.0)
        return node.log('the transforms are forgotten')

    bench.until(went_back, 'the end of the old time')


def test_a_node_that_is_to_ask_a_tf2_that_is_missing_does_not_start(start_node, put_tf):
    put_tf('raise ImportError("no tf2_ros here")')
    node = start_node('reconstructor', ready=False, weights=ANY_WEIGHTS, pose_source='tf')
    assert node.wait() == 1
    line, = node.log()
    assert 'pose_source: tf2_ros is not installed: expected it' in line


@pytest.mark.parametrize(('parameters', 'said'), [
    ({}, 'camera_position: invalid position: expected x, y, z'),
    ({'camera_position': (1.0, 0.0, 1.0), 'camera_orientation': (0.0, 0.0, 0.0, 2.0)},
     'camera_orientation: invalid orientation: expected x, y, z, w'),
])
def test_a_turntable_whose_camera_nobody_placed_is_refused(parameters, said):
    with pytest.raises(ConfigError, match=said):
        check_pose_source(ReconstructorParameters(pose_source='turntable_joint', **parameters))
