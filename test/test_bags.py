"""Bags: what is written is what readers that we did not write read."""

import os

from active_recon.bags.storage import writer
from active_recon.bags.storage.files import numbered_files
from active_recon.bags.storage.opening import open_bag
from active_recon.bags.storage.writer import BagWriter
from active_recon.errors import RecordingError
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
import pytest
from recorded_messages import (
    announced,
    cdr,
    definition,
    doctor,
    errors_in,
    HEADER,
    header,
    IMAGE,
    image,
    small_disk,
    time_of,
)
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import Reader
import yaml


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


def test_a_checker_of_mcap_files_finds_nothing_wrong(bag):
    report = doctor(bag.path)
    assert report.returncode == 0, report.stdout + report.stderr


def test_an_empty_bag_is_a_bag(tmp_path):
    with BagWriter(tmp_path / 'empty') as bag:
        pass
    assert not errors_in(bag.path)
    with Reader(bag.folder) as reader:
        assert reader.message_count == 0


def test_a_bag_whose_topics_said_nothing_is_a_bag(tmp_path):
    with announced(tmp_path / 'run') as bag:
        bag.flush()
    for path in (bag.folder, bag.path):
        with AnyReader([path]) as reader:
            assert reader.message_count == 0
    assert not errors_in(bag.path)


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
    assert not errors_in(bag.path)


def test_no_bag_is_written_over_another(bag):
    before = bag.path.read_bytes()
    with pytest.raises(RecordingError, match='cannot start a bag.*already holds'):
        BagWriter(bag.folder)
    (bag.folder / 'metadata.yaml').unlink()
    with pytest.raises(RecordingError, match='cannot start a bag.*already holds'):
        BagWriter(bag.folder)
    assert bag.path.read_bytes() == before


def test_bytes_that_are_not_of_utf_8_leave_a_bag_readable_and_name_none(tmp_path):
    bad = os.fsdecode(b'mug\xff')
    with announced(tmp_path / 'run') as bag:
        bag.add_provenance({'replay_of': bad})
        bag.attach_parameters('/turntable_camera', {'mesh': bad})
    summary = open_bag(bag.folder).summary()
    assert summary.provenance['replay_of'] == summary.parameters['turntable_camera']['mesh']
    assert summary.provenance['replay_of'].startswith('mug')
    with pytest.raises(RecordingError, match='of UTF-8'):
        announced(tmp_path / bad)


def test_a_folder_that_cannot_be_made_is_refused(tmp_path):
    (tmp_path / 'file').write_text('')
    with pytest.raises(RecordingError, match='cannot start a bag'):
        BagWriter(tmp_path / 'file' / 'run')


def test_what_was_not_announced_is_refused(tmp_path):
    with announced(tmp_path / 'run') as bag:
        with pytest.raises(RecordingError, match='/view: unknown topic'):
            bag.write('/view', b'', 0, 0)
        with pytest.raises(RecordingError, match=f'{HEADER} as before, got {IMAGE}'):
            bag.add_topic('/episode', IMAGE, definition(IMAGE))


def test_a_closed_bag_takes_nothing_and_closes_again_in_peace(bag):
    with pytest.raises(RecordingError, match='the bag is closed'):
        bag.write('/episode', cdr(header(0)), 0, 0)
    bag.close()


def metadata_records(path):
    with path.open('rb') as stream:
        return [(record.name, record.metadata) for record in make_reader(stream).iter_metadata()]


def attachments(path):
    with path.open('rb') as stream:
        return {attachment.name: (attachment.media_type, yaml.safe_load(attachment.data))
                for attachment in make_reader(stream).iter_attachments()}


def test_provenance_and_parameters_stand_in_the_file_and_grow(tmp_path):
    with announced(tmp_path / 'run') as bag:
        bag.add_provenance({'version': '1'})
        bag.attach_parameters('/arm/view_planner', {'policy': 'random', 'distance': float('nan')})
        bag.add_provenance({'policy': 'random'})
        bag.write('/episode', cdr(header(0)), time_of(0), time_of(0))
    ours = [record for name, record in metadata_records(bag.path) if name == 'active_recon']
    assert ours == [{'version': '1'}, {'version': '1', 'policy': 'random'}]
    (media_type, parameters), = attachments(bag.path).values()
    assert list(attachments(bag.path)) == ['parameters/arm/view_planner.yaml']
    assert media_type == 'application/yaml'
    assert parameters['policy'] == 'random' and parameters['distance'] != parameters['distance']
    assert not errors_in(bag.path)


def test_a_long_bag_is_split_by_size_and_read_as_one(tmp_path):
    with announced(tmp_path / 'run', max_bytes=50_000) as bag:
        bag.attach_parameters('/view_planner', {'seed': 3})
        for number in range(20):
            bag.write('/camera/image_raw', cdr(image(number, 64)), time_of(number), 0)
            bag.add_provenance({'seed': '3'})
    files = [bag.folder / f'run_{number}.mcap' for number in range(5)]
    assert sorted(bag.folder.glob('*.mcap')) == files
    assert all(50_000 <= file.stat().st_size < 70_000 for file in files[:-1])
    with Reader(bag.folder) as reader:
        assert reader.message_count == 20
        assert [bytes(data) for _, _, data in reader.messages()] == [
            cdr(image(number, 64)) for number in range(20)]
    information = yaml.safe_load((bag.folder / 'metadata.yaml').read_text())
    assert [(file['path'], file['message_count'])
            for file in information['rosbag2_bagfile_information']['files']] == [
        (file.name, 4) for file in files]
    for file in files:
        assert not errors_in(file)
        assert attachments(file) == {
            'parameters/view_planner.yaml': ('application/yaml', {'seed': 3})}
        assert ('active_recon', {'seed': '3'}) in metadata_records(file)


def test_a_bag_of_many_chunks_is_split_so_that_their_index_stays_small(tmp_path, monkeypatch):
    monkeypatch.setattr(writer, 'MAX_CHUNKS', 5)
    with announced(tmp_path / 'run') as bag:
        for number in range(12):
            bag.write('/episode', cdr(header(number)), time_of(number), time_of(number))
            bag.flush()
            bag.flush()
    assert len(list(bag.folder.glob('*.mcap'))) == 3
    assert open_bag(bag.folder).summary().topics[0].count == 12


def test_each_file_of_a_split_bag_begins_with_what_is_latched_and_counts_once(tmp_path):
    with announced(tmp_path / 'run', max_bytes=50_000) as bag:
        bag.write('/episode', cdr(header(0)), time_of(0), time_of(0))
        for number in range(1, 21):
            bag.write('/camera/image_raw', cdr(image(number, 64)), time_of(number), 0)
            if number == 10:
                bag.write('/episode', cdr(header(10)), time_of(10), time_of(10))
            bag.flush()
    files = numbered_files(bag.folder)
    assert len(files) > 3
    for file in files:
        first = next(open_bag(file).messages({'/episode'}))
        shown = next(open_bag(file).messages({'/camera/image_raw'}))
        episode = 10 if shown.received > time_of(10) else 0
        assert (first.data, first.published) == (cdr(header(episode)), time_of(episode))
        begin = open_bag(file).summary().begin
        assert first.received == begin
        assert not errors_in(file)
    read = list(open_bag(bag.folder).messages({'/episode', '/camera/image_raw'}))
    assert [message.data for message in read if message.topic == '/episode'] == [
        cdr(header(0)), cdr(header(10))]
    assert len(read) == 22 == bag.message_count


def test_a_disk_that_is_full_where_a_file_is_split_leaves_the_files_before(tmp_path):
    bag = announced(tmp_path / 'run', max_bytes=20_000)
    bag.write('/episode', cdr(header(0)), time_of(0), time_of(0))
    bag.write('/camera/image_raw', cdr(image(1, 90)), time_of(1), 0)
    bag.flush()
    with small_disk(3_000), pytest.raises(RecordingError, match='ends after 2 messages, 1 were'):
        bag.write('/camera/image_raw', cdr(image(2, 90)), time_of(2), 0)
    assert [file.name for file in numbered_files(bag.folder)] == ['run_0.mcap']
    with Reader(bag.folder) as reader:
        assert reader.message_count == 2
