"""Where the camera's poses come from: tf2 and a turntable's joint say what the topic would."""

import sys
from types import SimpleNamespace

from active_recon.cameras import orbit_camera
from active_recon.errors import ConfigError
from active_recon.nodes.pose_sources import TfPoses
from geometry_msgs.msg import PoseStamped, Transform, TransformStamped, Vector3
from msg_tools.cameras import pose_from_msg, pose_to_msg
from msg_tools.stamps import stamp_from_nanoseconds
import numpy as np
import pytest
from std_msgs.msg import Header

pytestmark = pytest.mark.ros
POSE = orbit_camera(1.2).pose


class TransformException(Exception):
    """What tf2 raises on a transform that it cannot tell."""


class FakeBuffer:
    """Knows the camera's transform at the stamps of `known`, nanoseconds."""

    known = set()

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
        TransformListener=lambda buffer, node: SimpleNamespace(unregister=lambda: None)))
    return FakeBuffer


@pytest.fixture
def tf_poses(bench, fake_tf):
    """Return the source, what it handed on, and what it refused."""
    taken, refused = [], []
    source = TfPoses(bench.node, taken.append, SimpleNamespace(refuse=refused.append), 'object')
    yield source, taken, refused
    source.close()


def image_header(stamp, frame='camera'):
    return Header(stamp=stamp_from_nanoseconds(stamp), frame_id=frame)


def test_the_pose_of_an_image_is_what_tf_says_at_its_stamp(bench, tf_poses, fake_tf):
    source, taken, refused = tf_poses
    heard = bench.hear(PoseStamped, 'camera/pose')
    bench.until(lambda: bench.node.count_publishers('camera/pose'), 'a publisher of poses')
    fake_tf.known.add(5)
    source.image_came(image_header(5))
    pose, = taken
    assert pose.header == Header(stamp=stamp_from_nanoseconds(5), frame_id='object')
    np.testing.assert_allclose(pose_from_msg(pose), POSE, atol=1e-12)

    def told_again():
        source.image_came(image_header(5))
        return heard

    assert bench.until(told_again, 'the pose on camera/pose')[0] == pose
    assert not refused


def test_an_image_waits_for_a_transform_that_comes_after_it(bench, tf_poses, fake_tf):
    source, taken, refused = tf_poses
    source.image_came(image_header(5))
    assert not taken
    fake_tf.known.add(5)
    bench.until(lambda: taken, 'the pose')
    assert not refused


def test_an_image_whose_transform_does_not_come_is_refused_once_with_tf_s_reason(
        bench, tf_poses, fake_tf):
    source, taken, refused = tf_poses
    source.image_came(image_header(5))
    error, = bench.until(lambda: refused, 'a refusal')
    assert error.kind == 'tf'
    assert "the image's frame 'camera' in 'object' at its stamp: nothing known at 5" in str(error)
    fake_tf.known.add(6)
    source.image_came(image_header(6))
    assert len(taken) == len(refused) == 1


def test_where_tf2_is_missing_it_is_said_what_to_do(bench, monkeypatch):
    monkeypatch.setitem(sys.modules, 'tf2_ros', None)
    with pytest.raises(ConfigError, match='pose_source: expected tf2_ros.*ros-jazzy-tf2-ros-py'):
        TfPoses(bench.node, print, None, 'object')
