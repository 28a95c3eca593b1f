"""Repair: a bag that was cut off is whole again, and nothing of it is thrown away."""

import hashlib
import random
import re
import subprocess
import sys

from active_recon.bags.storage import repair as repair_module
from active_recon.bags.storage.opening import open_bag
from active_recon.bags.storage.repair import repair_bag
from active_recon.bags.storage.writer import BagWriter
from active_recon.batch.finding import is_bag_folder
from active_recon.errors import DataError
from mcap.opcode import Opcode
from mcap.reader import make_reader
import pytest
from recorded_messages import (
    announced,
    cdr,
    definition,
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
from zstandard import ZstdCompressor

CHUNKS, IN_CHUNK = 8, 5


def message(number):
    return cdr(image(number)) if number % 2 else cdr(header(number))


def fill(bag):
    """Write chunks of messages in turn, and leave the bag open."""
    bag.add_provenance({'seed': '7'})
    bag.attach_parameters('/view_planner', {'seed': 7})
    for number in range(CHUNKS * IN_CHUNK):
        topic = '/camera/image_raw' if number % 2 else '/episode'
        bag.write(topic, message(number), time_of(number), time_of(number))
        if number % IN_CHUNK == IN_CHUNK - 1:
            bag.flush()
    return bag


@pytest.fixture
def cut_off(tmp_path):
    """A bag whose writer ended without closing it."""
    bag = fill(announced(tmp_path / 'run'))
    bag._file.abandon()
    return bag.folder


def read(folder):
    with Reader(folder) as reader:
        return [bytes(data) for _, _, data in reader.messages()]


def state(folder):
    """Return what stands in a folder, byte for byte."""
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in folder.iterdir()}


def assert_whole(folder):
    for path in folder.glob('*.mcap'):
        assert not errors_in(path)
        with path.open('rb') as stream:
            summary = make_reader(stream).get_summary()
        assert summary.statistics.message_count == 0 or summary.chunk_indexes
        with AnyReader([path]) as reader:
            assert reader.message_count == summary.statistics.message_count
    before = state(folder)
    repairs, described = repair_bag(folder)
    assert not described and all(repair.kept_as is None for repair in repairs)
    assert state(folder) == before


def test_a_bag_that_was_cut_off_is_as_if_it_had_been_closed(cut_off, tmp_path):
    (repair,), described = repair_bag(cut_off)
    assert described and not repair.lost
    assert read(cut_off) == [message(number) for number in range(CHUNKS * IN_CHUNK)]
    closed = fill(announced(tmp_path / 'closed' / 'run'))
    closed.close()
    assert (cut_off / 'metadata.yaml').read_text() == (
        closed.folder / 'metadata.yaml').read_text()
    with (cut_off / 'run_0.mcap').open('rb') as stream:
        reader = make_reader(stream)
        assert [record.metadata for record in reader.iter_metadata()
                if record.name == 'active_recon'] == [{'seed': '7'}]
        assert [each.name for each in reader.iter_attachments()] == [
            'parameters/view_planner.yaml']
    assert_whole(cut_off)


def test_the_file_as_it_was_is_kept(cut_off):
    before = (cut_off / 'run_0.mcap').read_bytes()
    repair_bag(cut_off)
    assert (cut_off / 'run_0.mcap.damaged').read_bytes() == before
    assert {path.name for path in cut_off.iterdir()} == {
        'run_0.mcap', 'run_0.mcap.damaged', 'metadata.yaml'}


def test_a_whole_bag_is_not_touched(tmp_path):
    with announced(tmp_path / 'run') as bag:
        fill(bag)
    assert_whole(bag.folder)


@pytest.mark.parametrize('seed', range(12))
def test_wherever_the_file_is_cut_all_chunks_before_it_are_kept(cut_off, seed):
    path = cut_off / 'run_0.mcap'
    whole = path.read_bytes()
    cut = random.Random(seed).randrange(len(whole))
    path.write_bytes(whole[:cut])
    (repair,), _ = repair_bag(cut_off)
    kept = read(cut_off)
    assert kept == [message(number) for number in range(len(kept))]
    assert len(kept) % IN_CHUNK == 0
    assert len(kept) >= IN_CHUNK * (whole[:cut].count(b'zstd') - 1)
    assert repair.contents.counts.total() == len(kept)
    assert_whole(cut_off)


@pytest.mark.parametrize('spoilt', [40, 0, -4], ids=['content', 'name', 'length'])
def test_a_chunk_that_is_spoilt_anywhere_costs_no_other(cut_off, spoilt):
    path = cut_off / 'run_0.mcap'
    content = bytearray(path.read_bytes())
    third = [at for at in range(len(content)) if content[at:at + 4] == b'zstd'][2]
    content[third + spoilt] ^= 255
    path.write_bytes(content)
    (repair,), _ = repair_bag(cut_off)
    assert len(repair.lost) == 1 and re.match('a (chunk|record) of', repair.lost[0])
    assert read(cut_off) == [message(number) for number in range(CHUNKS * IN_CHUNK)
                             if number // IN_CHUNK != 2]
    assert_whole(cut_off)


def test_of_a_bag_with_an_index_a_spoilt_first_chunk_costs_no_other(tmp_path):
    with announced(tmp_path / 'run') as bag:
        fill(bag)
    content = bytearray(bag.path.read_bytes())
    content[content.index(b'zstd') + 40] ^= 255
    bag.path.write_bytes(content)
    (repair,), _ = repair_bag(bag.folder)
    assert len(repair.lost) == 1 and 'a chunk of' in repair.lost[0]
    with Reader(bag.folder) as reader:
        heard = [(each.topic, each.msgtype, bytes(data)) for each, _, data in reader.messages()]
    kinds = ('/episode', HEADER), ('/camera/image_raw', IMAGE)
    assert heard == [(*kinds[number % 2], message(number))
                     for number in range(IN_CHUNK, CHUNKS * IN_CHUNK)]
    assert_whole(bag.folder)


@pytest.mark.parametrize('kind', [Opcode.MESSAGE_INDEX, 0x86, 0x46])
def test_a_chunk_that_is_no_longer_known_as_one_is_missed_and_costs_no_other(tmp_path, kind):
    with announced(tmp_path / 'run') as bag:
        fill(bag)
    content = bytearray(bag.path.read_bytes())
    third = [at for at in range(len(content)) if content[at:at + 4] == b'zstd'][2]
    begin = third - 4 - 28 - 9
    assert content[begin] == Opcode.CHUNK
    content[begin] = kind
    bag.path.write_bytes(content)
    with pytest.raises(DataError, match='it lacks 1 of the chunks that its index counts'):
        open_bag(bag.folder).summary()
    (repair,), _ = repair_bag(bag.folder)
    assert repair.kept_as and repair.lost == ['1 of the chunks that its index counts']
    assert read(bag.folder) == [message(number) for number in range(CHUNKS * IN_CHUNK)
                                if number // IN_CHUNK != 2]
    assert_whole(bag.folder)


@pytest.mark.parametrize('byte', range(8))
def test_a_spoilt_length_costs_one_chunk_of_a_bag_with_an_index(tmp_path, byte):
    with announced(tmp_path / 'run') as bag:
        fill(bag)
    content = bytearray(bag.path.read_bytes())
    third = [at for at in range(len(content)) if content[at:at + 4] == b'zstd'][2]
    content[third - 4 - 28 - 8 + byte] ^= 1
    bag.path.write_bytes(content)
    with pytest.raises(DataError, match='bag repair'):
        open_bag(bag.folder).summary()
    (repair,), _ = repair_bag(bag.folder)
    assert repair.lost
    # Its own, or the next if it claims that one too
    assert read(bag.folder) in [[message(number) for number in range(CHUNKS * IN_CHUNK)
                                 if number // IN_CHUNK != lost] for lost in (2, 3)]
    assert_whole(bag.folder)


def test_a_spoilt_summary_changes_nothing_of_a_bag_that_is_repaired(tmp_path):
    with announced(tmp_path / 'run') as bag:
        fill(bag)
    content = bytearray(bag.path.read_bytes())
    content[content.rindex(b'/episode')] ^= 1
    second = content.index(b'zstd', content.index(b'zstd') + 1)
    content[second + 40] ^= 255  # a file without a loss is left as it is
    bag.path.write_bytes(content)
    repair_bag(bag.folder)
    with Reader(bag.folder) as reader:
        assert set(reader.topics) == {'/episode', '/camera/image_raw'}
    assert_whole(bag.folder)


def test_parameters_with_a_wrong_bit_are_refused_and_their_loss_in_a_repair_is_told(cut_off):
    path = cut_off / 'run_0.mcap'
    path.write_bytes(path.read_bytes().replace(b'seed: 7', b'seed: 6'))
    with pytest.raises(DataError, match='damaged attachment'):
        open_bag(cut_off).summary()
    (repair,), _ = repair_bag(cut_off)
    assert len(repair.lost) == 1 and 'damaged attachment' in repair.lost[0]
    assert not open_bag(cut_off).summary().parameters
    assert read(cut_off) == [message(number) for number in range(CHUNKS * IN_CHUNK)]


def test_of_a_split_bag_only_the_file_that_was_cut_off_is_written_anew(tmp_path):
    bag = announced(tmp_path / 'run', max_bytes=40_000)
    sent = [cdr(image(number, 64)) for number in range(10)]
    for number, data in enumerate(sent):
        bag.write('/camera/image_raw', data, time_of(number), 0)
        bag.flush()
    bag._file.abandon()
    repairs, described = repair_bag(bag.folder)
    assert [repair.kept_as is None for repair in repairs] == [True, True, False]
    assert described and read(bag.folder) == sent
    assert_whole(bag.folder)


def test_a_lost_metadata_yaml_comes_back_and_one_that_lies_is_replaced(tmp_path):
    with announced(tmp_path / 'run') as bag:
        fill(bag)
    metadata = bag.folder / 'metadata.yaml'
    right = metadata.read_text()
    metadata.unlink()
    assert repair_bag(bag.folder)[1] and metadata.read_text() == right
    for wrong in (right.replace('message_count: 20', 'message_count: 19'), '', 'a: [b', '\x00'):
        metadata.write_text(wrong)
        assert repair_bag(bag.folder)[1] and metadata.read_text() == right
    assert len(list(bag.folder.glob('metadata.yaml.damaged*'))) == 4


def test_a_bag_that_is_being_recorded_is_refused(tmp_path):
    with announced(tmp_path / 'run') as bag:
        fill(bag)
        before = state(bag.folder)
        with pytest.raises(DataError, match='still being recorded'):
            repair_bag(bag.folder)
        assert state(bag.folder) == before


def test_a_bag_that_grows_while_it_is_repaired_is_refused(cut_off, monkeypatch):
    path = cut_off / 'run_0.mcap'

    def surveyed(found):
        with path.open('ab') as recorder:  # without a lock, as rosbag2
            recorder.write(b'more')
        return survey(found)

    survey = repair_module._survey
    monkeypatch.setattr(repair_module, '_survey', surveyed)
    with pytest.raises(DataError, match='run_0.mcap: still being recorded'):
        repair_bag(cut_off)
    assert [each.name for each in cut_off.iterdir()] == [path.name]


@pytest.mark.parametrize('content', [b'no MCAP at all', b'\0' * 1000, b'\x89MCAP1'])
def test_what_is_no_mcap_is_refused_and_left_alone(cut_off, content):
    (cut_off / 'run_1.mcap').write_bytes(content)
    before = state(cut_off)
    with pytest.raises(DataError, match='run_1.mcap: no MCAP file'):
        repair_bag(cut_off)
    assert state(cut_off) == before


def test_a_folder_without_a_bag_is_refused(tmp_path):
    with pytest.raises(DataError, match='no bag there'):
        repair_bag(tmp_path)
    with pytest.raises(DataError, match='no bag there'):
        repair_bag(tmp_path / 'nowhere')


def test_a_disk_too_full_for_the_repair_leaves_all_as_it_was(tmp_path):
    bag = announced(tmp_path / 'run')
    for number in range(20):
        bag.write('/camera/image_raw', cdr(image(number, 64)), time_of(number), 0)
    bag.flush()
    bag._file.abandon()
    before = state(bag.folder)
    with small_disk(100_000), pytest.raises(DataError, match='File too large'):
        repair_bag(bag.folder)
    assert state(bag.folder) == before


def test_a_disk_that_fills_on_the_way_tells_what_was_repaired_until_then(cut_off):
    first, second = cut_off / 'run_0.mcap', cut_off / 'run_1.mcap'
    second.write_bytes(first.read_bytes())
    content = first.read_bytes()
    first.write_bytes(content[:content.rindex(b'zstd')])
    with small_disk(len(content)), pytest.raises(DataError, match='only run_0.mcap was repaired'):
        repair_bag(cut_off)
    assert not errors_in(first) and second.read_bytes() == content


def test_a_metadata_yaml_for_which_there_is_no_room_stays_as_it_was(tmp_path):
    with announced(tmp_path / 'run') as bag:
        fill(bag)
    metadata = bag.folder / 'metadata.yaml'
    metadata.write_text('a: b')
    with small_disk(100), pytest.raises(DataError, match='nothing was changed'):
        repair_bag(bag.folder)
    assert metadata.read_text() == 'a: b'


def test_the_command_says_what_it_did_and_refuses_in_one_line(cut_off, tmp_path):
    def run(path):
        return subprocess.run([sys.executable, '-m', 'active_recon.cli.main', 'bag', 'repair',
                               str(path)], capture_output=True, text=True, timeout=600)

    done = run(cut_off)
    assert done.returncode == 0, done.stderr
    assert 'run_0.mcap: repaired, 40 messages; original kept as run_0.mcap.damaged' in (
        done.stdout)
    assert 'run_0.mcap: intact, 40 messages' in run(cut_off).stdout
    refused = run(tmp_path / 'nowhere')
    assert refused.returncode == 2
    assert refused.stderr.count('\n') == 1 and 'no bag there' in refused.stderr


def test_what_macos_leaves_beside_the_files_of_a_bag_is_none_of_them(cut_off):
    left = b'\0\5\26\7\0\2\0\0Mac OS X'
    for name in ('._run_0.mcap', '._run_0.mcap.zstd'):
        (cut_off / name).write_bytes(left)
    assert is_bag_folder(cut_off, [path.name for path in cut_off.iterdir()])
    assert sum(topic.count for topic in open_bag(cut_off).summary().topics) == CHUNKS * IN_CHUNK
    (repair,), _ = repair_bag(cut_off)
    assert repair.kept_as and (cut_off / '._run_0.mcap').read_bytes() == left


def test_what_only_the_recorder_knew_of_the_bag_is_kept(cut_off):
    metadata = cut_off / 'metadata.yaml'
    with announced(cut_off.parent / 'whole') as bag:
        fill(bag)
    said = (bag.folder / 'metadata.yaml').read_text().replace(
        "compression_format: ''", 'compression_format: zstd').replace(
        "compression_mode: ''", 'compression_mode: MESSAGE').replace(
        'message_count: 20', 'message_count: 19')
    metadata.write_text(said)
    assert repair_bag(cut_off)[1]
    assert 'compression_mode: MESSAGE' in metadata.read_text()
    assert 'compression_format: zstd' in metadata.read_text()


def test_a_bag_of_packed_messages_is_described_as_such(cut_off):
    folder = cut_off.parent / 'packed'
    with BagWriter(folder) as bag:
        bag.add_topic('/episode', HEADER, definition(HEADER))
        bag.write('/episode', ZstdCompressor().compress(cdr(header(0))), time_of(0), time_of(0))
    (folder / 'metadata.yaml').unlink()
    assert repair_bag(folder)[1]
    assert 'compression_mode: MESSAGE' in (folder / 'metadata.yaml').read_text()
    assert 'compression_format: zstd' in (folder / 'metadata.yaml').read_text()
    (message,) = open_bag(folder).messages(['/episode'])
    assert message.data == cdr(header(0))


@pytest.mark.parametrize('listed', ['run_0.mcap.zstd', 'run_0.mcap'])
def test_a_bag_whose_files_were_unpacked_is_no_longer_described_as_packed(tmp_path, listed):
    with announced(tmp_path / 'run') as bag:
        fill(bag)
    metadata = bag.folder / 'metadata.yaml'
    right = metadata.read_text()
    metadata.write_text(right.replace('run_0.mcap', listed).replace(
        "compression_format: ''", 'compression_format: zstd').replace(
        "compression_mode: ''", 'compression_mode: FILE'))
    assert repair_bag(bag.folder)[1] and metadata.read_text() == right
    heard = open_bag(bag.folder).messages(['/episode', '/camera/image_raw'])
    assert [each.data for each in heard] == read(bag.folder)
    assert_whole(bag.folder)


@pytest.mark.parametrize('suffix', ['.mcap', '.db3'])
def test_bags_beside_each_other_are_not_taken_for_one(tmp_path, suffix):
    for name in ('mug_0', 'mug_1', 'vase_0'):
        (tmp_path / f'{name}{suffix}').touch()
    for use in (open_bag, *([repair_bag] if suffix == '.mcap' else [])):
        with pytest.raises(DataError, match=f'several bags .* got mug_0{suffix}, mug_1'):
            use(tmp_path)
    assert len(list(tmp_path.iterdir())) == 3


def test_a_packed_file_that_nothing_lists_is_asked_to_be_unpacked(cut_off):
    (cut_off / 'metadata.yaml').unlink(missing_ok=True)
    whole, = cut_off.glob('*.mcap')
    whole.with_name('run_1.mcap.zstd').write_bytes(b'packed')
    before = state(cut_off)
    for use in (repair_bag, open_bag):
        with pytest.raises(DataError, match=r'run_1.mcap.zstd; unpack it first'):
            use(cut_off)
    assert state(cut_off) == before
