"""What the reconstructor makes of an episode: its surface as a Marker, and a state in a file."""

from pathlib import Path

from active_recon.nodes.runtime.qos import LATCHED_QOS
from msg_tools.markers import surface_from_msg
from msg_tools.stamps import nanoseconds_from_stamp
import pytest
from rcl_interfaces.msg import Parameter, ParameterValue
from rcl_interfaces.srv import SetParameters
from safetensors import safe_open
from visualization_msgs.msg import Marker

from .conftest import FakeCamera

pytestmark = pytest.mark.ros


@pytest.fixture
def start(start_node, tmp_path):
    """Return a function that starts a reconstructor for which noise leaves a surface."""
    def start(threshold=0.2, **parameters):
        return start_node('reconstructor', take_views='all', threshold=threshold,
                          output_dir=tmp_path, **parameters)
    return start


def test_the_surface_of_a_view_is_published_and_removed_with_its_episode(start, bench):
    start(publish_mesh=True, weights='r2n2', threshold=0.01)  # of few cells
    heard = bench.subscribe(Marker, 'mesh', LATCHED_QOS)
    stamp = FakeCamera(bench).show()
    bench.until(lambda: heard and heard[-1].action == Marker.ADD, 'the surface')
    triangles, colors = surface_from_msg(heard[-1])
    assert len(triangles) > 10
    assert colors is not None
    assert nanoseconds_from_stamp(heard[-1].header.stamp) <= stamp
    assert heard[-1].header.frame_id == 'object'
    assert bench.call('start_episode').success
    bench.until(lambda: heard[-1].action == Marker.DELETE, 'its removal')


def test_an_episode_goes_on_from_its_file_in_another_process(start, bench):
    first = start()
    assert 'no view in this episode yet: expected one before a state' in bench.call(
        'save_state').message
    camera = FakeCamera(bench)
    camera.show()
    camera.show()
    saved = Path(bench.call('save_state').message)
    assert saved.name.endswith('-2.state.safetensors')
    with safe_open(saved, framework='np') as state:  # at once, with a photograph of each view
        assert sum(name.startswith('image/') for name in state.keys()) == 2  # noqa: SIM118
    first.stop()
    start(state_file=saved.name)
    before = len(camera.occupancy)
    answer = bench.call('load_state')
    assert answer.success, answer.message
    assert not saved.name.startswith(answer.message)  # an episode of its own
    bench.until(lambda: len(camera.occupancy) > before, 'the shape that was loaded')
    bench.until(lambda: bench.state('reconstructor').facts['Views of the episode'] == '2',
                'its views in the diagnostics')
    assert 'expected IoU' in bench.state('reconstructor').facts['Quality']
    assert '-2.' in bench.call('save_mesh').message
    assert bench.call('start_episode').success
    bench.until(lambda: 'Quality' not in bench.state('reconstructor').facts,
                'no quality of the episode before')
    saved.write_bytes(saved.read_bytes()[:1000])
    answer = bench.call('load_state')
    assert not answer.success
    assert 'no readable state: expected a whole file of save_state' in answer.message
    assert '\n' not in answer.message
    set_state_file(bench, '')
    assert 'expected an active node and its parameter state_file' in bench.call(
        'load_state').message


def set_state_file(bench, name):
    bench.ask(SetParameters, 'reconstructor/set_parameters', SetParameters.Request(parameters=[
        Parameter(name='state_file', value=ParameterValue(type=4, string_value=name))]))


def test_a_state_that_cannot_be_written_is_told_and_the_node_goes_on(start_node, bench):
    start_node('reconstructor', take_views='all', output_dir='/proc')
    FakeCamera(bench).show()
    for service in ('save_state', 'save_mesh'):
        answer = bench.call(service)
        assert not answer.success
        assert 'was not written: ' in answer.message
    assert bench.call('start_episode').success
