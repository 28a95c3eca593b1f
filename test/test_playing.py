"""What of a bag can be played."""

from active_recon.bags.metadata import Topic
from active_recon.bags.playing import played_topics
from active_recon.errors import ConfigError, DataError
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
    time_of,
)


@pytest.fixture
def bag(tmp_path):
    with announced(tmp_path / 'run') as bag:
        bag.write('/episode', cdr(header(0)), time_of(0), time_of(0))
        bag.write('/camera/image_raw', cdr(image(0)), time_of(1), time_of(1))
    return bag


@pytest.mark.parametrize('bare', [False, True])
def test_topics_are_played_with_the_qos_that_they_were_offered_with(bag, bare):
    topics = played_topics(bag.path if bare else bag.folder, 1.0)
    assert sorted(topics, key=lambda topic: topic.name) == [
        Topic('/camera/image_raw', IMAGE, (SENSOR,)), Topic('/episode', HEADER, (LATCHED,))]


def test_topics_are_chosen_by_name_with_or_without_the_slash(bag):
    for names in ('episode', '/episode', 'episode, /episode'):
        assert [topic.name for topic in played_topics(bag.folder, 0.5, names)] == ['/episode']


@pytest.mark.parametrize('rate', [0.0, -1.0, float('nan'), float('inf')])
def test_a_rate_that_is_not_above_0_is_refused(bag, rate):
    with pytest.raises(ConfigError, match='expected a rate above 0'):
        played_topics(bag.folder, rate)


def test_a_topic_that_the_bag_has_not_is_refused_with_those_it_has(bag):
    with pytest.raises(ConfigError, match='/camera/image_raw, /episode, got /view'):
        played_topics(bag.folder, 1.0, 'episode,view')


def test_what_is_no_whole_bag_is_refused(bag, tmp_path):
    with pytest.raises(DataError, match='there is nothing'):
        played_topics(tmp_path / 'nowhere', 1.0)
    (bag.folder / 'metadata.yaml').unlink()
    with pytest.raises(DataError, match='active-recon bag repair'):
        played_topics(bag.folder, 1.0)
