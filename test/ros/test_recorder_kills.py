"""The recorder killed at any moment, and at work for long: nothing is lost, nothing grows."""

from pathlib import Path
import random
import resource
import signal
import time

from active_recon.bags.storage.repair import repair_bag
from geometry_msgs.msg import PoseStamped
from msg_tools.stamps import nanoseconds_from_stamp, stamp_from_nanoseconds
import pytest
from rclpy.qos import QoSProfile
from rclpy.serialization import serialize_message
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import Reader
from sensor_msgs.msg import Image
from std_msgs.msg import Header

pytestmark = pytest.mark.ros
STREAM_QOS = QoSProfile(depth=1000)
KILLS, IN_EVERY_RUN = 50, 5
ON_DISK_WITHIN_S = 1.0
PERIOD_S = 0.01


def stamps(path):
    """Return the stamps in a bag's only file, as rosbags reads it with nothing beside it."""
    with AnyReader([path]) as reader:
        return [nanoseconds_from_stamp(reader.deserialize(data, connection.msgtype).header.stamp)
                for connection, _, data in reader.messages()]


def stream(bench, publisher, seconds):
    """Publish poses at 100 Hz, each stamped by its number; return when each was sent."""
    sent = []
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        header = Header(stamp=stamp_from_nanoseconds(len(sent)), frame_id='object')
        publisher.publish(PoseStamped(header=header))
        sent.append(time.monotonic())
        bench.within(PERIOD_S, lambda: False)
    return sent


@pytest.mark.parametrize('seed', [
    pytest.param(seed, marks=[pytest.mark.slow] * (seed >= IN_EVERY_RUN))
    for seed in range(KILLS)])
def test_what_came_a_second_before_a_kill_is_on_the_disk(bench, start_node, tmp_path, seed):
    topic = f'view_{seed}'  # one that was killed before is thought to listen for a while
    recorder = start_node('recorder', output_dir=tmp_path / 'bags', topics=f"['{topic}']")
    publisher = bench.advertise(PoseStamped, topic, STREAM_QOS)
    sent = stream(bench, publisher, 0.5 + 2 * random.Random(seed).random())
    killed = time.monotonic()
    recorder.stop(signal.SIGKILL)
    (file,) = (tmp_path / 'bags').glob('*/*.mcap')
    kept = stamps(file)
    assert kept == list(range(len(kept)))
    assert len(kept) >= sum(at < killed - ON_DISK_WITHIN_S for at in sent)
    (repair,), described = repair_bag(file.parent)
    assert described and repair.contents.counts.total() == len(kept)
    with Reader(file.parent) as reader:
        assert reader.message_count == len(kept)


@pytest.mark.slow
def test_the_recorders_memory_stays_flat_over_10_000_messages(bench, start_node, tmp_path):
    recorder = start_node('recorder', output_dir=tmp_path / 'bags', max_bag_size_mb=20)
    image = serialize_message(Image(height=64, width=64, step=192, data=bytes(64 * 192)))
    publisher = bench.advertise(Image, 'camera/image_raw', STREAM_QOS)

    def publish(count):
        for number in range(count):
            publisher.publish(image)
            if number % 100 == 99:
                bench.within(0.1, lambda: False)

    def resident():
        pages = int(Path(f'/proc/{recorder.pid}/statm').read_text().split()[1])
        return pages * resource.getpagesize()

    def recorded(count):
        bench.until(lambda: bench.counts('recorder').get('messages', 0) >= count, 'them all')

    publish(2000)
    recorded(2000)
    before = resident()
    publish(10_000)
    recorded(12_000)
    assert resident() - before < 8_000_000
