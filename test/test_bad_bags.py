"""Bags that are none, damaged or that lie: one clear error each, and no memory for a claim."""

import struct
import tracemalloc

from active_recon.bags.runs.reading import read_run
from active_recon.bags.storage import compression
from active_recon.errors import DataError
from command_line import command
from foreign_recordings import images, joints, transforms
from loop_bags import BEGIN, LoopRun, type_name, write_bag
from mcap.opcode import Opcode
from mcap.writer import CompressionType
from mcap.writer import Writer as McapWriter
import numpy as np
import pytest
from rclpy.serialization import serialize_message
from recorded_messages import definition, IMAGE, STORE
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from test_reading import copied, same
import zstandard

RUN = LoopRun()


@pytest.fixture(scope='module')
def bag(tmp_path_factory):
    return write_bag(tmp_path_factory.mktemp('bags') / 'run', RUN.messages)


def mcap(path, definitions=definition, compression=CompressionType.NONE, chunked=False,
         messages=RUN.messages):
    """Write an MCAP file of the run by hand."""
    with path.open('wb') as file:
        writer = McapWriter(file, use_chunking=chunked, compression=compression)
        writer.start('ros2', 'a test')
        channels = {}
        for time, topic, msg in messages:
            if topic not in channels:
                schema = writer.register_schema(
                    type_name(msg), 'ros2msg', definitions(type_name(msg)).encode())
                channels[topic] = writer.register_channel(topic, 'cdr', schema)
            writer.add_message(channels[topic], time, serialize_message(msg), time)
        writer.finish()
    return path


def refusal(path, match):
    """Return the one error that a bag is refused with; what was there is untouched."""
    files = [path, *path.rglob('*')] if path.is_dir() else [path]
    before = {file: file.read_bytes() for file in files if file.is_file()}
    with pytest.raises(DataError, match=match) as refused:
        read_run(path)
    assert '\n' not in str(refused.value)
    assert str(path) in str(refused.value)
    after = {file: file.read_bytes() for file in files if file.is_file()}
    assert after == before
    return refused.value


@pytest.mark.parametrize('content', [b'', b'hello', b'\x89PNG\r\n\x1a\n' + bytes(100)])
def test_what_is_no_bag_is_refused(tmp_path, content):
    for name in ('bag.mcap', 'bag.db3', 'bag'):
        (tmp_path / name).write_bytes(content)
        refusal(tmp_path / name,
                'no readable rosbag2 bag|no MCAP|its end is missing|cannot be understood')


def test_a_file_cut_off_anywhere_is_refused_and_the_repair_named(bag, tmp_path):
    whole = (bag / 'run_0.mcap').read_bytes()
    for length in range(9, len(whole), len(whole) // 50):
        (tmp_path / 'cut.mcap').write_bytes(whole[:length])
        refusal(tmp_path / 'cut.mcap', 'active-recon bag repair')


def test_a_chunk_with_one_wrong_bit_is_refused(bag, tmp_path):
    content = bytearray((bag / 'run_0.mcap').read_bytes())
    content[len(content) // 3] ^= 4
    (tmp_path / 'bit.mcap').write_bytes(content)
    refusal(tmp_path / 'bit.mcap', 'repair|cannot be understood')


def peak(path, match):
    """Return the most bytes that were taken while a bag was refused."""
    tracemalloc.start()
    try:
        refusal(path, match)
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def first_record(content, opcode):
    """Return where the first record of that kind begins."""
    position = 8
    while content[position] != opcode:
        position += 9 + struct.unpack_from('<Q', content, position + 1)[0]
    return position


@pytest.mark.parametrize('claim', [2**31, 2**40, 2**63])
def test_a_message_that_claims_gigabytes_takes_none(tmp_path, claim):
    content = bytearray(mcap(tmp_path / 'bag.mcap').read_bytes())
    struct.pack_into('<Q', content, first_record(content, Opcode.MESSAGE) + 1, claim)
    (tmp_path / 'bag.mcap').write_bytes(content)
    assert peak(tmp_path / 'bag.mcap', f'claims {claim} bytes') < 30_000_000


@pytest.mark.parametrize('claim', [
    *(pytest.param(claim, marks=pytest.mark.slow) for claim in (1000, 2**27)), 2**40])
def test_a_chunk_that_decompresses_to_gigabytes_takes_none(tmp_path, claim):
    """A chunk of 64 kB that is 2 GB of zeros, whatever it claims to be."""
    packer = zstandard.ZstdCompressor().compressobj()
    packed = b''.join(packer.compress(bytes(1 << 24)) for _ in range(128)) + packer.flush()
    content = mcap(tmp_path / 'bag.mcap').read_bytes()
    chunk = struct.pack('<QQQI', 0, 0, claim, 0) + struct.pack('<I4sQ', 4, b'zstd', len(packed))
    record = struct.pack('<BQ', Opcode.CHUNK, len(chunk) + len(packed)) + chunk + packed
    at = first_record(content, Opcode.SCHEMA)
    (tmp_path / 'bag.mcap').write_bytes(content[:at] + record + content[at:])
    assert peak(tmp_path / 'bag.mcap', '(damaged chunk|chunk too large)') < 2.5 * 2**27


def bomb(size):
    """Return so many zeros as a few bytes of zstd."""
    packer = zstandard.ZstdCompressor().compressobj()
    return b''.join(packer.compress(bytes(1 << 20)) for _ in range(size >> 20)) + packer.flush()


@pytest.mark.parametrize('storage', list(StoragePlugin))
def test_a_compressed_message_that_decompresses_to_much_more_takes_no_memory(
        tmp_path, monkeypatch, storage):
    monkeypatch.setattr(compression, 'MAX_RECORD_BYTES', 1 << 22)
    rosbag2 = Writer(tmp_path / 'run', version=9, storage_plugin=storage)
    rosbag2.set_compression(CompressionMode.MESSAGE, CompressionFormat.ZSTD)
    with rosbag2:
        connection = rosbag2.add_connection('/camera/image_raw', IMAGE, typestore=STORE)
        rosbag2.write(connection, BEGIN, bytes(1 << 26))
    assert peak(tmp_path / 'run', 'message too large: .* decompress to more') < 2**24


def test_a_compressed_message_that_is_cut_off_is_refused():
    whole = bytes(range(256)) * 2000
    packed = zstandard.ZstdCompressor().compress(whole)
    files = compression.StoredFiles([], 'message')
    assert files.decompressed_message(packed) == whole
    with pytest.raises(DataError, match='damaged message: expected 512000 bytes'):
        files.decompressed_message(packed[:-40])


@pytest.mark.parametrize('storage', list(StoragePlugin))
def test_a_compressed_file_that_decompresses_to_gigabytes_fills_no_disk(
        bag, tmp_path, monkeypatch, storage):
    monkeypatch.setattr(compression, 'MAX_RECORD_BYTES', 1 << 24)
    copy = copied(bag, tmp_path / 'copy', storage, CompressionMode.FILE)
    (packed,) = copy.glob('*.zstd')
    packed.write_bytes(bomb(1 << 28))
    assert peak(copy, 'decompresses to more than') < 2**24


@pytest.mark.parametrize('mode', [CompressionMode.FILE, CompressionMode.MESSAGE])
@pytest.mark.parametrize('storage', list(StoragePlugin))
def test_files_not_compressed_as_metadata_yaml_states_are_refused(bag, tmp_path, storage, mode):
    copy = copied(bag, tmp_path / 'copy', storage)
    description = copy / 'metadata.yaml'
    description.write_text(description.read_text().replace(
        "compression_mode: ''", f'compression_mode: {mode.name}'))
    assert mode.name in description.read_text()
    refusal(copy, 'expected zstd compression')


@pytest.mark.parametrize('compression', list(CompressionType))
def test_chunks_are_read_however_they_are_compressed(bag, tmp_path, compression):
    path = mcap(tmp_path / 'bag.mcap', compression=compression, chunked=True)
    assert same(read_run(path), read_run(bag))


def test_a_definition_that_is_not_ros_own_is_refused(tmp_path):
    def lying(name):
        return definition(name).replace('uint32 height', 'uint64 height')

    refusal(mcap(tmp_path / 'bag.mcap', lying), 'its fields differ from those in ROS')


def test_bytes_of_another_type_than_the_schemas_are_refused(tmp_path):
    lying = tmp_path / 'bag.mcap'
    with lying.open('wb') as file:
        writer = McapWriter(file)
        writer.start('ros2', 'a test')
        for topic, name in (('/camera/image_raw', 'sensor_msgs/msg/Image'),
                            ('/camera/pose', 'geometry_msgs/msg/PoseStamped')):
            schema = writer.register_schema(name, 'ros2msg', definition(name).encode())
            channel = writer.register_channel(topic, 'cdr', schema)
            writer.add_message(channel, BEGIN, serialize_message(RUN.messages[0][2]), BEGIN)
        writer.finish()
    refusal(lying, 'bytes are no geometry_msgs/msg/PoseStamped')


def test_a_bag_without_images_is_refused(tmp_path):
    refusal(write_bag(tmp_path / 'run', joints()), 'no camera images on any topic')


def test_images_without_an_azimuth_are_refused(tmp_path):
    refusal(write_bag(tmp_path / 'run', images()), 'no camera poses or azimuths on any topic')


def test_transforms_without_the_objects_frame_are_refused_with_those_that_there_are(tmp_path):
    refusal(write_bag(tmp_path / 'run', [*images(), *transforms('world')]),
            "have no frame 'object'; there are camera, tool0, world: name the object's with "
            '--object-frame, and with --object-position where')


def test_transforms_that_do_not_connect_the_camera_are_refused(tmp_path):
    apart = [*images(), *transforms(camera='wrist_camera'), *transforms(camera='other', tool='x')]
    refusal(write_bag(tmp_path / 'run', sorted(apart, key=lambda entry: entry[0])),
            "have no frame 'camera'; there are object, other, tool0, wrist_camera, x: name")


def test_images_whose_poses_are_of_another_time_are_refused(tmp_path):
    later = LoopRun(begin=BEGIN + 10**12)
    entries = [*images(topic='/camera/image_raw'), *(
        entry for entry in later.messages if entry[1] in ('/camera/pose', '/camera/camera_info'))]
    refusal(write_bag(tmp_path / 'run', entries), 'no image has a known camera: .*pose')


def test_an_image_that_is_older_than_the_last_is_left_out_and_counted(tmp_path):
    first, second, *rest = images()
    swapped = write_bag(tmp_path / 'run', [second, first, *rest, *joints()], one_by_one=True)
    in_order = read_run(write_bag(tmp_path / 'other', [second, *rest, *joints()],
                                  one_by_one=True))
    run = read_run(swapped)
    assert run.counters['bag']['refused/out_of_order'] == 1
    assert [view.stamp for view in run.episodes[0].views] == [
        view.stamp for view in in_order.episodes[0].views]


def test_images_of_a_loop_are_found_by_their_stamps_in_whatever_order_they_came(bag, tmp_path):
    ours = [entry for entry in RUN.messages if entry[1] != '/camera/image_raw']
    pictures = [entry for entry in RUN.messages if entry[1] == '/camera/image_raw']
    turned = write_bag(tmp_path / 'ours', [*ours, *reversed(pictures)], one_by_one=True)
    [episode], [expected] = (read_run(each).episodes for each in (turned, bag))
    assert [view.stamp for view in episode.views] == RUN.stamps
    for view, true in zip(episode.views, expected.views, strict=True):
        np.testing.assert_array_equal(view.image, true.image)
        np.testing.assert_array_equal(view.camera.pose, true.camera.pose)


def test_a_view_whose_image_was_lost_is_named(tmp_path):
    lost = [entry for entry in RUN.messages
            if not (entry[1] == '/camera/image_raw' and entry[0] - 3 == RUN.stamps[1])]
    refusal(write_bag(tmp_path / 'run', lost), 'view 2 .*the image was not recorded')


@pytest.mark.parametrize(('text', 'match'), [
    ('{', 'invalid YAML'), ('[1, 2]', 'expected a mapping, got a list'),
    ('a: 1', "not rosbag2's description"),
    ('a: &a [x, x]\nb: [*a, *a]', 'invalid YAML: aliases'),
    ('[' * 200_000, 'invalid YAML: nested too deep'),
    ('rosbag2_bagfile_information: {storage_identifier: mcap, relative_file_paths: [x.mcap]}',
     'x.mcap: missing'),
    ('rosbag2_bagfile_information: {storage_identifier: sqlite4, relative_file_paths: []}',
     "got 'sqlite4'")])
def test_a_folder_whose_description_is_none_is_refused(tmp_path, text, match):
    (tmp_path / 'run').mkdir()
    (tmp_path / 'run' / 'metadata.yaml').write_text(text)
    refusal(tmp_path / 'run', match)


def test_a_damaged_database_is_refused(bag, tmp_path):
    copy = copied(bag, tmp_path / 'copy', StoragePlugin.SQLITE3)
    content = (copy / 'copy.db3').read_bytes()
    (copy / 'copy.db3').write_bytes(content[:len(content) // 2])
    refusal(copy, 'no readable rosbag2 bag')


def test_the_command_ends_with_one_line_and_exit_code_2(tmp_path, monkeypatch, capsys):
    (tmp_path / 'bag.mcap').write_bytes(b'hello')
    assert command(monkeypatch, 'bag', 'info', tmp_path / 'bag.mcap') == 2
    assert capsys.readouterr().err.count('\n') == 1
