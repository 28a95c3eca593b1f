"""A run written as a bag: what readers that we did not write find in it."""

from dataclasses import replace

from active_recon.bags.replay.what_if import run_with_overrides
from active_recon.bags.runs.loop_setup import Overrides, recorded_setup
from active_recon.bags.runs.reading import read_run
from active_recon.bags.runs.run_writing import write_run
from active_recon.errors import RecordingError
from active_recon.geometry.cameras import Camera, orbit_camera
from active_recon.policies.reasons import GoalReason
import numpy as np
import pytest
from recorded_messages import doctor
from recorded_runs import episode_of, loop_of, policies, run_of, SECOND
from rosbags.highlevel import AnyReader
from scipy.spatial.transform import Rotation

pytestmark = pytest.mark.usefixtures('loaded_once')


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


def test_the_reason_of_a_goal_comes_back_with_it(run, tmp_path):
    (episode,) = run.episodes
    first, *others = episode.views
    reason = GoalReason('shows the top', 1 / 3)
    told = replace(first, goal=replace(first.goal, reason=reason))
    write_run(run_of([replace(episode, views=[told, *others])]), tmp_path / 'told')
    read, = read_run(tmp_path / 'told').episodes
    assert read.views[0].goal.reason == reason
    assert {view.goal.reason for view in read.views[1:] if view.goal} == {None}


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
        assert [goal.azimuth for goal in after] == [goal.azimuth for goal in before]
        for goal, written_goal in zip(after, before, strict=True):
            np.testing.assert_allclose(goal.pose, written_goal.pose, atol=1e-12)
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
    assert goals == [run.episodes[0].first_goal.camera.azimuth, *(
        view.goal.camera.azimuth for view in views if view.goal)]


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
    with pytest.raises(RecordingError, match='is not overwritten'):
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
    for name in ('azimuths', 'positions'):
        np.testing.assert_allclose(getattr(read.candidates, name),
                                   getattr(written.candidates, name), atol=1e-6)
    np.testing.assert_allclose(read.camera.pose, written.camera.pose, atol=1e-12)
    return (read.camera.azimuth, read.stamp, read.received) == (
        written.camera.azimuth, written.stamp, written.received)


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


def test_goals_stay_before_the_views_of_images_that_were_exposed_before_they_were_decided(
        run, tmp_path):
    (episode,) = run.episodes
    late = SECOND // 10  # of a camera: the image that comes after a goal may have an earlier stamp
    first = replace(episode.first_goal, stamp=episode.views[0].stamp + late // 2,
                    received=episode.views[0].stamp + late // 2)
    views = [replace(view, received={'view': view.stamp + late}, goal=view.goal and replace(
        view.goal, stamp=view.stamp + 2 * late, received=view.stamp + 2 * late))
        for view in episode.views]
    written = replace(episode, first_goal=first, views=views)
    write_run(replace(run, episodes=[written]), tmp_path / 'late')
    (read,) = read_run(tmp_path / 'late').episodes
    assert same_goal(read.first_goal, first)
    for view, before in zip(read.views, views, strict=True):
        assert same_goal(view.goal, before.goal)


def test_a_goal_that_looks_aside_or_is_rolled_comes_back_as_it_was(run, tmp_path):
    pose = orbit_camera(2.0, 0.9, 3.0).pose.copy()
    pose[:3, :3] = pose[:3, :3] @ Rotation.from_euler('xyz', (0.1, -0.05, 1.0)).as_matrix()
    (episode,) = run.episodes
    first = replace(episode.first_goal, camera=Camera(pose))
    write_run(replace(run, episodes=[replace(episode, first_goal=first)]), tmp_path / 'rolled')
    (read,) = read_run(tmp_path / 'rolled').episodes
    np.testing.assert_allclose(read.first_goal.camera.pose, pose, atol=1e-12)


def test_a_goal_of_the_same_azimuth_at_another_elevation_is_another_goal(run, tmp_path):
    (episode,) = run.episodes
    low, high = (
        replace(episode.first_goal, camera=orbit_camera(1.0, elevation), stamp=stamp,
                received=stamp) for elevation, stamp in ((0.2, SECOND), (0.9, SECOND + 1)))
    goals = replace(low, replacements=[high])
    write_run(replace(run, episodes=[replace(episode, first_goal=goals)]), tmp_path / 'two')
    (read,) = read_run(tmp_path / 'two').episodes
    assert [goal.elevation for goal in read.given_up(None)] == [pytest.approx(0.2)]
    assert read.first_goal.final.camera.elevation == pytest.approx(0.9)


PLACES = {'/robot/reconstructor': {'object_size': 1.0, 'object_frame': 'table'}}


@pytest.mark.parametrize('overrides', [Overrides(policy='farthest'), Overrides(threshold=0.2)])
def test_a_run_rewritten_with_overrides_keeps_its_frame_and_where_its_goals_stand(
        network, attention, tmp_path, overrides):
    loop = loop_of(network, policies(attention)['random'](), elevation=0.7, distance=2.6)
    written = [episode_of(*loop, SECOND, orbit_camera(1.0, 0.7, 2.6))]
    planner = {'policy': 'farthest', 'elevation': 0.7, 'distance': 2.6, 'max_views': 1}
    run = replace(run_of(written), parameters={**PLACES, '/robot/view_planner': planner})
    other = run_with_overrides(run, recorded_setup(run), overrides)
    write_run(other, tmp_path / 'other')
    (read,), (made,) = read_run(tmp_path / 'other').episodes, other.episodes
    assert same_goal(read.first_goal, made.first_goal)
    for view, before in zip(read.views, made.views, strict=True):
        np.testing.assert_array_equal(view.reconstruction.occupancy,
                                      before.reconstruction.occupancy)
        np.testing.assert_allclose(view.camera.pose, before.camera.pose, atol=1e-12)
        assert same_goal(view.goal, before.goal)
    cameras = [read.first_goal.camera, *(view.goal.camera for view in read.views if view.goal)]
    assert [(camera.elevation, camera.distance) for camera in cameras] == [
        pytest.approx((0.7, 2.6))] * len(cameras)
    frames = {msg.header.frame_id for topic, _, msg in messages_of(tmp_path / 'other')
              if topic in ('/camera/pose', '/view', '/occupancy', '/probabilities', '/next_view',
                           '/azimuth_scores')}
    assert frames == {'table'}


def test_a_run_of_a_simulation_s_stamps_lasts_as_long_as_it_was_received(bag, tmp_path):
    later = 10 ** 9 * SECOND  # messages are received by the time of day
    run = read_run(bag)
    episode, = run.episodes
    received = [replace(view, received={topic: time + later for topic, time in
                                        view.received.items()}, goal=view.goal and replace(
                                            view.goal, received=view.goal.received + later))
                for view in episode.views]
    assert all(view.received for view in received)
    first = replace(episode.first_goal, received=episode.first_goal.received + later)
    write_run(replace(run, episodes=[replace(episode, views=received, first_goal=first)]),
              tmp_path / 'simulated')
    times = [time for _, time, _ in messages_of(tmp_path / 'simulated')]
    assert max(times) - min(times) < 100 * SECOND


def test_an_end_that_follows_no_view_stays_with_its_episode_in_a_simulation_s_stamps(
        run, tmp_path):
    (episode,) = run.episodes
    view = replace(episode.views[0], received={'view': 10 ** 9 * SECOND})  # the time of day
    first = replace(episode, first_goal=None, views=[view], done='no_reachable_azimuth')
    second = replace(episode, id='second', begin=100 * SECOND, first_goal=None, views=[
        replace(view, stamp=101 * SECOND, goal=None, received={'view': 10 ** 9 * SECOND + 1})],
        done='')
    write_run(replace(run, episodes=[first, second]), tmp_path / 'two')
    ends = [each.done for each in read_run(tmp_path / 'two').episodes]
    assert ends == ['no_reachable_azimuth', '']
