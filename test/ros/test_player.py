"""Playing a bag: what live nodes hear is what was recorded, and they take it for a camera."""

import subprocess
import sys
import time

from active_recon.bags.storage.writer import BagWriter
from geometry_msgs.msg import PoseStamped
from msg_tools.stamps import nanoseconds_from_stamp
import pytest
from rclpy.qos import DurabilityPolicy, QoSProfile
from recorded_messages import cdr, definition, HEADER, header, LATCHED
from rosbags.highlevel import AnyReader
from std_msgs.msg import Header

from .conftest import ANY_WEIGHTS

pytestmark = pytest.mark.ros
LATCHED_QOS = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
STREAM_QOS = QoSProfile(depth=1000)
CAMERA = 'camera/image_raw,camera/camera_info,camera/pose'
VIEWS = 3
STANDS_S = 2.0  # the camera, before it moves: live nodes that hear the bag have to find it there
PLAYED_WITHIN_S = 120.0  # two processes to start, and a bag as long as it took to record


def read(bag):
    """Return each topic's messages, and the span of their receive times in seconds."""
    topics = {}
    with AnyReader([bag]) as reader:
        for connection, _, data in reader.messages():
            topics.setdefault(connection.topic, []).append(
                reader.deserialize(data, connection.msgtype))
        return topics, reader.duration / 1e9


def stamps(msgs):
    return [nanoseconds_from_stamp(getattr(msg, 'header', msg).stamp) for msg in msgs]


@pytest.fixture(scope='module')
def bag(shared_bench, start_shared_node, box, tmp_path_factory):
    """The bag of a loop that took three views by the policy farthest."""
    bags = tmp_path_factory.mktemp('bags')
    nodes = [start_shared_node('recorder', output_dir=bags),
             start_shared_node('turntable_camera', mesh=box, speed=3.0),
             start_shared_node('reconstructor', weights=ANY_WEIGHTS)]
    poses = shared_bench.subscribe(PoseStamped, 'camera/pose', STREAM_QOS)
    shared_bench.until(lambda: poses, 'the camera')
    shared_bench.within(STANDS_S, lambda: False)
    nodes.append(start_shared_node('view_planner', policy='farthest', max_views=VIEWS,
                                   entropy_tolerance=0.0))
    done = shared_bench.subscribe(Header, 'done', LATCHED_QOS)
    shared_bench.until(lambda: done and done[-1].frame_id, 'the end of the loop')
    shared_bench.within(1.0, lambda: False)  # the camera streams on
    for node in nodes:
        assert node.stop() == 0
    return next(bags.iterdir())


@pytest.fixture
def play(ros_domain, tmp_path):
    """Start to play a bag; what it says goes into the file `said`."""
    started = []

    def start(bag, *options):
        with (tmp_path / 'said').open('w') as said:
            started.append(subprocess.Popen(
                [sys.executable, '-m', 'active_recon.cli.main', 'play', str(bag), *options],
                stdout=said, stderr=subprocess.STDOUT))
        return started[-1]

    yield start
    for process in started:
        process.kill()
        process.wait()


@pytest.fixture
def bench(shared_bench):
    return shared_bench


def test_every_message_is_heard_in_order_at_the_rate(bench, play, bag):
    recorded, seconds = read(bag)
    poses = bench.subscribe(PoseStamped, 'camera/pose', STREAM_QOS)
    episodes = bench.subscribe(Header, 'episode', LATCHED_QOS)
    began = time.monotonic()
    process = play(bag, '--rate', '2', '--topics', 'camera/pose,/episode')
    bench.until(lambda: process.poll() is not None, 'the end of the playing', PLAYED_WITHIN_S)
    assert process.returncode == 0
    assert time.monotonic() - began > seconds / 2
    assert stamps(poses) == stamps(recorded['/camera/pose'])
    assert [msg.frame_id for msg in episodes] == [msg.frame_id for msg in recorded['/episode']]


@pytest.mark.slow
def test_latched_topics_are_latched_again(bench, play, bag):
    process = play(bag, '--topics', 'episode,camera/pose', '--rate', '0.5')
    poses = bench.subscribe(PoseStamped, 'camera/pose', STREAM_QOS)
    bench.until(lambda: poses, 'the first pose, which follows the episode', PLAYED_WITHIN_S)
    late = bench.subscribe(Header, 'episode', LATCHED_QOS)
    bench.until(lambda: late, 'the episode, which was said before')
    process.terminate()
    assert process.wait(30) == 0


def test_the_last_message_of_each_publisher_of_a_latched_topic_is_latched_again(
        bench, play, tmp_path):
    with BagWriter(tmp_path / 'run') as bag:
        bag.add_topic('/frames', HEADER, definition(HEADER), (LATCHED, LATCHED))
        bag.add_topic('/ticks', HEADER, definition(HEADER))
        for number in range(60):
            topic = '/frames' if number < 2 else '/ticks'
            bag.write(topic, cdr(header(number)), number * 10**9, number * 10**9)
    ticks = bench.subscribe(Header, 'ticks', STREAM_QOS)
    process = play(tmp_path / 'run', '--rate', '2')
    bench.until(lambda: ticks, 'the first tick, which follows the frames', PLAYED_WITHIN_S)
    late = bench.subscribe(Header, 'frames', QoSProfile(
        depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL))
    bench.until(lambda: len(late) == 2, 'the frames, which were said before')
    assert [msg.frame_id for msg in late] == [header(number).frame_id for number in range(2)]
    process.terminate()
    assert process.wait(30) == 0


def test_live_nodes_take_the_recorded_camera_for_one(bench, play, start_node, bag):
    recorded, _ = read(bag)
    start_node('reconstructor', weights=ANY_WEIGHTS, use_sim_time='true')
    start_node('view_planner', use_sim_time='true', policy='farthest', max_views=VIEWS,
               entropy_tolerance=0.0)
    views = bench.subscribe(PoseStamped, 'view', LATCHED_QOS)
    done = bench.subscribe(Header, 'done', LATCHED_QOS)
    play(bag, '--topics', CAMERA)
    bench.until(lambda: done and done[-1].frame_id, 'the end of the loop', PLAYED_WITHIN_S)
    assert done[-1].frame_id == 'max_views'
    assert len(views) == VIEWS
    assert set(stamps(views)) <= set(stamps(recorded['/camera/image_raw']))


def test_a_rate_of_0_is_refused_in_one_line(play, bag, tmp_path):
    assert play(bag, '--rate', '0').wait(60) == 2
    (line,) = (tmp_path / 'said').read_text().splitlines()
    assert '--rate: invalid rate: expected one above 0' in line


def test_a_bag_that_was_cut_off_is_refused_with_the_cure(play, bag, tmp_path):
    (tmp_path / 'run').mkdir()
    (tmp_path / 'run/run_0.mcap').write_bytes((bag / f'{bag.name}_0.mcap').read_bytes()[:-2000])
    assert play(tmp_path / 'run').wait(60) == 2
    (line,) = (tmp_path / 'said').read_text().splitlines()
    assert 'active-recon bag repair' in line


def test_a_bag_that_is_damaged_inside_is_refused_and_not_played_in_part(
        bench, play, bag, tmp_path):
    path = tmp_path / 'run.mcap'
    content = bytearray((bag / f'{bag.name}_0.mcap').read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)
    poses = bench.subscribe(PoseStamped, 'camera/pose', STREAM_QOS)
    assert play(path).wait(60) == 2
    (line,) = (tmp_path / 'said').read_text().splitlines()
    assert line.startswith(f'active-recon: {path}: ')
    assert not poses
