"""The reconstructor's service `save_mesh`, and a camera that publishes best effort."""

from pathlib import Path
import threading

from active_recon.nodes.loop.mesh_saver import MeshSaver
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
import pytest
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter
from rclpy.qos import qos_profile_sensor_data
from std_msgs.msg import Header
from std_srvs.srv import Trigger
import trimesh

from .conftest import BUDGET_S, FakeCamera

pytestmark = pytest.mark.ros


@pytest.mark.parametrize('mesh_format', ['ply', pytest.param('glb', marks=pytest.mark.slow)])
def test_the_mesh_is_written_where_the_answer_says(start_node, bench, tmp_path, mesh_format):
    # A threshold so low that noise leaves a surface
    start_node('reconstructor', take_views='all', threshold=0.2, mesh_format=mesh_format,
               output_dir=tmp_path / 'meshes')
    answer = bench.call('save_mesh')
    assert not answer.success
    assert 'no view in this episode yet: expected one before a mesh' in answer.message
    FakeCamera(bench, qos_profile_sensor_data).show()
    answer = bench.call('save_mesh')
    assert answer.success
    path = Path(answer.message)
    assert (path.parent, path.suffix) == (tmp_path / 'meshes', f'.{mesh_format}')
    assert len(trimesh.load(path, force='mesh').faces) > 0


def test_a_mesh_that_cannot_be_written_is_said_and_another_folder_may_be_set(
        start_node, bench, tmp_path):
    (tmp_path / 'meshes').write_text('a file, where a folder is wanted')
    start_node('reconstructor', take_views='all', threshold=0.2, output_dir=tmp_path / 'meshes')
    camera = FakeCamera(bench)
    camera.show()
    answer = bench.call('save_mesh')
    assert not answer.success
    assert 'was not written' in answer.message
    camera.show()
    request = SetParameters.Request(parameters=[
        Parameter('output_dir', value=str(tmp_path / 'others')).to_parameter_msg()])
    result, = bench.ask(SetParameters, 'reconstructor/set_parameters', request).results
    assert result.successful
    assert Path(bench.call('save_mesh').message).parent == tmp_path / 'others'


def test_images_become_views_while_a_mesh_is_made(bench):
    making, made = threading.Event(), threading.Event()

    def write(response):
        making.set()
        made.wait(BUDGET_S)
        response.success, response.message = True, 'a path'
        return response

    saver = MeshSaver(bench.node, lambda: write)
    client = bench.node.create_client(Trigger, 'save_mesh')
    bench.until(client.service_is_ready, 'the service')
    heard = []
    bench.node.create_subscription(Header, 'meanwhile', heard.append, 10)
    publisher = bench.node.create_publisher(Header, 'meanwhile', 10)
    answer = client.call_async(Trigger.Request())
    bench.until(making.is_set, 'the mesh')
    publisher.publish(Header())
    bench.until(lambda: heard, 'a message')
    assert not answer.done()
    made.set()
    bench.until(answer.done, 'the answer')
    assert answer.result().success and answer.result().message == 'a path'
    saver.close()


def test_a_mesh_being_made_is_written_whole_though_the_node_ends(start_node, bench, tmp_path):
    folder = tmp_path / 'meshes'
    node = start_node('reconstructor', take_views='all', threshold=0.2, output_dir=folder)
    FakeCamera(bench).show()
    client = bench.node.create_client(Trigger, 'save_mesh')
    bench.until(client.service_is_ready, 'the service')
    client.call_async(Trigger.Request())
    bench.until(folder.exists, 'the beginning of the file')
    assert node.stop() == 0
    path, = folder.iterdir()
    assert len(trimesh.load(path, force='mesh').faces) > 0


@pytest.mark.parametrize(('transitions', 'later'), [
    (['deactivate'], 'meshes'), (['deactivate', 'cleanup'], 'no view in this episode yet')])
def test_a_mesh_is_answered_though_the_node_changes_its_state(
        start_node, bench, tmp_path, transitions, later):
    start_node('reconstructor', take_views='all', threshold=0.2, output_dir=tmp_path / 'meshes')
    FakeCamera(bench).show()
    client = bench.node.create_client(Trigger, 'save_mesh')
    bench.until(client.service_is_ready, 'the service')
    answer = client.call_async(Trigger.Request())
    bench.within(0.2, answer.done)  # services are not answered in the order of the requests
    for transition in transitions:
        assert bench.ask(ChangeState, 'reconstructor/change_state', ChangeState.Request(
            transition=Transition(label=transition))).success
    bench.until(answer.done, 'the answer')
    assert answer.result().success and Path(answer.result().message).exists()
    assert later in bench.call('save_mesh').message
