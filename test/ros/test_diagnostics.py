"""What the nodes tell of themselves on /diagnostics, over real DDS."""

from functools import partial
import socket

from diagnostic_msgs.msg import DiagnosticArray
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from msg_tools.stamps import nanoseconds_from_stamp
import numpy as np
import pytest

from .conftest import ANY_WEIGHTS, FakeCamera, FakeReconstructor
from .test_life_cycle import Supervisor

pytestmark = pytest.mark.ros


@pytest.fixture
def facts(bench):
    return lambda name: bench.state(name).facts


def test_the_reconstructor_tells_its_rates_its_latency_and_its_episode(start_node, bench, facts):
    start_node('reconstructor', take_views='all')
    facts = partial(facts, 'reconstructor')
    camera = FakeCamera(bench)
    for _ in range(3):
        camera.show()
    bench.until(lambda: bench.counts('reconstructor').get('views', 0) >= 3
                and float(facts()['Views per second']) > 0
                and int(facts()['Views of the episode']) >= 3, 'the views')
    assert bench.counts('reconstructor')['images'] >= 3
    assert bench.counts('reconstructor')['poses'] >= 3
    assert float(facts()['Images per second']) > 0
    assert float(facts()['Poses per second']) > 0
    assert 0 < float(facts()['Latency p50 (ms)']) <= float(facts()['Latency p99 (ms)'])
    assert len(facts()['Weights SHA-256']) == 64
    assert facts()['State'] == 'active'
    assert bench.state('reconstructor').hardware_id == socket.gethostname()
    answer = bench.call('start_episode')
    bench.until(lambda: facts()['Episode'] == answer.message, 'the new episode')
    assert facts()['Views of the episode'] == '0'


def test_what_is_refused_is_told_at_once_but_not_in_a_flood_and_its_warning_ends(
        start_node, bench):
    start_node('reconstructor', weights=ANY_WEIGHTS, take_views='all')
    camera = FakeCamera(bench)
    told = bench.subscribe(DiagnosticArray, '/diagnostics')

    def refused():
        _, _, pose = camera.messages()
        pose.header.frame_id = 'map'
        camera.send(pose=pose)
        return bench.counts('reconstructor').get('refused/frame', 0) >= 50

    bench.until(refused, 'many refusals')
    stamps = [nanoseconds_from_stamp(msg.header.stamp) / 1e9 for msg in told]
    assert min(np.diff(stamps)) < 0.5  # without news it is a second
    assert len(stamps) <= 10 * (stamps[-1] - stamps[0]) + 3
    said = "expected 'object', got 'map'"
    assert said in bench.state('reconstructor').problem
    bench.until(lambda: said not in bench.state('reconstructor').problem, 'its end')


def test_a_node_tells_the_state_of_its_life_cycle_as_it_changes(start_node, bench, facts):
    start_node('reconstructor', ready=False, autostart=False, weights=ANY_WEIGHTS)
    facts = partial(facts, 'reconstructor')
    bench.until(lambda: facts().get('State') == 'unconfigured', 'the node')
    assert 'Weights SHA-256' not in facts()
    client = bench.node.create_client(ChangeState, 'reconstructor/change_state')
    bench.until(client.service_is_ready, 'the life cycle')
    for transition, state in ((Transition.TRANSITION_CONFIGURE, 'inactive'),
                              (Transition.TRANSITION_ACTIVATE, 'active'),
                              (Transition.TRANSITION_DEACTIVATE, 'inactive'),
                              (Transition.TRANSITION_CLEANUP, 'unconfigured')):
        answer = client.call_async(ChangeState.Request(transition=Transition(id=transition)))
        bench.until(answer.done, f'an answer to {transition}')
        bench.until(lambda state=state: facts().get('State') == state, state)
    assert 'Weights SHA-256' not in facts()
    assert bench.counts('reconstructor')['episodes'] == 1


def test_a_node_that_is_configured_anew_tells_nothing_of_before(start_node, bench):
    node = start_node('view_planner', policy='farthest', target_quality=0.95, start_azimuth=1.0)
    supervisor, state = Supervisor(bench, 'view_planner'), partial(bench.state, 'view_planner')
    FakeReconstructor(bench, ('episode',)).begin('only')
    bench.until(lambda: state().counts.get('goals'), 'a goal')
    assert 'target_quality 0.95 is never reached' in state().problem
    assert supervisor.set('deactivate') and supervisor.set('cleanup')
    bench.until(lambda: state().facts['State'] == 'unconfigured', 'the end')
    assert not state().problem
    assert state().counts['goals'] == 1
    assert supervisor.set('configure')
    bench.until(lambda: state().facts['State'] == 'inactive', 'the new beginning')
    assert state().counts == {'warned/target_quality': 1}
    assert len(node.log('WARN.*target_quality')) == 2


def test_the_planner_tells_the_episode_and_why_it_is_done(start_node, bench, facts, box):
    start_node('turntable_camera', mesh=box, rate=30.0, time_scale=20.0)
    start_node('reconstructor', weights=ANY_WEIGHTS, take_views='at_goal')
    start_node('view_planner', policy='farthest', max_views=2, entropy_tolerance=0.0)
    facts = partial(facts, 'view_planner')
    bench.until(lambda: facts().get('Done') == 'max_views', 'the end of the episode')
    bench.until(lambda: 'Latency p50 (ms)' in facts(), 'a latency')
    answer = bench.call('start_episode')
    bench.until(lambda: facts()['Episode'] == answer.message, 'the new episode')
    bench.until(lambda: facts()['Done'] == 'max_views', 'its end')
