"""Bags that are cut off: what was flushed is kept and read, whatever happens next."""

from pathlib import Path
import resource
from shutil import rmtree

from active_recon.bags.storage.atomic_bag import atomic_bag
from active_recon.errors import RecordingError
import pytest
from recorded_messages import (
    announced,
    cdr,
    definition,
    errors_in,
    header,
    IMAGE,
    image,
    SENSOR,
    small_disk,
    time_of,
)
from rosbags.highlevel import AnyReader


def test_what_was_flushed_is_read_from_a_bag_that_was_never_closed(tmp_path):
    bag = announced(tmp_path / 'run')
    for number in range(5):
        bag.write('/episode', cdr(header(number)), time_of(number), time_of(number))
        bag.flush()
        with AnyReader([bag.path]) as reader:
            read = [bytes(data) for _, _, data in reader.messages()]
        assert read == [cdr(header(each)) for each in range(number + 1)]
    assert not errors_in(bag.path)
    bag.close()


def test_a_full_disk_ends_the_bag_after_its_last_chunk(tmp_path):
    bag = announced(tmp_path / 'run')
    flushed = 0
    with small_disk(100_000), pytest.raises(
            RecordingError, match='writing failed') as refusal:
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
    assert not errors_in(bag.path)


def test_a_disk_that_fills_while_the_bag_is_closed_is_told(tmp_path):
    bag = announced(tmp_path / 'run')
    bag.write('/camera/image_raw', cdr(image(0, 256)), time_of(0), 0)
    with small_disk(100_000), pytest.raises(
            RecordingError, match='ends after 0 messages, 1 were lost'):
        bag.close()
    with AnyReader([bag.path]) as reader:
        assert reader.message_count == 0


def test_a_bag_that_is_written_whole_or_not_at_all_tells_of_a_full_disk_by_its_own_name(tmp_path):
    with (small_disk(10_000), pytest.raises(RecordingError) as refusal,
          atomic_bag(tmp_path / 'run') as bag):
        bag.add_topic('/camera/image_raw', IMAGE, definition(IMAGE), (SENSOR,))
        bag.write('/camera/image_raw', cdr(image(0, 256)), time_of(0), 0)
    assert str(refusal.value).startswith(f'cannot write a bag to {tmp_path / "run"}: ')
    assert 'the bag ends after' not in str(refusal.value)
    assert refusal.value.kind == 'disk_full'
    assert not any(tmp_path.iterdir())


@pytest.mark.parametrize('end', ['flush', 'close'])
def test_a_bag_that_is_deleted_or_moved_while_it_is_recorded_says_so(tmp_path, end):
    bag = announced(tmp_path / 'deleted')
    bag.write('/episode', cdr(header(0)), time_of(0), time_of(0))
    bag.flush()
    rmtree(bag.folder)
    with pytest.raises(RecordingError, match='deleted or moved while it was recorded') as refusal:
        getattr(bag, end)()
    assert refusal.value.kind == 'bag_gone'
    bag = announced(tmp_path / 'moved')
    bag.write('/episode', cdr(header(0)), time_of(0), time_of(0))
    moved = bag.folder.rename(tmp_path / 'elsewhere')
    bag.flush()  # it goes on where the file is now
    with pytest.raises(RecordingError, match='deleted or moved'):
        bag.close()
    with AnyReader([*moved.iterdir()]) as reader:
        assert reader.message_count == 1


def resident():
    """Return the memory of this process that is in use, in bytes."""
    return int(Path('/proc/self/statm').read_text().split()[1]) * resource.getpagesize()


def test_memory_stays_flat_over_10_000_messages(tmp_path):
    sent = [cdr(image(number, 64)) for number in range(10)]
    with announced(tmp_path / 'run', max_bytes=20_000_000) as bag:
        for number in range(12_000):
            if number == 2000:
                before = resident()
            bag.write('/camera/image_raw', sent[number % 10], time_of(number), 0)
        assert resident() - before < 4_000_000
    assert sum(path.stat().st_size for path in bag.folder.iterdir()) > 15_000_000
