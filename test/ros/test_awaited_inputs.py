"""An input that has never had a message is warned of, with what could be heard instead."""

from active_recon.nodes.runtime import awaited_inputs
from active_recon.nodes.runtime.diagnostics import Diagnostics
from geometry_msgs.msg import PoseStamped
import pytest
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, JointState

from .conftest import ANY_WEIGHTS, FakeCamera, FakeReconstructor, STREAM_QOS

pytestmark = pytest.mark.ros
BEST_EFFORT = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)


@pytest.fixture
def said(bench):
    """Return what waits for a node to warn of an input, and returns the words."""
    def words(node, name, *expected):
        def found():
            problem = bench.state(node).problem
            return problem if all(part in problem for part in (name, *expected)) else ''

        problem = bench.until(found, f'{expected} in the problem of {node}')
        assert bench.counts(node)[f'warned/never_heard/{name}'] == 1
        return problem

    return words


def test_inputs_that_nobody_publishes_are_told_with_the_topics_that_would_fit(
        start_node, bench, said):
    for kind, topic in ((Image, 'usb_cam/image_raw'), (CompressedImage, 'front/color/compressed'),
                        (CompressedImage, 'thermal')):
        bench.node.create_publisher(kind, topic, STREAM_QOS)
    reconstructor = start_node('reconstructor', weights=ANY_WEIGHTS)
    problem = said(
        'reconstructor', 'camera/image_raw', '/usb_cam/image_raw has', '/thermal has', '/front')
    assert ('/camera/image_raw or /camera/image_raw/compressed: no messages: expected some, '
            'none has arrived; nothing publishes there') in problem
    for topic, name, other in (
            ('/usb_cam/image_raw', 'camera/image_raw', '/usb_cam/image_raw'),
            ('/front/color/compressed', 'camera/image_raw', '/front/color'),
            ('/thermal', 'camera/image_raw/compressed', '/thermal')):
        assert f'{topic} has a publisher: remap with -r {name}:={other}' in problem
    assert '/latent has' not in problem  # its own
    for name in ('camera/camera_info', 'camera/pose'):
        assert f'/{name}: no messages: expected' in said('reconstructor', name)
    assert len(reconstructor.log('WARN.*none has arrived')) == 3


def test_what_the_loop_itself_publishes_is_proposed_as_no_input(start_node, bench, said):
    for topic in ('next_azimuth', 'table/joints'):
        bench.node.create_publisher(JointState, topic, STREAM_QOS)
    start_node('reconstructor', weights=ANY_WEIGHTS, pose_source='turntable_joint',
               camera_position='[1.0, 0.0, 0.0]',
               camera_orientation='[-0.5, -0.5, 0.5, 0.5]', turntable_direction=1)
    problem = said('reconstructor', 'turntable/joint_states',
                   'remap with -r turntable/joint_states:=/table/joints')
    assert '/next_azimuth' not in problem


def test_a_publisher_that_is_silent_or_of_another_type_is_named_with_its_qos(
        start_node, bench, said):
    start_node('reconstructor', weights=ANY_WEIGHTS)
    bench.node.create_publisher(Image, 'camera/image_raw', BEST_EFFORT)
    bench.node.create_publisher(Image, 'camera/camera_info', STREAM_QOS)
    said('reconstructor', 'camera/image_raw',
         '/bench publishes there (best effort, volatile) and has published nothing yet',
         '/bench publishes there (reliable, volatile) and publishes sensor_msgs/msg/Image instead '
         'of sensor_msgs/msg/CameraInfo')


def test_a_publisher_whose_name_does_not_come_is_told_to_be_out_of_reach(
        bench, said, monkeypatch):
    # As with nodes of another user, or in a container with a /dev/shm of its own
    monkeypatch.setattr(awaited_inputs, 'endpoint_node', lambda _endpoint: None)
    bench.node.create_publisher(PoseStamped, 'camera/pose', STREAM_QOS)
    inputs = awaited_inputs.AwaitedInputs(bench.node, Diagnostics(bench.node))
    inputs.expect('camera/pose', {PoseStamped: ''})
    problem = said('bench', 'camera/pose', 'a node publishes there (reliable, volatile) of which '
                   'nothing gets here, not even its name: run all nodes of a machine as one user')
    assert 'has published nothing yet' not in problem


def test_the_first_message_takes_its_warning_back_for_good_also_where_it_is_refused(
        start_node, bench, said):
    reconstructor = start_node('reconstructor', weights=ANY_WEIGHTS, take_views='all')
    images = bench.advertise(CompressedImage, 'camera/image_raw/compressed')
    infos = bench.advertise(CameraInfo, 'camera/camera_info')
    said('reconstructor', 'camera/pose', '/camera/camera_info: no messages',
         '/camera/image_raw or ')

    def is_over(words):
        images.publish(CompressedImage(format='png'))
        return words not in bench.state('reconstructor').problem

    bench.until(lambda: is_over('/camera/image_raw or '), 'no warning of the images')
    assert '/camera/camera_info: no messages' in bench.state('reconstructor').problem
    bench.until(lambda: infos.publish(CameraInfo()) or is_over('/camera/camera_info: no messages'),
                'no warning of the camera info')
    assert '/camera/pose: no messages' in bench.state('reconstructor').problem
    FakeCamera(bench).show()
    bench.until(lambda: 'none has arrived' not in bench.state('reconstructor').problem,
                'the end of the warnings')
    bench.until(lambda: len(reconstructor.log('INFO.*over: .*none has arrived')) == 3, 'their end')


def test_a_planner_without_a_reconstructor_says_so(start_node, bench, said):
    start_node('view_planner', policy='farthest')
    said('view_planner', 'episode', '/episode: no messages: expected some, none has arrived')
    assert '/camera/pose: no messages: expected' in said('view_planner', 'camera/pose')
    FakeReconstructor(bench).begin('first')
    bench.until(lambda: '/episode' not in bench.state('view_planner').problem, 'no warning')


def test_a_planner_that_is_told_where_to_start_awaits_no_camera(start_node, bench, said):
    start_node('view_planner', policy='farthest', start_azimuth=1.0)
    problem = said('view_planner', 'episode', '/episode: no messages: expected some')
    assert '/camera/pose' not in problem
