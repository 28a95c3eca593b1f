"""What of a bag can be played."""

import os

from active_recon.bags.runs.playing import Played, played
from active_recon.bags.storage.bag import RawMessage
from active_recon.bags.storage.metadata import Contents, Topic, total
from active_recon.errors import ConfigError, DataError
from mcap.opcode import Opcode
import numpy as np
import pytest
from recorded_messages import (
    announced,
    cdr,
    HEADER,
    header,
    IMAGE,
    image,
    LATCHED,
    SENSOR,
    STORE,
    time_of,
)
from rosbags.interfaces import (
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.rosbag2 import StoragePlugin, Writer
from test_bad_bags import first_record


@pytest.fixture
def bag(tmp_path):
    with announced(tmp_path / 'run') as bag:
        bag.write('/episode', cdr(header(0)), time_of(0), time_of(0))
        bag.write('/camera/image_raw', cdr(image(0)), time_of(1), time_of(1))
    return bag


@pytest.mark.parametrize('bare', [False, True])
def test_topics_are_played_with_the_qos_that_they_were_offered_with(bag, bare):
    topics = played(bag.path if bare else bag.folder, 1.0).topics
    assert sorted(topics, key=lambda topic: topic.name) == [
        Topic('/camera/image_raw', IMAGE, (SENSOR,)), Topic('/episode', HEADER, (LATCHED,))]


def test_topics_are_chosen_by_name_with_or_without_the_slash(bag):
    for names in ('episode', '/episode', 'episode, /episode'):
        assert [topic.name for topic in played(bag.folder, 0.5, names).topics] == ['/episode']


def test_messages_are_played_in_the_order_of_reception_however_they_lie_in_the_bag(tmp_path):
    with announced(tmp_path / 'run') as bag:
        for number in (2, 3, 0, 1):
            bag.write('/episode', cdr(header(number)), time_of(number), time_of(number))
            bag.flush()
            bag.write('/camera/image_raw', cdr(image(number)), time_of(number), time_of(number))
            bag.flush()
    messages = list(played(bag.folder, 1.0).messages())
    assert [each.received for each in messages] == [
        time_of(number) for number in range(4) for _ in range(2)]
    assert [each.topic for each in messages] == ['/episode', '/camera/image_raw'] * 4
    assert len(list(played(bag.folder, 1.0, 'episode').messages())) == 4


class Counting:
    """A bag of messages at these times, which counts those that were read."""

    def __init__(self, times):
        self.times, self.read = times, 0

    def messages(self, topics):
        for time in self.times:
            self.read += 1
            yield RawMessage('/episode', HEADER, b'', time, time)


@pytest.mark.parametrize(('times', 'late'), [
    ([0, 5, 5, 6, 9], 0), ([3, 1, 4, 2, 8, 7, 9], 2), ([9, 8, 7, 1], 8), ([], 0)])
def test_no_more_messages_are_held_than_may_have_been_received_later(times, late):
    contents = Contents()
    for time in times:
        contents.add('/episode', time)
    assert contents.late == late
    bag = Counting(times)
    for number, message in enumerate(Played([Topic('/episode', HEADER)], late, bag).messages()):
        assert message.received == sorted(times)[number]
        held = bag.times[:bag.read][:-1]
        assert bag.read == len(times) or max(held, default=0) <= message.received + late


@pytest.mark.parametrize('files', [1, 2, 3, 7])
def test_files_that_follow_each_other_are_as_late_as_all_their_messages_in_one(files):
    times = np.random.default_rng(files).integers(0, 1000, 21)
    whole, parts = Contents(), []
    for some in np.array_split(times, files):
        parts.append(Contents())
        for time in map(int, some):
            whole.add('/episode', time)
            parts[-1].add('/episode', time)
    assert total([Contents(), *parts, Contents()]) == whole


@pytest.mark.parametrize('rate', [0.0, -1.0, float('nan'), float('inf')])
def test_a_rate_that_is_not_above_0_is_refused(bag, rate):
    with pytest.raises(ConfigError, match='--rate: invalid rate: expected one above 0'):
        played(bag.folder, rate)


def test_a_topic_that_the_bag_has_not_is_refused_with_those_it_has(bag):
    with pytest.raises(ConfigError, match='no topics /view .* /camera/image_raw, /episode'):
        played(bag.folder, 1.0, 'episode,view')


def test_what_is_no_whole_bag_is_refused(bag, tmp_path):
    with pytest.raises(DataError, match='no bag there'):
        played(tmp_path / 'nowhere', 1.0)
    bag.path.write_bytes(bag.path.read_bytes()[:-100])
    with pytest.raises(DataError, match='active-recon bag repair'):
        played(bag.folder, 1.0)


def test_a_bag_that_is_damaged_inside_a_chunk_is_refused_before_anything_is_played(bag):
    content = bytearray(bag.path.read_bytes())
    content[first_record(content, Opcode.CHUNK) + 100] ^= 1
    bag.path.write_bytes(content)
    for damaged in (bag.folder, bag.path):
        with pytest.raises(DataError, match='bag repair. keeps all that is intact'):
            played(damaged, 1.0)


@pytest.mark.parametrize('storage', list(StoragePlugin))
def test_bags_of_others_are_played_with_their_qos_too(tmp_path, storage):
    profile = Qos(QosHistory.KEEP_LAST, 1, QosReliability.RELIABLE, QosDurability.TRANSIENT_LOCAL,
                  QosTime(0, 0), QosTime(0, 0), QosLiveliness.AUTOMATIC, QosTime(0, 0), False)
    with Writer(tmp_path / 'run', version=9, storage_plugin=storage) as writer:
        connection = writer.add_connection(
            '/episode', HEADER, typestore=STORE, offered_qos_profiles=[profile])
        writer.write(connection, time_of(0), cdr(header(0)))
    assert played(tmp_path / 'run', 1.0).topics == [Topic('/episode', HEADER, (LATCHED,))]


def test_a_bag_without_messages_is_refused(tmp_path):
    with announced(tmp_path / 'run') as bag:
        pass
    with pytest.raises(DataError, match='nothing to play: expected a bag with messages'):
        played(bag.folder, 1.0)


def test_a_pipe_is_refused_and_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / 'run.mcap')
    with pytest.raises(DataError, match='run.mcap: no bag: expected a file or a folder'):
        played(tmp_path / 'run.mcap', 1.0)
