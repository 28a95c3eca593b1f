"""However a bag came to its end, readers that we did not write read all that it holds."""

from active_recon.bags.storage.repair import repair_bag
from active_recon.errors import RecordingError
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
import pytest
from recorded_messages import announced, cdr, errors_in, image, small_disk, time_of
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import Reader

COUNT = 12


def fill(folder, max_bytes=None):
    """Return a bag that holds images, all of them on the disk."""
    bag = announced(folder, max_bytes)
    bag.add_provenance({'seed': '1'})
    bag.attach_parameters('/view_planner', {'seed': 1})
    for number in range(COUNT):
        bag.write('/camera/image_raw', cdr(image(number, 32)), time_of(number), time_of(number))
        bag.flush()
    return bag


def closed(folder):
    fill(folder).close()


def split(folder):
    fill(folder, max_bytes=10_000).close()


def cut_off(folder):
    fill(folder)._file.abandon()


def split_and_cut_off(folder):
    fill(folder, max_bytes=10_000)._file.abandon()


def repaired(folder):
    cut_off(folder)
    repair_bag(folder)


def split_and_repaired(folder):
    split_and_cut_off(folder)
    repair_bag(folder)


def full_disk(folder):
    bag = fill(folder)
    with small_disk(bag.path.stat().st_size + 1000), pytest.raises(RecordingError):
        bag.write('/camera/image_raw', cdr(image(COUNT, 32)), time_of(COUNT), time_of(COUNT))
        bag.flush()


def full_disk_and_repaired(folder):
    full_disk(folder)
    repair_bag(folder)


def files(folder):
    return sorted(folder.glob('*.mcap'))


@pytest.fixture
def folder(request, tmp_path):
    request.param(tmp_path / 'run')
    return tmp_path / 'run'


SENT = [cdr(image(number, 32)) for number in range(COUNT)]
DESCRIBED = [closed, split, repaired, split_and_repaired, full_disk, full_disk_and_repaired]


def every(*ends):
    return pytest.mark.parametrize('folder', ends, indirect=True, ids=lambda end: end.__name__)


@every(*DESCRIBED)
def test_rosbags_reads_the_folder(folder):
    with Reader(folder) as reader:
        assert reader.message_count == COUNT
        assert [bytes(data) for _, _, data in reader.messages()] == SENT
    with AnyReader([folder]) as reader:
        assert [bytes(data) for _, _, data in reader.messages()] == SENT


@every(*DESCRIBED, cut_off, split_and_cut_off)
def test_rosbags_mcap_ros2_and_the_doctor_take_the_bare_files(folder):
    with AnyReader(files(folder)) as reader:
        assert [bytes(data) for _, _, data in reader.messages()] == SENT
    decoded = []
    for file in files(folder):
        assert not errors_in(file)
        with file.open('rb') as stream:
            reader = make_reader(stream, decoder_factories=[DecoderFactory()])
            decoded += [each.decoded_message for each in reader.iter_decoded_messages()]
    assert [bytes(msg.data) for msg in decoded] == [
        image(number, 32).data.tobytes() for number in range(COUNT)]
