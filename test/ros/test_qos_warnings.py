"""Who is on a topic with a QoS profile that lets nothing pass: named, counted, and let go."""

from functools import partial

from geometry_msgs.msg import PoseStamped
import pytest
from rclpy.duration import Duration
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import Image, JointState

pytestmark = pytest.mark.ros
LATCHED_QOS = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
PLAIN = QoSProfile(depth=1)
HASTY = QoSProfile(depth=1, deadline=Duration(seconds=0.25))


@pytest.fixture
def start(start_node, box):
    parameters = {'turntable_camera': {'mesh': box}, 'view_planner': {'policy': 'farthest'}}
    return lambda name: start_node(name, **parameters.get(name, {}))


def spoil(bench, kind, topic, profile, listens):
    """Put an endpoint on a topic; return what takes it away."""
    if listens:
        return partial(bench.node.destroy_subscription, bench.node.create_subscription(
            kind, topic, lambda _: None, profile))
    return partial(bench.node.destroy_publisher,
                   bench.node.create_publisher(kind, topic, profile))


@pytest.mark.parametrize(('name', 'kind', 'topic', 'profile', 'listens', 'theirs', 'ours'), [
    ('turntable_camera', Image, 'camera/image_raw', LATCHED_QOS, True,
     'requests (reliable, transient local)', '(reliable, volatile)'),
    pytest.param('turntable_camera', PoseStamped, 'camera/pose', HASTY, True,
                 'requests (reliable, volatile, deadline 0.25 s)', '(reliable, volatile)',
                 marks=pytest.mark.slow),
    ('view_planner', PoseStamped, 'view', PLAIN, False,
     'offers (reliable, volatile)', '(reliable, transient local)'),
])
def test_an_endpoint_that_does_not_fit_is_named_with_both_profiles_while_it_is_there(
        start, bench, name, kind, topic, profile, listens, theirs, ours):
    node = start(name)
    take_away = spoil(bench, kind, topic, profile, listens)

    def told():
        """Return what is said of QoS; a node that is alone misses its inputs, too."""
        return next((part for part in bench.state(name).problem.split('; ')
                     if part.startswith((f'/{topic}: incompatible QoS: expected subscribers',
                                         f'/{topic}: incompatible QoS: expected publishers'))), '')

    said = bench.until(told, 'the warning')
    assert f'/bench {theirs}' in said
    assert ours in said.partition('but')[0]
    assert bench.counts(name)[f'warned/qos/{topic}'] == 1
    line, = node.log('WARN.*incompatible QoS: expected (subscribers|publishers) to')
    assert said in line
    take_away()
    bench.until(lambda: not told(), 'the warning to be taken back')
    bench.until(lambda: node.log('over: .*expected (subscribers|publishers) to'),
                'the end of the mismatch in the log')


def test_a_best_effort_publisher_and_a_late_listener_fit(start, bench):
    node = start('turntable_camera')
    best_effort = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
    goals = bench.advertise(JointState, 'next_azimuth', best_effort)
    images = bench.subscribe(Image, 'camera/image_raw', best_effort)

    def heard():
        goals.publish(JointState(position=[1.0]))
        return images and bench.counts('turntable_camera').get('goals')

    bench.until(heard, 'an image, and a goal to be heard')
    assert not node.log('WARN')
