"""A run written as a bag: what readers that we did not write find in it."""

from dataclasses import replace

from active_recon.bags.reading import read_run
from active_recon.bags.run_writing import write_run
from active_recon.cameras import orbit_camera
from active_recon.errors import RecordingError
import numpy as np
import pytest
from recorded_messages import doctor
from recorded_runs import episode_of, loop_of, policies, run_of, SECOND
from rosbags.highlevel import AnyReader


@pytest.fixture
def run(network, attention):
    loop = loop_of(network, policies(attention)['attention']())
    return replace(run_of([episode_of(*loop, SECOND, 1.0)]),
                   provenance={'policy': 'attention'},
                   parameters={'/reconstructor': {'object_size': 1.0}})


@pytest.fixture
def bag(run, tmp_path):
    folder = tmp_path / 'bag'
    write_run(run, folder)
    return folder


def messages_of(folder):
    with AnyReader([folder]) as reader:
        return [(connection.topic, time, reader.deserialize(data, connection.msgtype))
                for connection, time, data in reader.messages()]


def test_every_topic_of_the_loop_is_there_once_for_each_view_or_goal(run, bag):
    topics = [topic for topic, _, _ in messages_of(bag)]
    assert {topic: topics.count(topic) for topic in topics} == {
        '/episode': 1, '/done': 2, '/camera/image_raw': 3, '/camera/camera_info': 3,
        '/camera/pose': 3, '/view': 3, '/occupancy': 3, '/probabilities': 3, '/latent': 3,
        '/entropy': 3, '/next_view': 3, '/next_azimuth': 3, '/azimuth_scores': 3}


@pytest.mark.parametrize(('given_up', 'done'), [
    ((1, 2), 'max_views'), ((0, 99), 'no_reachable_azimuth')])
def test_goals_that_were_given_up_and_the_end_come_back(
        network, attention, tmp_path, given_up, done):
    loop = loop_of(network, policies(attention)['random']())
    written = episode_of(*loop, SECOND, 1.0, given_up)
    write_run(run_of([written]), tmp_path / 'bag')
    read, = read_run(tmp_path / 'bag').episodes
    assert read.done == written.done == done
    for number in (None, *range(len(written.views))):
        before, after = (episode.given_up(None if number is None else episode.views[number])
                         for episode in (written, read))
        assert after == before
    assert sum(len(read.given_up(view)) for view in (None, *read.views)) >= 3


def test_numbers_come_back_as_they_were(run, bag):
    messages = messages_of(bag)
    views = run.episodes[0].views
    for topic, of_view in {
            '/camera/image_raw': lambda view: view.image.tobytes(),
            '/latent': lambda view: view.latent.transpose(1, 2, 0).tobytes(),
            '/probabilities': lambda view: view.reconstruction.points(0).tobytes(),
            '/occupancy': lambda view: view.occupied.points(0).tobytes()}.items():
        assert [bytes(msg.data) for name, _, msg in messages if name == topic] == list(
            map(of_view, views))
    assert [list(msg.position) for name, _, msg in messages if name == '/entropy'] == [
        [view.entropy] for view in views]
    goals = [msg.position[0] for name, _, msg in messages if name == '/next_azimuth']
    assert goals == [run.episodes[0].first_goal.azimuth, *(
        view.goal.azimuth for view in views if view.goal)]


def test_messages_lie_in_the_order_of_their_times(bag):
    times = [time for _, time, _ in messages_of(bag)]
    assert times == sorted(times)
    assert [topic for topic, _, _ in messages_of(bag)][-1] == '/done'


def test_checkers_find_no_fault(bag):
    checked = doctor(next(bag.glob('*.mcap')))
    assert checked.returncode == 0, checked.stdout
    assert 'error' not in checked.stdout.lower(), checked.stdout


def test_a_view_of_images_alone_is_written_without_what_nobody_computed(run, tmp_path):
    view = run.episodes[0].views[0]
    bare = replace(view, camera=orbit_camera(1.0), reconstruction=None, occupied=None,
                   latent=None, entropy=None, goal=None)
    episode = replace(run.episodes[0], first_goal=None, views=[bare], done='')
    write_run(replace(run, episodes=[episode]), tmp_path / 'bare')
    assert {topic for topic, _, _ in messages_of(tmp_path / 'bare')} == {
        '/episode', '/done', '/camera/image_raw', '/camera/camera_info', '/camera/pose', '/view'}


def test_nothing_is_overwritten_and_nothing_half_written(run, bag):
    before = {path: path.read_bytes() for path in bag.iterdir()}
    with pytest.raises(RecordingError, match='nothing is overwritten'):
        write_run(run, bag)
    assert {path: path.read_bytes() for path in bag.iterdir()} == before
    torn = replace(run.episodes[0].views[1], latent=np.zeros(3, np.float32))
    wrong = replace(run, episodes=[replace(run.episodes[0], views=[torn])])
    with pytest.raises(ValueError):
        write_run(wrong, bag.with_name('torn'))
    assert [path.name for path in bag.parent.iterdir()] == ['bag']


def same_goal(read, written):
    if written is None:
        return read is None
    np.testing.assert_array_equal(read.scores, written.scores)
    np.testing.assert_allclose(read.candidates, written.candidates, atol=1e-6)
    return (read.azimuth, read.stamp, read.received) == (
        written.azimuth, written.stamp, written.received)


def test_what_is_read_is_what_was_written(run, bag):
    read = read_run(bag)
    assert read.provenance == run.provenance
    assert read.parameters == {'reconstructor': {'object_size': 1.0}}
    (episode,), (written,) = read.episodes, run.episodes
    assert (episode.id, episode.begin, episode.done) == (written.id, written.begin, written.done)
    assert same_goal(episode.first_goal, written.first_goal)
    for view, before in zip(episode.views, written.views, strict=True):
        assert (view.stamp, view.entropy) == (before.stamp, before.entropy)
        assert same_goal(view.goal, before.goal)
        np.testing.assert_array_equal(view.image, before.image)
        np.testing.assert_array_equal(view.latent, before.latent)
        np.testing.assert_allclose(view.camera.pose, before.camera.pose, atol=1e-12)
        np.testing.assert_array_equal(view.reconstruction.occupancy,
                                      before.reconstruction.occupancy)
        np.testing.assert_array_equal(view.occupied.occupancy, before.occupied.occupancy)
