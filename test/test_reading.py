"""Reading bags: what was recorded is what is read, in whatever form it was stored."""


from contextlib import closing, contextmanager, suppress
from pathlib import Path
from shutil import copytree
import sqlite3

from active_recon.bags.replay.comparison import compare, NOTHING_RECORDED, SAME_BITS
from active_recon.bags.replay.replay import ReplayedEpisode, ReplayStep
from active_recon.bags.runs.reading import read_run
from active_recon.bags.storage.files import numbered_files
from active_recon.bags.storage.writer import BagWriter
from active_recon.errors import DataError
from active_recon.reconstructor import Reconstruction
from active_recon.report.scene import scene
from active_recon.report.subject import Subject
from active_recon.viewer.playback import recorded_states
from active_recon.volumes.voxels import VoxelGrid
from loop_bags import BEGIN, DELAY, header, LENS, LoopRun, PERIOD, STILL, type_name, write_bag
from msg_tools.clouds import cloud_from_msg, cloud_to_msg
from msg_tools.diagnostics import diagnostics_to_msg, NodeStatus
from msg_tools.episodes import done_to_msg
from msg_tools.images import image_to_msg
from msg_tools.stamps import stamp_from_nanoseconds
from msg_tools.voxels import FIELDS, voxel_grid_to_msg
import numpy as np
import pytest
from rclpy.serialization import serialize_message
from recorded_messages import definition, STORE
from rosbags.rosbag2 import (
    CompressionFormat,
    CompressionMode,
    Reader,
    StoragePlugin,
    Writer,
)
from std_msgs.msg import Float64


@pytest.fixture(scope='module')
def loop():
    return LoopRun()


@pytest.fixture(scope='module')
def bag(loop, tmp_path_factory):
    return write_bag(tmp_path_factory.mktemp('bags') / 'run', loop.messages)


def only(run):
    (episode,) = run.episodes
    return episode


def same(a, b):
    """Whether two runs tell the same of their views."""
    return [(view.stamp, view.image.tobytes(), view.camera.pose.tobytes(), view.entropy)
            for episode in a.episodes for view in episode.views] == [
           (view.stamp, view.image.tobytes(), view.camera.pose.tobytes(), view.entropy)
            for episode in b.episodes for view in episode.views]


def test_what_the_loop_published_is_what_is_read(loop, bag):
    run = read_run(bag)
    episode = only(run)
    assert (episode.id, episode.begin, episode.done) == ('first', BEGIN, 'max_views')
    assert [view.stamp for view in episode.views] == loop.stamps
    for number, view in enumerate(episode.views):
        assert np.array_equal(view.image, loop.images[number])
        assert view.camera.azimuth == pytest.approx(loop.azimuths[number])
        assert view.camera.intrinsics == LENS
        grid = loop.grids[number].occupancy
        assert np.array_equal(view.occupied.occupancy, np.where(grid > 0.5, grid, 0))
        assert np.array_equal(
            view.reconstruction.occupancy, np.where(grid > np.float32(0.02), grid, 0))
        assert np.array_equal(view.latent, loop.latents[number])
        assert view.entropy == VoxelGrid(grid).entropy()
    assert run.counters == {'reconstructor': {'views': 3}}
    assert (run.begin, run.end) == (BEGIN + DELAY, loop.messages[-1][0] + DELAY)
    assert sum(topic.count for topic in run.topics) == len(loop.messages)


@pytest.mark.parametrize('threshold', [0.5, 1.0], ids=['occupied', 'nothing occupied'])
def test_grids_of_64_cells_a_side_are_read_as_such_where_none_is_occupied_too(
        tmp_path, threshold):
    loop = LoopRun(resolution=64, threshold=threshold)
    run = read_run(write_bag(tmp_path / 'run', loop.messages))
    for grid, view in zip(loop.grids, only(run).views, strict=True):
        assert np.array_equal(view.occupied.occupancy, grid.above(threshold).occupancy)
        assert np.array_equal(view.reconstruction.occupancy, grid.above(0.02).occupancy)
    replayed = [ReplayedEpisode(only(run), None, [
        ReplayStep(view, Reconstruction(grid, view.latent), None)
        for grid, view in zip(loop.grids, only(run).views, strict=True)])]
    assert compare(replayed, threshold).deviations['occupancy'].verdict == SAME_BITS
    for state in recorded_states(run):
        assert state.grid.occupancy.shape == (64, 64, 64)
    cells = np.zeros((64, 64, 64), bool)
    shown = Subject('A', run, only(run), cells)
    assert shown.ious == [float(threshold == 1)] * 3
    assert shown.threshold == pytest.approx(threshold, abs=0.01)
    assert scene(shown)['side'] == 64


def test_a_view_whose_grids_are_both_empty_has_the_cells_of_the_others(tmp_path):
    loop = LoopRun(resolution=64)
    empty = VoxelGrid(np.zeros((64, 64, 64), np.float32))
    messages = [(time, topic, voxel_grid_to_msg(empty, 0, msg.header)
                 if topic in ('/occupancy', '/probabilities')
                 and msg.header == header(loop.stamps[0], 'object') else msg)
                for time, topic, msg in loop.messages]
    first, *_ = only(read_run(write_bag(tmp_path / 'run', messages))).views
    for grid in (first.occupied, first.reconstruction):
        assert grid.occupancy.shape == (64, 64, 64)
        assert not grid.occupancy.any()


def test_a_view_whose_background_was_taken_away_is_read_as_the_network_saw_it(loop, tmp_path):
    cleared = 255 - loop.images[1]
    image = image_to_msg(cleared, header(loop.stamps[1], 'camera'))
    bag = write_bag(tmp_path / 'bag', [*loop.messages, (loop.end, '/view_image', image)])
    first, second, third = (view.image for view in only(read_run(bag)).views)
    np.testing.assert_array_equal(second, cleared)
    for view, image in ((first, loop.images[0]), (third, loop.images[2])):
        np.testing.assert_array_equal(view, image)


def test_each_goal_follows_the_view_that_it_was_decided_upon(loop, bag):
    episode = only(read_run(bag))
    goals = [episode.first_goal, *(view.goal for view in episode.views[:-1])]
    assert episode.views[-1].goal is None
    for number, goal in enumerate(goals):
        assert goal.camera.azimuth == pytest.approx(loop.azimuths[number])
        assert (goal.camera.elevation, goal.camera.distance) == pytest.approx((0.5, 2.1))
        assert goal.stamp == loop.goal_stamps[number]
        assert goal.received == loop.goal_stamps[number] + 10 + DELAY  # when it first came
        np.testing.assert_allclose(goal.candidates.azimuths, [
            camera.azimuth for camera in loop.candidates], atol=1e-6)
        np.testing.assert_allclose(goal.candidates.positions, [
            camera.position for camera in loop.candidates], atol=1e-6)
        assert np.array_equal(goal.scores, loop.scores[number])


def test_an_entropy_of_an_older_recording_is_that_of_the_views_published_cells(
        loop, bag, tmp_path):
    older = [(time, topic, Float64(data=1e6) if topic == '/entropy' else msg)
             for time, topic, msg in loop.messages]
    run = read_run(write_bag(tmp_path / 'run', older))
    assert same(run, read_run(bag))
    view = only(run).views[0]
    assert view.entropy == view.reconstruction.entropy()
    assert view.received['entropy'] == view.received['probabilities']
    none = [entry for entry in loop.messages if entry[1] != '/entropy']
    assert [view.entropy for view in only(read_run(write_bag(tmp_path / 'none', none))).views] == [
        None] * 3


def test_an_entropy_belongs_to_the_view_of_its_stamp_whenever_it_comes(loop, bag, tmp_path):
    late = [(loop.end if topic == '/entropy' else time, topic, msg)
            for time, topic, msg in loop.messages]
    assert same(read_run(write_bag(tmp_path / 'run', late)), read_run(bag))


def test_what_bears_a_views_stamp_tells_when_it_was_received(loop, bag):
    view = only(read_run(bag)).views[0]
    assert view.received['camera/image_raw'] == loop.stamps[0] + 3 + DELAY
    assert view.received['occupancy'] == loop.stamps[0] + 1_000_000 + DELAY
    assert view.received['entropy'] == loop.stamps[0] + 1_000_004 + DELAY
    assert {'camera/pose', 'camera/camera_info', 'view', 'probabilities', 'latent'} < set(
        view.received)


def test_two_episodes_keep_their_views_apart(tmp_path):
    first = LoopRun()
    second = LoopRun('second', first.end, azimuths=(1.0, 3.0))
    run = read_run(write_bag(tmp_path / 'run', [*first.messages, *second.messages]))
    assert [episode.id for episode in run.episodes] == ['first', 'second']
    assert [len(episode.views) for episode in run.episodes] == [3, 2]
    assert [episode.done for episode in run.episodes] == ['max_views', 'max_views']
    assert run.episodes[1].first_goal.camera.azimuth == pytest.approx(1.0)


def after_a_reset(first, begin):
    """Return the messages of a loop and of a second one, under a clock that went back."""
    second = LoopRun('second', begin, azimuths=(1.0, 3.0))
    later = first.end - begin + PERIOD
    return second, [*first.messages,
                    *((time + later, topic, msg) for time, topic, msg in second.messages)]


def test_episodes_of_a_clock_that_was_reset_keep_their_views(loop, tmp_path):
    second, messages = after_a_reset(loop, BEGIN - 10**12)
    run = read_run(write_bag(tmp_path / 'run', messages))
    assert [episode.id for episode in run.episodes] == ['second', 'first']
    for expected, episode in zip((second, loop), run.episodes, strict=True):
        assert [view.stamp for view in episode.views] == expected.stamps
        assert [view.camera.azimuth for view in episode.views] == pytest.approx(expected.azimuths)
        for view, image in zip(episode.views, expected.images, strict=True):
            assert np.array_equal(view.image, image)
        assert episode.first_goal.camera.azimuth == pytest.approx(expected.azimuths[0])
        assert episode.done == 'max_views'
    assert run.gaps.missing == 0


def test_episodes_that_share_their_stamps_after_a_reset_are_refused(loop, tmp_path):
    _, messages = after_a_reset(loop, BEGIN + PERIOD // 2)
    with pytest.raises(DataError, match='clock went back .* its episodes share their stamps'):
        read_run(write_bag(tmp_path / 'run', messages))


@pytest.mark.parametrize(('is_later', 'topic', 'told'), [
    (True, '/camera/', 'images'), (False, '/camera/', 'images'), (False, '/camera/pose', 'poses')])
def test_a_camera_that_has_stamps_of_views_again_after_a_reset_is_refused(
        loop, tmp_path, is_later, topic, told):
    idle = [entry for entry in LoopRun('idle', BEGIN, azimuths=(1.5, 1.5, 1.5)).messages
            if entry[1].startswith(topic)]
    second = LoopRun('second', loop.end, azimuths=(1.0, 3.0))
    before, after = loop.messages, [*idle, *second.messages]
    if not is_later:
        before, after = after, before
    later = second.end - BEGIN + PERIOD
    messages = [*before, *((time + later, name, msg) for time, name, msg in after)]
    with pytest.raises(DataError, match=f'clock went back .* its {told} share their stamps'):
        read_run(write_bag(tmp_path / 'run', messages))


def test_an_episode_that_is_told_after_its_first_view_as_to_a_late_recorder_is_read(
        loop, bag, tmp_path):
    episode = next(entry for entry in loop.messages if entry[1] == '/episode')
    others = [entry for entry in loop.messages if entry is not episode]
    at = next(index for index, entry in enumerate(others) if entry[1] == '/view')
    told = (others[at][0] + 1, *episode[1:])
    run = read_run(write_bag(tmp_path / 'run', [*others[:at + 1], told, *others[at + 1:]]))
    assert same(run, read_run(bag))


def test_views_before_any_episode_are_one_without_an_id(loop, tmp_path):
    later = [entry for entry in loop.messages if entry[1] != '/episode']
    episode = only(read_run(write_bag(tmp_path / 'run', later)))
    assert (episode.id, len(episode.views)) == ('', 3)


def test_an_end_that_was_taken_back_is_none(loop, tmp_path):
    resumed = (loop.messages[-1][0] + 1, '/done', done_to_msg(BEGIN, ''))
    assert only(read_run(write_bag(tmp_path / 'run', [*loop.messages, resumed]))).done == ''


def test_latched_messages_that_come_again_count_once(loop, bag, tmp_path):
    again = [(time, topic, msg) for time, topic, msg in loop.messages
             if topic in ('/view', '/occupancy', '/probabilities', '/latent', '/entropy')]
    run = read_run(write_bag(tmp_path / 'run', [*loop.messages, *again]))
    assert same(run, read_run(bag))


def test_a_bare_file_a_split_bag_and_one_without_metadata_read_alike(loop, bag, tmp_path):
    whole = read_run(bag)
    assert same(read_run(bag / 'run_0.mcap'), whole)
    split = write_bag(tmp_path / 'split', loop.messages, max_bytes=20_000)
    assert len(list(split.glob('*.mcap'))) > 2
    assert same(read_run(split), whole)
    (split / 'metadata.yaml').unlink()
    assert same(read_run(split), whole)


def test_a_file_of_a_split_bag_is_read_alone_from_its_first_own_view_on(loop, bag, tmp_path):
    split = write_bag(tmp_path / 'split', loop.messages, max_bytes=20_000)
    whole = {view.stamp: view for view in only(read_run(bag)).views}
    found = []
    for file in numbered_files(split):
        with suppress(DataError):  # one that has no view of its own
            episode = only(read_run(file))
            assert (episode.id, episode.begin) == ('first', BEGIN)
            assert episode.begun_before == (episode.views[0].stamp != loop.stamps[0])
            found += [view.stamp for view in episode.views]
            for view in episode.views:
                assert np.array_equal(view.image, whole[view.stamp].image)
    assert found == sorted(set(found)) and len(found) > 1
    assert not only(read_run(split)).begun_before


def test_an_episode_that_began_before_the_recording_is_not_compared(loop, tmp_path):
    second = loop.stamps[1] - 2 * 10**8
    late = [entry for entry in loop.messages
            if entry[0] > second or entry[1] in ('/episode', '/view', '/latent')]
    run = read_run(write_bag(tmp_path / 'run', late))
    assert only(run).begun_before
    assert [view.stamp for view in only(run).views] == loop.stamps[1:]
    replayed = [ReplayedEpisode(only(run), None, [
        ReplayStep(view, Reconstruction(VoxelGrid(np.zeros((32,) * 3, np.float32)),
                                          view.latent), None)
        for view in only(run).views])]
    assert compare(replayed, 0.5).verdict == NOTHING_RECORDED


def test_an_episode_that_goes_on_from_a_saved_state_began_before(loop, bag, tmp_path):
    saved = voxel_grid_to_msg(loop.grids[0], loop.threshold, header(BEGIN, 'object'))
    run = read_run(write_bag(tmp_path / 'run', [
        *loop.messages[:2], (BEGIN + 1, '/occupancy', saved), *loop.messages[2:]]))
    assert only(run).begun_before and not only(read_run(bag)).begun_before
    assert [view.stamp for view in only(run).views] == loop.stamps


def copied(bag, folder, storage, packed=None):
    """Copy a bag by a library that we did not write."""
    writer = Writer(folder, version=9, storage_plugin=storage)
    if packed:
        writer.set_compression(packed, CompressionFormat.ZSTD)
    with Reader(bag) as reader, writer:
        connections = {each.id: writer.add_connection(
            each.topic, each.msgtype, typestore=STORE) for each in reader.connections}
        for connection, time, data in reader.messages():
            writer.write(connections[connection.id], time, data)
    return folder


@pytest.mark.parametrize('storage', [StoragePlugin.SQLITE3, StoragePlugin.MCAP])
def test_bags_that_others_wrote_read_alike(bag, tmp_path, storage):
    copy = copied(bag, tmp_path / 'copy', storage)
    assert same(read_run(copy), read_run(bag))
    (bare,) = [path for path in copy.iterdir() if path.suffix != '.yaml']
    assert same(read_run(bare), read_run(bag))


def test_the_order_in_the_file_does_not_matter(loop, bag, tmp_path):
    by_topic = sorted(loop.messages, key=lambda entry: entry[1])
    assert same(read_run(write_bag(tmp_path / 'run', by_topic)), read_run(bag))


def test_without_poses_of_the_camera_the_loops_views_tell_where_it_stood(loop, bag, tmp_path):
    fewer = [entry for entry in loop.messages if entry[1] != '/camera/pose']
    views = only(read_run(write_bag(tmp_path / 'run', fewer))).views
    for view, known in zip(views, only(read_run(bag)).views, strict=True):
        np.testing.assert_allclose(view.camera.pose, known.camera.pose, atol=1e-12)
        assert view.camera.intrinsics == known.camera.intrinsics


def test_a_namespace_before_the_topics_is_found(loop, bag, tmp_path):
    moved = [(time, f'/robot{topic}', msg) for time, topic, msg in loop.messages]
    assert same(read_run(write_bag(tmp_path / 'run', moved)), read_run(bag))


@pytest.mark.parametrize('remapped', [
    {'next_view': '/arm/goal'},
    {'view': '/robot/shots', 'next_view': '/arm/goal', 'entropy': '/doubt'}])
def test_remapped_topics_of_the_loop_are_found_by_the_names_that_the_recorder_keeps(
        loop, bag, tmp_path, remapped):
    with BagWriter(tmp_path / 'run') as writer:
        writer.add_provenance(remapped)
        writer.attach_parameters('/robot/reconstructor', {})
        for time, topic, msg in loop.messages:
            name = remapped.get(topic[1:], f'/robot{topic}')
            writer.add_topic(name, type_name(msg), definition(type_name(msg)))
            writer.write(name, serialize_message(msg), time + DELAY, time)
    run, usual = read_run(tmp_path / 'run'), read_run(bag)
    assert same(run, usual)
    goals, known = ([view.goal.stamp for view in only(each).views if view.goal]
                    for each in (run, usual))
    assert goals == known != []


def test_the_parameters_and_the_provenance_are_read(loop, tmp_path):
    with BagWriter(tmp_path / 'run') as writer:
        writer.add_provenance({'version': '1', 'policy': 'random'})
        writer.attach_parameters('/view_planner', {'seed': 3, 'distance': float('inf')})
        for time, topic, msg in loop.messages:
            writer.add_topic(topic, type_name(msg), definition(type_name(msg)))
            writer.write(topic, serialize_message(msg), time, time)
    run = read_run(tmp_path / 'run')
    assert run.provenance == {'version': '1', 'policy': 'random'}
    assert run.parameters == {'view_planner': {'seed': 3, 'distance': float('inf')}}


@pytest.mark.parametrize('mode', [CompressionMode.FILE, CompressionMode.MESSAGE])
@pytest.mark.parametrize('storage', list(StoragePlugin))
def test_bags_that_rosbag2_packed_read_alike(bag, tmp_path, storage, mode):
    copy = copied(bag, tmp_path / 'copy', storage, mode)
    (bare,) = [path for path in copy.iterdir() if path.suffix != '.yaml']
    for place in (copy, bare):
        assert same(read_run(place), read_run(bag))


def test_a_database_whose_recorder_was_killed_is_read_to_its_last_message(bag, tmp_path):
    copy = copied(bag, tmp_path / 'copy', StoragePlugin.SQLITE3)
    (file,) = copy.glob('*.db3')
    with closing(sqlite3.connect(file)) as database:
        messages = database.execute('SELECT * FROM messages').fetchall()
        database.execute('DELETE FROM messages WHERE id > 3')
        database.commit()
        database.execute('PRAGMA journal_mode = WAL')
        database.executemany('INSERT INTO messages VALUES (?, ?, ?, ?)', messages[3:])
        database.commit()
        (copy / 'metadata.yaml').unlink()  # written at the end
        killed = Path(copytree(copy, tmp_path / 'killed'))
    assert len(list(killed.glob('*.db3-wal'))) == 1
    before = {path.name: path.read_bytes() for path in killed.iterdir()}
    for place in (killed, killed / file.name):
        assert same(read_run(place), read_run(bag))
    assert before == {path.name: path.read_bytes() for path in killed.iterdir()}


def test_a_database_of_an_older_ros_has_no_definitions_and_needs_none(bag, tmp_path):
    copy = copied(bag, tmp_path / 'copy', StoragePlugin.SQLITE3)
    with closing(sqlite3.connect(copy / 'copy.db3')) as database:
        for table in ('schema', 'metadata', 'message_definitions'):
            database.execute(f'DROP TABLE {table}')
        database.commit()
    assert same(read_run(copy / 'copy.db3'), read_run(bag))


def test_the_size_of_the_object_is_that_of_the_recorded_node(loop, bag, tmp_path):
    larger = [(time, topic, scaled(msg, 3) if topic in ('/occupancy', '/probabilities') else msg)
              for time, topic, msg in loop.messages]
    folder = write_bag(tmp_path / 'run', larger, parameters={'object_size': 3})
    for view, small in zip(only(read_run(folder)).views, only(read_run(bag)).views, strict=True):
        assert view.occupied.size == 3
        assert np.array_equal(view.occupied.occupancy, small.occupied.occupancy)


def scaled(msg, factor):
    table = cloud_from_msg(msg, FIELDS) * np.float32([factor, factor, factor, 1])
    return cloud_to_msg(table, FIELDS, msg.header)


def test_a_recorded_parameter_of_another_type_is_refused(loop, tmp_path):
    folder = write_bag(tmp_path / 'run', loop.messages, parameters={'object_size': 'large'})
    with pytest.raises(DataError, match='parameter object_size: invalid value: expected a number'):
        read_run(folder)


def test_an_image_that_came_twice_is_one(loop, bag, tmp_path):
    again = [entry for entry in loop.messages if entry[1] == '/camera/image_raw'
             for _ in range(2)]
    others = [entry for entry in loop.messages if entry[1] != '/camera/image_raw']
    assert same(read_run(write_bag(tmp_path / 'run', others + again)), read_run(bag))


def test_reading_tells_how_far_it_is(loop, bag):
    told = {}

    @contextmanager
    def reporting(title, total):
        told[title] = [total, 0]

        def advance(steps, note):
            told[title][1] += steps

        yield advance

    read_run(bag, reporting=reporting)
    size = sum(path.stat().st_size for path in bag.glob('*.mcap'))
    assert told == {'checking the bag': [size, size],
                    'reading the cameras': [6 * STILL, 6 * STILL],
                    'reading the images': [3 * STILL, 3 * STILL]}


def test_images_that_are_missing_in_the_stream_are_told(tmp_path):
    loop = LoopRun(azimuths=tuple(np.arange(6.0)))
    whole = read_run(write_bag(tmp_path / 'whole', loop.messages))
    assert (whole.gaps.missing, whole.gaps.uncounted) == (0, None)
    lost = [entry for entry in loop.messages if not (
        entry[1] == '/camera/image_raw' and entry[0] - 3 == loop.stamps[2] - PERIOD)]
    gaps = read_run(write_bag(tmp_path / 'lost', lost)).gaps
    assert gaps.missing == 1
    assert gaps.period_s == pytest.approx(PERIOD / 1e9)


def test_images_that_the_loop_did_not_hear_are_told(loop, tmp_path):
    counted = [(time, '/diagnostics', diagnostics_to_msg(
        NodeStatus('/reconstructor', {'images': images}), stamp_from_nanoseconds(time)))
        for time, images in ((loop.begin, 100), (loop.end, 102))]
    others = [entry for entry in loop.messages if entry[1] != '/diagnostics']
    run = read_run(write_bag(tmp_path / 'run', [*others, *counted]))
    assert run.gaps.uncounted == STILL * len(loop.stamps) - 2


def test_what_other_loops_on_the_domain_counted_is_not_told_of_this_one(loop, tmp_path):
    names = 'reconstructor', 'cell_2/reconstructor', 'wrist/camera'
    beside = [(loop.end, '/diagnostics', diagnostics_to_msg(
        NodeStatus(f'/{name}', {'warned/depth': 1}), stamp_from_nanoseconds(loop.end)))
        for name in names]
    bag = write_bag(tmp_path / 'run', [*loop.messages, *beside],
                    others=['/wrist/camera'])
    assert set(read_run(bag).counters) == {'reconstructor', 'wrist/camera'}
