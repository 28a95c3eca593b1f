"""Messages handed over topic by topic stand in a bag as they were received, index or not."""

import shutil

from mcap.records import Message
from mcap.stream_reader import StreamReader
from recorded_messages import announced, cdr, doctor, header, image, time_of
from rosbags.highlevel import AnyReader


def written_topic_by_topic(bag, count):
    """Write pairs of which the header came first and the image is handed over first."""
    for number in range(count):
        bag.write('/camera/image_raw', cdr(image(number)), time_of(number) + 500, time_of(number))
        bag.write('/episode', cdr(header(number)), time_of(number), time_of(number))


def expected(count):
    return [entry for number in range(count) for entry in (
        (time_of(number), cdr(header(number))), (time_of(number) + 500, cdr(image(number))))]


def test_a_bag_that_was_never_closed_is_read_in_the_order_of_reception(tmp_path):
    bag = announced(tmp_path / 'run')
    written_topic_by_topic(bag, 5)
    bag.flush()
    found = tmp_path / 'found_0.mcap'
    shutil.copy(bag.path, found)  # as a writer that was killed now would leave it
    bag.close()
    with AnyReader([found]) as reader:
        read = [(time, bytes(data)) for _, time, data in reader.messages()]
    assert read == expected(5)
    assert doctor(found).returncode == 0


def test_messages_keep_their_topics_order_and_number(tmp_path):
    with announced(tmp_path / 'run') as bag:
        for number in (2, 0, 1):  # the same time thrice: nothing to sort by
            bag.write('/episode', cdr(header(number)), time_of(0), 0)
    with bag.path.open('rb') as stream:
        messages = [(record.sequence, record.data) for record in StreamReader(stream).records
                    if isinstance(record, Message)]
    assert messages == [(1, cdr(header(2))), (2, cdr(header(0))), (3, cdr(header(1)))]
