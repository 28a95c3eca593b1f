"""Bags: what is written is what readers that we did not write read, also where the disk fills."""

from pathlib import Path
import resource
import subprocess
import sys

from active_recon.bags.metadata import QosProfile
from active_recon.bags.writer import BagWriter
from active_recon.errors import RecordingError
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
import numpy as np
import pytest
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import Reader
from rosbags.typesys import get_typestore, Stores

STORE = get_typestore(Stores.ROS2_JAZZY)
HEADER, IMAGE = 'std_msgs/msg/Header', 'sensor_msgs/msg/Image'
LATCHED = QosProfile(durability='transient_local')
SENSOR = QosProfile(reliability='best_effort')


def definition(type_name):
    return STORE.generate_msgdef(type_name, ros_version=2)[0]


def header(number):
    time = STORE.types['builtin_interfaces/msg/Time'](sec=1_700_000_000 + number, nanosec=number)
    return STORE.types[HEADER](stamp=time, frame_id=f'episode {number}')


def image(number, side=8):
    pixels = np.random.default_rng(number).integers(0, 256, side * side * 3, np.uint8)
    return STORE.types[IMAGE](header=header(number), height=side, width=side, encoding='rgb8',
                              is_bigendian=0, step=3 * side, data=pixels)


def cdr(message):
    return bytes(STORE.serialize_cdr(message, message.__msgtype__))


def time_of(number):
    return 1_700_000_000_000_000_000 + number * 1_000_000


def announced(folder):
    bag = BagWriter(folder)
    bag.add_topic('/episode', HEADER, definition(HEADER), (LATCHED,))
    bag.add_topic('/camera/image_raw', IMAGE, definition(IMAGE), (SENSOR,))
    return bag


@pytest.fixture
def bag(tmp_path):
    """A bag of 20 images and 20 headers in turn, received 2 us after they were published."""
    with announced(tmp_path / 'run') as bag:
        for number in range(20):
            bag.write('/episode', cdr(header(number)), time_of(number) + 2000, time_of(number))
            bag.write('/camera/image_raw', cdr(image(number)), time_of(number) + 2001,
                      time_of(number) + 1)
    return bag


def test_rosbags_reads_every_byte_and_time_back(bag):
    with Reader(bag.folder) as reader:
        read = [(connection.topic, time, bytes(data))
                for connection, time, data in reader.messages()]
    assert read == [entry for number in range(20) for entry in (
        ('/episode', time_of(number) + 2000, cdr(header(number))),
        ('/camera/image_raw', time_of(number) + 2001, cdr(image(number))))]


def test_mcap_ros2_decodes_every_field_from_the_bags_own_definitions(bag):
    with bag.path.open('rb') as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        decoded = list(reader.iter_decoded_messages(topics=['/camera/image_raw']))
    assert len(decoded) == 20
    for number, (_, _, message, read) in enumerate(decoded):
        expected = image(number)
        assert message.publish_time == time_of(number) + 1
        assert message.log_time == time_of(number) + 2001
        assert (read.height, read.width, read.step) == (8, 8, 24)
        assert (read.encoding, read.header.frame_id) == ('rgb8', f'episode {number}')
        assert read.header.stamp.sec == expected.header.stamp.sec
        assert bytes(read.data) == expected.data.tobytes()


def test_rosbags_decodes_from_the_bags_own_definitions(bag):
    with AnyReader([bag.path]) as reader:  # the bare file, with no metadata beside
        headers = [reader.deserialize(data, connection.msgtype)
                   for connection, _, data in reader.messages()
                   if connection.topic == '/episode']
    assert [header.frame_id for header in headers] == [f'episode {n}' for n in range(20)]


def test_metadata_tells_the_publishers_qos_and_the_counts(bag):
    with Reader(bag.folder) as reader:
        profiles = {connection.topic: connection.ext.offered_qos_profiles
                    for connection in reader.connections}
        counts = {connection.topic: connection.msgcount for connection in reader.connections}
        assert (reader.message_count, reader.ros_distro) == (40, 'jazzy')
        assert reader.start_time == time_of(0) + 2000
    (latched,), (sensor,) = profiles['/episode'], profiles['/camera/image_raw']
    assert (latched.durability.name, latched.reliability.name) == ('TRANSIENT_LOCAL', 'RELIABLE')
    assert (sensor.durability.name, sensor.reliability.name) == ('VOLATILE', 'BEST_EFFORT')
    assert counts == {'/episode': 20, '/camera/image_raw': 20}


def doctor(path):
    program = Path(sys.executable).with_name('pymcap-cli')
    return subprocess.run([program, 'doctor', path], capture_output=True, text=True, timeout=60)


def test_a_checker_of_mcap_files_finds_nothing_wrong(bag):
    report = doctor(bag.path)
    assert report.returncode == 0, report.stdout + report.stderr


def test_an_empty_bag_is_a_bag(tmp_path):
    with BagWriter(tmp_path / 'empty') as bag:
        pass
    assert doctor(bag.path).returncode == 0
    with Reader(bag.folder) as reader:
        assert reader.message_count == 0


def test_a_flush_brings_what_was_written_to_the_disk_while_the_bag_goes_on(tmp_path):
    with announced(tmp_path / 'run') as bag:
        bag.write('/episode', cdr(header(3)), time_of(3), time_of(3))
        bag.flush()
        on_disk = bag.path.stat().st_size
        bag.flush()
        assert bag.path.stat().st_size == on_disk  # nothing new, nothing written
        assert on_disk > 200
        bag.write('/episode', cdr(header(4)), time_of(4), time_of(4))
    with Reader(bag.folder) as reader:
        assert reader.message_count == 2


def test_a_large_stream_reaches_the_disk_without_being_flushed(tmp_path):
    with announced(tmp_path / 'run') as bag:
        for number in range(10):
            bag.write('/camera/image_raw', cdr(image(number, 256)), time_of(number), 0)
        assert bag.path.stat().st_size > 1_000_000
    assert doctor(bag.path).returncode == 0


def test_no_bag_is_written_over_another(bag):
    before = bag.path.read_bytes()
    with pytest.raises(RecordingError, match='expected to begin a new bag.*metadata.yaml'):
        BagWriter(bag.folder)
    (bag.folder / 'metadata.yaml').unlink()
    with pytest.raises(RecordingError, match='expected to begin a new bag.*exists'):
        BagWriter(bag.folder)
    assert bag.path.read_bytes() == before


def test_a_folder_that_cannot_be_made_is_refused(tmp_path):
    (tmp_path / 'file').write_text('')
    with pytest.raises(RecordingError, match='expected to begin a new bag'):
        BagWriter(tmp_path / 'file' / 'run')


def test_what_was_not_announced_is_refused(tmp_path):
    with announced(tmp_path / 'run') as bag:
        with pytest.raises(RecordingError, match='/view: expected a topic announced'):
            bag.write('/view', b'', 0, 0)
        with pytest.raises(RecordingError, match=f'{HEADER} as before, got {IMAGE}'):
            bag.add_topic('/episode', IMAGE, definition(IMAGE))


def test_a_closed_bag_takes_nothing_and_closes_again_in_peace(bag):
    with pytest.raises(RecordingError, match='expected an open bag'):
        bag.write('/episode', cdr(header(0)), 0, 0)
    bag.close()


@pytest.fixture
def small_disk():
    """Files end at 100 kB here, and say so as a full disk does."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, before[1]))
    yield
    resource.setrlimit(resource.RLIMIT_FSIZE, before)


def test_a_full_disk_ends_the_bag_after_its_last_chunk(tmp_path, small_disk):
    bag = announced(tmp_path / 'run')
    flushed = 0
    with pytest.raises(RecordingError, match='the disk took no more') as refusal:
        for number in range(100):
            bag.write('/camera/image_raw', cdr(image(number, 64)), time_of(number), 0)
            bag.flush()
            flushed += 1
    assert refusal.value.kind == 'disk_full'
    assert 5 < flushed < 9  # 12 kB each, which do not compress
    bag.close()  # the refusal has closed it: no second error
    for path in (bag.folder, bag.path):
        with AnyReader([path]) as reader:
            read = [bytes(data) for _, _, data in reader.messages()]
        assert read == [cdr(image(number, 64)) for number in range(flushed)]
    assert doctor(bag.path).returncode == 0


def test_a_disk_that_fills_while_the_bag_is_closed_is_told(tmp_path, small_disk):
    bag = announced(tmp_path / 'run')
    bag.write('/camera/image_raw', cdr(image(0, 256)), time_of(0), 0)
    with pytest.raises(RecordingError, match='ends after 0 messages, 1 were lost'):
        bag.close()
    with AnyReader([bag.path]) as reader:
        assert reader.message_count == 0
