"""The life cycle of reconstructor and planner, by the services that `ros2 lifecycle` calls."""

import gc
import re
import signal
import weakref

from active_recon.nodes.reconstructor import ReconstructorNode
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
import pytest
from rclpy.lifecycle import TransitionCallbackReturn
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Header
from std_srvs.srv import Trigger

from .conftest import ANY_WEIGHTS, BUDGET_S, FakeCamera, LATCHED_QOS

pytestmark = pytest.mark.ros
NODES = {'reconstructor': {}, 'view_planner': {'policy': 'farthest'}}
HEARS = {'reconstructor': 'camera/image_raw', 'view_planner': 'latent'}
OFFERS = {'reconstructor': 'occupancy', 'view_planner': 'next_view'}


class Supervisor:
    """What `ros2 lifecycle` does to one node."""

    def __init__(self, bench, node):
        self._bench = bench
        self._node = node
        self._client = bench.node.create_client(ChangeState, f'{node}/change_state')

    def state(self):
        return self._bench.ask(GetState, f'{self._node}/get_state').current_state.label

    def set(self, transition):
        """Return whether the transition of that label or number succeeded."""
        before = self.state()
        self._bench.until(self._client.service_is_ready, 'the service')
        wanted = (Transition(id=transition) if isinstance(transition, int)
                  else Transition(label=transition))
        # Only once: it may take long, and a second request would be refused
        answer = self._client.call_async(ChangeState.Request(transition=wanted))
        if self._bench.within(BUDGET_S, answer.done):
            return answer.result().success
        return self.state() != before  # the answer was lost


def on_topic(bench, count, topic):
    """Return whether anybody but the bench itself is there."""
    return getattr(bench.node, f'count_{count}')(topic) > 0


@pytest.mark.parametrize('name', NODES)
def test_what_a_transition_makes_its_opposite_destroys(start_node, bench, name):
    node = start_node(name, ready=False, autostart=False, **NODES[name])
    supervisor = Supervisor(bench, name)
    hears = lambda: on_topic(bench, 'subscribers', HEARS[name])  # noqa: E731
    offers = lambda: on_topic(bench, 'publishers', OFFERS[name])  # noqa: E731
    assert supervisor.state() == 'unconfigured'
    assert not offers() and not hears()
    for _ in range(2):
        assert supervisor.set('configure')
        bench.until(offers, 'a publisher')
        assert not hears()
        assert supervisor.set('activate')
        bench.until(hears, 'a subscription')
        assert supervisor.state() == 'active'
        assert supervisor.set('deactivate')
        bench.until(lambda: not hears(), 'the end of the subscription')
        assert offers()
        assert supervisor.set('cleanup')
        bench.until(lambda: not offers(), 'the end of the publisher')
    assert supervisor.state() == 'unconfigured'
    assert len(node.log('ready$')) == 2
    assert node.stop(signal.SIGTERM) == 0
    assert not node.log('Traceback|ERROR|FATAL')


@pytest.mark.parametrize('name', NODES)
def test_a_node_that_does_not_activate_itself_is_configured_and_waits_for_it(
        start_node, bench, name):
    node = start_node(name, ready=False, activate_at_start=False, **NODES[name])
    supervisor = Supervisor(bench, name)
    assert supervisor.state() == 'inactive'
    assert node.log('INFO.* configured; waiting to be activated$')
    bench.until(lambda: on_topic(bench, 'publishers', OFFERS[name]), 'a publisher')
    assert not on_topic(bench, 'subscribers', HEARS[name])
    assert supervisor.set('activate')
    bench.until(lambda: on_topic(bench, 'subscribers', HEARS[name]), 'a subscription')
    assert node.log('ready$')


@pytest.mark.parametrize(('transitions', 'state'), [
    ([], 'unconfigured'), (['configure'], 'inactive'),
    (['configure', 'activate', 'shutdown'], 'finalized'), (['shutdown'], 'finalized'),
    (['configure', 'cleanup', 'shutdown'], 'finalized')])
def test_a_node_that_is_asked_to_stop_ends_cleanly_in_every_state(
        start_node, bench, transitions, state):
    node = start_node('view_planner', ready=False, autostart=False, policy='farthest')
    supervisor = Supervisor(bench, 'view_planner')
    assert all(supervisor.set(each) for each in transitions)
    assert supervisor.state() == state
    assert node.stop(signal.SIGTERM) == 0
    assert not node.log('Traceback|ERROR|FATAL')


@pytest.mark.parametrize('name', NODES)
def test_weights_that_are_missing_leave_a_node_unconfigured_and_say_why(
        start_node, bench, tmp_path, name):
    path = tmp_path / 'late.safetensors'
    policy = {'policy': 'attention'} if name == 'view_planner' else {}
    node = start_node(name, ready=False, autostart=False, weights=path, **policy)
    supervisor = Supervisor(bench, name)
    assert not supervisor.set('configure')
    assert supervisor.state() == 'unconfigured'
    said, = node.log('ERROR')
    assert 'configure failed' in said and 'no such file' in said
    bench.until(lambda: bench.counts(name).get('refused/transition'), 'the diagnostics')
    assert node.running
    assert not supervisor.set('activate')


def test_what_is_not_possible_in_a_state_is_refused_in_one_line_and_survived(start_node, bench):
    node = start_node('view_planner', policy='farthest')
    supervisor = Supervisor(bench, 'view_planner')
    impossible = {'configure': 'configure', 'nonsense': 'nonsense',
                  Transition.TRANSITION_ACTIVATE: r'activate \(3\)', 77: r'an unknown one \(77\)'}
    for asked in impossible:
        assert not supervisor.set(asked)
    assert supervisor.state() == 'active'
    lines = node.log('refused|ERROR|Traceback')
    for line, got in zip(lines, impossible.values(), strict=True):
        assert re.search('WARN.* refused: no such transition of a node that is active: expected '
                         rf'deactivate \(4\) or shutdown \(7\), got {got}$', line)
    assert supervisor.set(Transition.TRANSITION_DEACTIVATE)
    assert supervisor.state() == 'inactive'
    refused = bench.ask(Trigger, 'plan')
    assert not refused.success and 'inactive' in refused.message
    assert supervisor.set('shutdown')
    assert not supervisor.set('configure')
    assert node.log('a node that is finalized: expected none, got configure$')


def test_a_reconstructor_hears_nothing_while_inactive_and_then_begins_an_episode(
        start_node, bench):
    start_node('reconstructor', weights=ANY_WEIGHTS, take_views='all')
    supervisor = Supervisor(bench, 'reconstructor')
    episodes = bench.subscribe(Header, 'episode', LATCHED_QOS)
    camera = FakeCamera(bench)
    camera.show()
    assert supervisor.set('deactivate')
    first = episodes[-1].frame_id
    bench.until(lambda: not on_topic(bench, 'subscribers', 'camera/image_raw'), 'silence')
    heard = len(camera.occupancy)
    camera.send(*camera.messages())
    refused = bench.ask(Trigger, 'start_episode')
    assert not refused.success and 'inactive' in refused.message
    late = bench.subscribe(PointCloud2, 'occupancy', LATCHED_QOS)
    bench.until(lambda: late, 'what is latched')
    assert len(camera.occupancy) == heard
    assert supervisor.set('activate')
    bench.until(lambda: episodes[-1].frame_id != first, 'a new episode')
    bench.until(lambda: on_topic(bench, 'subscribers', 'camera/image_raw'), 'a listener')
    camera.show()


def test_a_turntable_that_shows_no_next_object_tells_what_the_reconstructor_answered(
        start_node, bench, box):
    def refuse(_request, response):
        response.message = 'this node is inactive'
        return response

    bench.node.create_service(Trigger, 'start_episode', refuse)
    start_node('turntable_camera', mesh=box)
    answer = bench.call('next_object')
    assert not answer.success
    assert answer.message == (
        'no new episode: expected the reconstructor to begin one, but it answered: this node is '
        'inactive; the object is still the same')


def test_cleaning_up_frees_the_network(ros):
    node = ReconstructorNode()
    try:
        assert node.trigger_configure() == TransitionCallbackReturn.SUCCESS
        core = weakref.ref(node._reconstructor)
        network = weakref.ref(node._reconstructor._runtime)
        assert node.trigger_cleanup() == TransitionCallbackReturn.SUCCESS
        gc.collect()
        assert core() is None and network() is None
        assert node.trigger_configure() == TransitionCallbackReturn.SUCCESS
    finally:
        node.destroy_node()
