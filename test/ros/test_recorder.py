"""The recorder over real DDS: it writes what passed, byte for byte, also when things go wrong."""

from contextlib import suppress
import math
from pathlib import Path
import resource
import signal
import sys
from types import SimpleNamespace

from active_recon.errors import RecordingError
from active_recon.nodes.recording.recorded_subscriptions import RecordedSubscriptions
from active_recon.nodes.recording.sequence_gaps import SequenceGaps
from active_recon.nodes.runtime.topic_names import full_names, NAMES, publish_topic_names
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PoseStamped
from mcap.exceptions import EndOfFile, McapError
from mcap.reader import make_reader
from mcap.records import Message
from mcap.stream_reader import StreamReader
import numpy as np
import pytest
import rclpy
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import serialize_message
from rosbags.highlevel import AnyReader
from sensor_msgs.msg import CameraInfo, CompressedImage, Image
from std_msgs.msg import Header, String
import yaml

from .conftest import ANY_WEIGHTS

pytestmark = pytest.mark.ros
LATCHED_QOS = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
STREAM_QOS = QoSProfile(depth=100)
BEST_EFFORT = QoSProfile(depth=100, reliability=ReliabilityPolicy.BEST_EFFORT)


def poses(count):
    """Return poses as CDR bytes: made once, because what pads them differs each time.

    All that is sent here is a multiple of 4 bytes long: DDS fills up what is not.
    """
    msgs = [PoseStamped(header=Header(frame_id='object')) for _ in range(count)]
    for number, msg in enumerate(msgs):
        msg.header.stamp.sec, msg.pose.position.x = number, number / 7
    return [serialize_message(msg) for msg in msgs]


def publish(bench, kind, topic, qos, msgs=()):
    """Return a publisher that the recorder hears, once it has said the messages (CDR bytes)."""
    publisher = bench.node.create_publisher(kind, topic, qos)
    bench.until(publisher.get_subscription_count, f'the recorder on {topic}')
    for msg in msgs:
        publisher.publish(msg)
    return publisher


def recorded(bench, count):
    """Wait until the recorder has taken in as many messages as that."""
    bench.until(lambda: bench.counts('recorder').get('messages', 0) >= count,
                f'{count} messages, of which came {bench.counts("recorder")}')


def bags(folder):
    return sorted(path.parent for path in Path(folder).glob('*/metadata.yaml'))


def read(path):
    """Return each topic's messages as CDR bytes, read by rosbags."""
    topics: dict[str, list[bytes]] = {}
    with AnyReader([path]) as reader:
        for connection, _, data in reader.messages():
            topics.setdefault(connection.topic, []).append(bytes(data))
    return topics


@pytest.fixture
def recorder(start_node, tmp_path):
    return start_node('recorder', output_dir=tmp_path / 'bags', topics="['episode', 'view']")


def test_what_passes_is_recorded_byte_for_byte_with_its_times(bench, recorder, tmp_path):
    sent = poses(50)
    before = bench.now()
    publish(bench, PoseStamped, 'view', BEST_EFFORT, sent)
    recorded(bench, 50)
    assert bench.call('stop').success
    (bag,) = bags(tmp_path / 'bags')
    assert read(bag) == {'/view': sent}
    with (bag / f'{bag.name}_0.mcap').open('rb') as stream:
        times = [(record.publish_time, record.log_time)
                 for record in StreamReader(stream).records if isinstance(record, Message)]
    assert all(before <= published <= received <= bench.now() for published, received in times)


def test_latched_messages_from_before_the_recording_begin_every_bag(bench, start_node, tmp_path):
    episode = serialize_message(Header(frame_id='one'))
    bench.node.create_publisher(Header, 'episode', LATCHED_QOS).publish(episode)
    start_node('recorder', output_dir=tmp_path / 'bags', topics="['episode']")
    recorded(bench, 1)
    assert bench.call('stop').success
    assert bench.call('start').success
    recorded(bench, 2)
    assert bench.call('stop').success
    first, second = bags(tmp_path / 'bags')
    assert read(first) == read(second) == {'/episode': [episode]}
    with AnyReader([first]) as reader:
        (profile,) = reader.connections[0].ext.offered_qos_profiles
    assert (profile.durability.name, profile.reliability.name) == ('TRANSIENT_LOCAL', 'RELIABLE')


def test_publishers_that_offer_less_than_those_before_are_heard_too(bench, recorder, tmp_path):
    publish(bench, PoseStamped, 'view', STREAM_QOS, poses(1))
    recorded(bench, 1)
    second = publish(bench, PoseStamped, 'view', BEST_EFFORT)
    second.publish(*poses(1))
    recorded(bench, 2)
    assert not recorder.log('WARN.*(QoS|expected who)')


def test_a_user_may_name_topics_of_any_installed_type(bench, start_node, tmp_path):
    start_node('recorder', output_dir=tmp_path / 'bags', topics="['chatter']")
    goodbye = serialize_message(String(data='goodbye'))
    publish(bench, String, 'chatter', STREAM_QOS, [goodbye])
    recorded(bench, 1)
    assert bench.call('stop').success
    assert read(*bags(tmp_path / 'bags')) == {'/chatter': [goodbye]}


def test_a_topic_whose_type_python_lacks_is_refused_and_the_next_one_is_recorded(
        bench, monkeypatch):
    heard, noted = [], []
    inputs = RecordedSubscriptions(bench.node, lambda name, data, info: heard.append(name))
    bag = SimpleNamespace(add_topic=lambda name, *others: noted.append(name))

    def subscribe(kind, topic):
        publisher = bench.node.create_publisher(kind, topic, STREAM_QOS)
        offers = bench.until(lambda: bench.node.get_publishers_info_by_topic(topic), 'its offer')
        inputs.update(topic, offers, bag)
        return publisher

    with monkeypatch.context() as patch:
        patch.setitem(sys.modules, 'std_msgs.msg', None)  # its message files are still there
        with pytest.raises(RecordingError, match='^/chatter: message type not installed: expected '
                                                 'an installed one, got std_msgs/msg/String$'):
            subscribe(String, '/chatter')
    publisher = subscribe(PoseStamped, '/view')
    bench.until(lambda: publisher.publish(PoseStamped()) or heard, 'a message')
    assert noted == ['/view']
    inputs.clear()


def test_diagnostics_are_recorded_by_default_and_tell_the_state(bench, start_node, tmp_path):
    start_node('recorder', output_dir=tmp_path / 'bags')
    bench.until(lambda: bench.counts('recorder').get('recording') == 1, 'a recording')
    recorded(bench, 1)
    assert bench.call('stop').success
    bench.until(lambda: bench.counts('recorder').get('recording') == 0, 'no recording')
    with AnyReader(bags(tmp_path / 'bags')) as reader:
        kinds = {connection.topic: connection.msgtype for connection in reader.connections}
    assert kinds == {'/diagnostics': 'diagnostic_msgs/msg/DiagnosticArray'}


def test_a_recorder_told_to_wait_starts_and_stops_when_asked_and_refuses_it_out_of_turn(
        bench, start_node, tmp_path):
    start_node('recorder', output_dir=tmp_path / 'bags', record_at_start=False)
    assert not (tmp_path / 'bags').exists()
    refused = bench.call('stop')
    assert not refused.success and 'there is none' in refused.message
    answer = bench.call('start')
    assert answer.success and Path(answer.message).is_dir()
    refused = bench.call('start')
    assert not refused.success and 'already recording into' in refused.message
    assert bench.call('stop').success


@pytest.mark.parametrize('how', [signal.SIGINT, signal.SIGTERM])
def test_a_recorder_that_is_stopped_completes_its_bag(bench, recorder, tmp_path, how):
    publish(bench, PoseStamped, 'view', STREAM_QOS, poses(3))
    recorded(bench, 3)
    assert recorder.stop(how) == 0
    assert len(read(*bags(tmp_path / 'bags'))['/view']) == 3


def test_a_killed_recorder_leaves_what_it_had_on_the_disk(bench, recorder, tmp_path):
    sent = poses(3)
    publish(bench, PoseStamped, 'view', STREAM_QOS, sent)
    recorded(bench, 3)
    (path,) = (tmp_path / 'bags').glob('*/*.mcap')
    bench.until(lambda: list(whole_messages(path)) == sent, 'the messages on the disk')
    recorder.stop(signal.SIGKILL)
    assert list(whole_messages(path)) == sent


def whole_messages(path):
    """Yield the messages of a file that ends where its writer was killed."""
    with path.open('rb') as stream, suppress(EndOfFile):
        for record in StreamReader(stream).records:
            if isinstance(record, Message):
                yield record.data


def test_a_full_disk_stops_the_recording_and_not_the_node(bench, start_node, tmp_path):
    recorder = start_node('recorder', output_dir=tmp_path / 'bags', topics="['camera/image_raw']")
    # For one process, files that may not grow are a full disk that needs no administrator.
    resource.prlimit(recorder.pid, resource.RLIMIT_FSIZE, (300_000, resource.RLIM_INFINITY))
    image = serialize_message(
        Image(height=100, width=300, step=900, encoding='rgb8', data=noise(90_000)))
    publisher = publish(bench, Image, 'camera/image_raw', STREAM_QOS)
    diagnostics = bench.subscribe(DiagnosticArray, '/diagnostics')
    while not recorder.log('ERROR'):
        publisher.publish(image)
        heard = bench.counts('recorder').get('messages', 0)
        bench.until(lambda heard=heard: recorder.log('ERROR') or (
            bench.counts('recorder').get('messages', 0) > heard), 'the next message')
    bench.until(lambda: bench.counts('recorder').get('refused/disk_full') == 1, 'its count')
    assert bench.counts('recorder')['recording'] == 0
    state = bench.until(lambda: [status for msg in diagnostics for status in msg.status
                                 if status.level == DiagnosticStatus.ERROR], 'an error')[0]
    assert 'recording stopped' in state.message
    (line,) = recorder.log('ERROR')
    assert 'recording stopped' in line and 'writing failed' in line
    (bag,) = bags(tmp_path / 'bags')
    left = read(bag)['/camera/image_raw']
    assert left and set(left) == {image}

    assert bench.call('start').success
    bench.until(lambda: publisher.get_subscription_count(), 'the recorder to listen again')
    heard = bench.counts('recorder')['messages']
    publisher.publish(image)
    recorded(bench, heard + 1)
    bench.until(lambda: diagnostics[-1].status[0].level == DiagnosticStatus.OK, 'an all-clear')
    assert bench.call('stop').success
    assert read(bags(tmp_path / 'bags')[-1]) == {'/camera/image_raw': [image]}


def provenance_of(path):
    """Return the last record of what made a bag, and the parameters of its nodes."""
    with path.open('rb') as stream, suppress(McapError):  # read while it is written
        reader = make_reader(stream)
        *_, record = [record.metadata for record in reader.iter_metadata()
                      if record.name == 'active_recon']
        return record, {attachment.name: yaml.safe_load(attachment.data)
                        for attachment in reader.iter_attachments()}
    return {}, {}


def test_a_killed_recorder_has_told_what_made_the_bag(bench, start_node, box, tmp_path):
    recorder = start_node('recorder', output_dir=tmp_path / 'bags', max_bag_size_mb=7)
    start_node('turntable_camera', mesh=box)
    start_node('view_planner', policy='random', seed=12)
    (path,) = (tmp_path / 'bags').glob('*/*.mcap')
    bench.until(lambda: provenance_of(path)[0].keys() == {'version', 'object', 'policy', 'seed'},
                'what made the bag')
    recorder.stop(signal.SIGKILL)
    record, parameters = provenance_of(path)
    assert (record['object'], record['policy'], record['seed']) == ('box.ply', 'random', '12')
    assert parameters.keys() >= {
        f'parameters/{node}.yaml' for node in ('recorder', 'turntable_camera', 'view_planner')}
    assert parameters['parameters/recorder.yaml']['max_bag_size_mb'] == 7
    assert parameters['parameters/view_planner.yaml']['max_views'] == 5
    assert math.isnan(parameters['parameters/view_planner.yaml']['start_azimuth'])


def test_the_parameters_of_nodes_that_publish_nothing_are_kept_too(bench, start_node, tmp_path):
    bench.node.declare_parameter('seed', 99)  # of something else: it did not make the bag
    elsewhere = Node('elsewhere', namespace='/other_robot', context=bench.node.context)
    try:
        start_node('recorder', output_dir=tmp_path / 'bags')
        (path,) = (tmp_path / 'bags').glob('*/*.mcap')
        name = f'parameters/{bench.node.get_name()}.yaml'
        bench.until(lambda: name in provenance_of(path)[1], 'the parameters of a bystander')
        record, parameters = provenance_of(path)
        assert parameters[name]['seed'] == 99
        assert 'seed' not in record
        assert not [found for found in parameters if 'elsewhere' in found]
    finally:
        elsewhere.destroy_node()


def test_a_node_that_comes_back_is_asked_again(bench, start_node, tmp_path):
    start_node('recorder', output_dir=tmp_path / 'bags')
    (path,) = (tmp_path / 'bags').glob('*/*.mcap')
    for seed in ('1', '2'):
        planner = start_node('view_planner', policy='random', seed=seed)
        bench.until(lambda seed=seed: provenance_of(path)[0].get('seed') == seed, 'its seed')
        planner.stop()


def test_the_loop_goes_on_where_the_recording_has_stopped(bench, start_node, box, tmp_path):
    recorder = start_node('recorder', output_dir=tmp_path / 'bags')
    resource.prlimit(recorder.pid, resource.RLIMIT_FSIZE, (30_000, resource.RLIM_INFINITY))
    start_node('turntable_camera', mesh=box, speed=3.0)
    start_node('reconstructor', weights=ANY_WEIGHTS)
    bench.until(lambda: recorder.log('recording stopped'), 'the end of the recording')
    start_node('view_planner', policy='farthest', max_views=2, entropy_tolerance=0.0)
    done = bench.subscribe(Header, 'done', LATCHED_QOS)
    bench.until(lambda: done and done[-1].frame_id == 'max_views', 'the end of the loop')
    assert recorder.running and len(recorder.log('recording stopped')) == 1


def noise(size):
    """Return bytes that do not compress."""
    return np.random.default_rng(0).integers(0, 256, size, np.uint8).tobytes()


@pytest.mark.parametrize(('parameters', 'said'), [
    ({'topics': '7'}, 'parameter topics: invalid value: expected a list, each a string, got 7'),
    ({'topics': "['a-b']"}, "parameter topics: invalid value: .*got 'a-b': .*characters"),
    ({'topics': "['a//b']"}, 'parameter topics: invalid value: .*repeated'),
    ({'output_dir': '/proc/bags'}, 'cannot start a bag in /proc/bags'),
])
def test_what_cannot_be_recorded_is_refused_at_start(start_node, parameters, said):
    recorder = start_node('recorder', ready=False, **parameters)
    assert recorder.wait() == 1
    assert len(recorder.log(said)) == 1
    assert not recorder.log('Traceback')


def start_remapped(start_node, name, remappings, **parameters):
    """Start a node whose topics have other names."""
    words = [word for each in remappings for word in ('-r', each)]
    return start_node(name, program=('-m', f'active_recon.nodes.{name}', '--ros-args', *words),
                      **parameters)


CAMERA = ('camera/image_raw:=usb_cam/image', 'camera/camera_info:=usb_cam/info',
          'camera/pose:=arm/pose')


def test_a_remapped_camera_is_found_by_what_the_reconstructor_hears(
        bench, start_node, box, tmp_path):
    recorder = start_node('recorder', output_dir=tmp_path / 'bags')
    start_remapped(start_node, 'turntable_camera', CAMERA, mesh=box)
    start_remapped(start_node, 'reconstructor', (*CAMERA, 'view:=seen'), take_views='all')
    (path,) = (tmp_path / 'bags').glob('*/*.mcap')
    bench.until(lambda: 'camera/pose' in provenance_of(path)[0], 'the names of the topics')
    wanted = {'/usb_cam/image', '/usb_cam/info', '/arm/pose', '/seen', '/occupancy'}

    def heard():
        return {topic for topic in wanted if bench.node.count_subscribers(topic)} == wanted

    bench.until(heard, 'the recorder on all topics')
    before = bench.counts('recorder').get('messages', 0)
    recorded(bench, before + 50)
    assert bench.call('stop').success
    assert read(*bags(tmp_path / 'bags')).keys() >= wanted - {'/seen', '/occupancy'}
    record, _ = provenance_of(path)
    assert {name: record[name] for name in ('camera/image_raw', 'camera/pose', 'view')} == {
        'camera/image_raw': '/usb_cam/image', 'camera/pose': '/arm/pose', 'view': '/seen'}
    assert 'occupancy' not in record  # it has its usual name
    assert not recorder.log('Traceback')


@pytest.mark.parametrize(('remapped', 'raw', 'compressed'), [
    ({'camera/image_raw/compressed': '/usb_cam/packed'},
     '/camera/image_raw', '/usb_cam/packed'),
    ({'camera/image_raw': '/usb_cam/image'}, '/usb_cam/image', '/usb_cam/image/compressed'),
    ({'camera/image_raw': '/usb_cam/image', '/usb_cam/image/compressed': '/packed'},
     '/usb_cam/image', '/packed')])
def test_the_names_that_a_node_tells_follow_the_remappings_of_each_transport(
        ros, remapped, raw, compressed):
    rules = [each for name, to in remapped.items() for each in ('-r', f'{name}:={to}')]
    node = rclpy.create_node('told', cli_args=['--ros-args', *rules])
    try:
        publish_topic_names(node, ['camera/image_raw'])
        names = full_names({NAMES: node.get_parameter(NAMES).value})
    finally:
        node.destroy_node()
    assert names == {'camera/image_raw': raw, 'camera/image_raw/compressed': compressed}


def test_what_has_no_publisher_is_told_until_it_has_one(bench, start_node, tmp_path):
    recorder = start_node('recorder', output_dir=tmp_path / 'bags')
    bench.until(lambda: '/camera/image_raw' in bench.state('recorder').problem, 'the warning')
    said, = recorder.log('WARN')
    assert ('no publishers on /camera/camera_info, /camera/image_raw, /camera/pose'
            in said)
    for kind, topic in ((CompressedImage, 'camera/image_raw/compressed'),
                        (CameraInfo, 'camera/camera_info'), (PoseStamped, 'camera/pose')):
        bench.node.create_publisher(kind, topic, STREAM_QOS)
    bench.until(lambda: not bench.state('recorder').problem, 'the end of the warning')


def test_a_recording_that_shall_stop_by_itself_ends_with_its_episode(bench, start_node, tmp_path):
    old = bench.node.create_publisher(Header, 'done', LATCHED_QOS)
    old.publish(Header(frame_id='stopped'))  # of an episode before the recording
    recorder = start_node('recorder', output_dir=tmp_path / 'bags', stop_when_done=True,
                          topics="['done', 'view']")
    recorded(bench, 1)
    views = publish(bench, PoseStamped, 'view', STREAM_QOS, poses(1))
    recorded(bench, 2)
    old.publish(Header(frame_id='abcd'))
    old.publish(Header(frame_id=''))  # taken back
    recorded(bench, 4)
    views.publish(*poses(1))
    recorded(bench, 5)
    old.publish(Header(frame_id='max_views'))
    bench.until(lambda: bench.counts('recorder').get('recording') == 0, 'the end')
    (bag,) = bags(tmp_path / 'bags')
    assert [len(read(bag)[topic]) for topic in ('/done', '/view')] == [4, 2]
    assert recorder.running
    assert recorder.log(r'INFO.*recorded \d+\.\d MB in \d+ s into')
    assert bench.call('start').success


def test_a_recording_that_goes_on_after_its_episode_says_so(bench, start_node, tmp_path):
    recorder = start_node('recorder', output_dir=tmp_path / 'bags', topics="['done']")
    done = publish(bench, Header, 'done', LATCHED_QOS, [])
    done.publish(Header(frame_id='max_views'))
    recorded(bench, 1)
    bench.until(lambda: recorder.log('INFO.*the episode is done; the recording goes on'), 'it')
    assert bench.counts('recorder').get('recording') == 1


def test_the_recorder_tells_how_fast_it_fills_the_disk(bench, start_node, tmp_path):
    start_node('recorder', output_dir=tmp_path / 'bags', topics="['camera/image_raw']")
    publisher = publish(bench, Image, 'camera/image_raw', STREAM_QOS)
    image = serialize_message(
        Image(height=100, width=300, step=900, encoding='rgb8', data=noise(90_000)))

    def told():
        publisher.publish(image)
        facts = bench.state('recorder').facts
        return float(facts.get('Bag (MB)', 0)) > 1 and float(facts.get('Disk (MB/s)', 0)) > 0

    bench.until(told, 'the rate')


def test_messages_that_were_lost_in_transport_are_told():
    gaps = SequenceGaps()
    gaps.set_publishers('view', {b'one'})
    assert [gaps.before('view', number) for number in (4, 5, 8)] == [0, 0, 2]
    gaps.set_publishers('view', {b'one', b'two'})
    assert [gaps.before('view', number) for number in (9, 3, 30)] == [0, 0, 0]
    gaps.set_publishers('view', {b'two'})
    assert [gaps.before('view', number) for number in (31, 33)] == [0, 1]
    gaps.restart('view')
    assert gaps.before('view', 33) == 0


def test_a_recording_ends_with_its_episode_although_the_clock_stands_still(
        bench, start_node, tmp_path):
    start_node('recorder', output_dir=tmp_path / 'bags', stop_when_done=True, use_sim_time=True,
               topics="['done']")
    done = publish(bench, Header, 'done', LATCHED_QOS, [])
    done.publish(Header(frame_id='max_views'))
    bench.until(lambda: bench.counts('recorder').get('recording') == 0, 'the end')
    (bag,) = bags(tmp_path / 'bags')
    assert len(read(bag)['/done']) == 1
