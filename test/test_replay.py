"""Replay: the same bits as recorded, or the gap that was found, whatever the run was."""

from dataclasses import replace

from active_recon.acquisition.motion import MotionLimits
from active_recon.acquisition.motion_cost import TimedMotion
from active_recon.bags.replay.comparison import (
    compare,
    DIFFERENT,
    NOTHING_RECORDED,
    SAME_BITS,
    TOLERANCES,
    WITHIN_TOLERANCE,
)
from active_recon.bags.replay.replay import replay, replay_hash
from active_recon.bags.runs.loop_setup import recorded_setup
from active_recon.errors import DataError, WeightsError
from active_recon.geometry.cameras import orbit_camera
from active_recon.models.attention import AttentionModel
from active_recon.models.network_2d3d import Network2d3d
from active_recon.models.weights_files import FOLDER, SHIPPED, weights_hash
from active_recon.policies.geometric import FarthestPolicy
from active_recon.volumes.voxels import VoxelGrid
import numpy as np
import pytest
from recorded_runs import (
    episode_of,
    FLOOR,
    goal_of,
    image_at,
    loop_of,
    policies,
    run_of,
    SECOND,
    THRESHOLD,
)
import torch

pytestmark = pytest.mark.usefixtures('loaded_once')


@pytest.fixture(scope='module', params=['attention', 'random'])
def make_loop(request, tiny):
    """Return what makes the core of the loop anew, its policy with its seed."""
    torch.manual_seed(0)
    network, attention = Network2d3d.from_config(tiny).eval(), AttentionModel.from_config(tiny)
    policy = policies(attention.eval())[request.param]
    return lambda **settings: loop_of(network, policy(), **settings)


@pytest.fixture(scope='module')
def run(make_loop):
    loop = make_loop()
    return run_of([episode_of(*loop, begin * 100 * SECOND, begin) for begin in (1, 2)])


def changed(run, **fields):
    """Return the run with another second view in its first episode."""
    first, *others = run.episodes
    views = [first.views[0], replace(first.views[1], **fields), *first.views[2:]]
    return replace(run, episodes=[replace(first, views=views), *others])


def test_a_replay_has_the_bits_of_the_run(run, make_loop):
    comparison = compare(replay(run, *make_loop()), THRESHOLD)
    assert {name: (found.compared, found.same, found.largest)
            for name, found in comparison.deviations.items()} == {
        'probabilities': (6, 6, 0), 'occupancy': (6, 6, 0), 'latent': (6, 6, 0),
        'entropy': (6, 6, 0), 'quality': (0, 0, 0), 'goal': (4, 4, 0), 'scores': (4, 4, 0),
        'stop': (6, 6, 0)}
    assert comparison.verdict == SAME_BITS


def test_views_count_in_the_order_of_their_stamps_however_they_lie_in_the_bag(run, make_loop):
    shuffled = run_of([replace(episode, views=episode.views[::-1])
                       for episode in run.episodes[::-1]])
    assert compare(replay(shuffled, *make_loop()), THRESHOLD).verdict == SAME_BITS


def test_every_replay_has_the_same_hash_and_another_image_another(run, make_loop):
    assert len({replay_hash(replay(run, *make_loop())) for _ in range(2)}) == 1
    other = changed(run, image=255 - run.episodes[0].views[1].image)
    assert replay_hash(replay(other, *make_loop())) != replay_hash(replay(run, *make_loop()))


def off_by(view, name, gap):
    """Return the fields of a view whose quantity was recorded with a gap."""
    def grid(recorded):
        occupancy = recorded.occupancy.copy()
        occupancy[np.unravel_index(occupancy.argmax(), occupancy.shape)] -= np.float32(gap)
        return replace(recorded, occupancy=occupancy)

    match name:
        case 'probabilities':
            return {'reconstruction': grid(view.reconstruction)}
        case 'occupancy':
            return {'occupied': grid(view.occupied)}
        case 'latent':
            return {'latent': view.latent + np.float32(gap)}
        case 'entropy':
            return {'entropy': view.entropy * (1 + gap)}
        case 'goal':
            camera = view.goal.camera
            return {'goal': replace(view.goal, camera=orbit_camera(
                camera.azimuth, camera.elevation + gap, camera.distance))}
        case 'scores':
            return {'goal': replace(view.goal, scores=view.goal.scores + np.float32(gap))}
    raise AssertionError(name)


@pytest.mark.parametrize('name', [
    name for name, limit in TOLERANCES.items() if limit > 0 and name != 'quality'])
def test_what_was_recorded_otherwise_is_told_by_name_and_by_how_far(run, make_loop, name):
    view = run.episodes[0].views[1]
    for share, verdict in ((0.5, WITHIN_TOLERANCE), (2, DIFFERENT)):
        gap = share * TOLERANCES[name]
        comparison = compare(
            replay(changed(run, **off_by(view, name, gap)), *make_loop()), THRESHOLD)
        found = comparison.deviations[name]
        assert (found.verdict, comparison.verdict) == (verdict, verdict)
        assert found.same == found.compared - 1
        assert found.largest == pytest.approx(gap, rel=0.01)
        assert {other.verdict for other in comparison.deviations.values()
                if other is not found} - {NOTHING_RECORDED} == {SAME_BITS}


def test_an_end_that_was_not_recorded_so_is_different(run, make_loop):
    first, second = run.episodes
    ended_early = replace(first, views=first.views[:2], done='max_views')
    ended_early.views[1] = replace(first.views[1], goal=None)
    for episodes in ([replace(first, done='entropy_settled'), second], [ended_early, second]):
        comparison = compare(replay(run_of(episodes), *make_loop()), THRESHOLD)
        assert comparison.deviations['stop'].verdict == comparison.verdict == DIFFERENT


def test_a_view_more_that_was_asked_for_after_the_end_is_no_difference(make_loop):
    reconstructor, planner = make_loop()
    episode = episode_of(reconstructor, planner, SECOND, 1.0)
    goal = planner.plan()
    camera = goal.camera
    known = reconstructor.add_view(image_at(camera.azimuth), camera)
    planner.add_view(known.latent, camera, known.grid.entropy())
    *views, last = episode.views
    asked = replace(last, done='max_views', goal=goal_of(goal, last.stamp + 1))
    more = replace(last, stamp=last.stamp + SECOND, image=image_at(camera.azimuth), camera=camera,
                   reconstruction=None, occupied=None, latent=known.latent, entropy=None)
    run = run_of([replace(episode, views=[*views, asked, more])])
    found = compare(replay(run, *make_loop()), THRESHOLD).deviations
    assert (found['stop'].verdict, found['stop'].compared) == (SAME_BITS, 4)
    assert (found['latent'].verdict, found['latent'].compared) == (SAME_BITS, 4)
    ended_early = replace(asked, done='entropy_settled')
    run = run_of([replace(episode, views=[*views, ended_early, more])])
    assert compare(replay(run, *make_loop()), THRESHOLD).verdict == DIFFERENT


def test_a_recording_that_broke_off_is_compared_as_far_as_it_goes(run, make_loop):
    first, second = run.episodes
    cut = replace(second, done='', views=[
        second.views[0],
        replace(second.views[1], goal=None, entropy=None, latent=None, occupied=None)])
    comparison = compare(replay(run_of([first, cut]), *make_loop()), THRESHOLD)
    assert comparison.verdict == SAME_BITS
    assert {name: found.compared for name, found in comparison.deviations.items()} == {
        'probabilities': 5, 'occupancy': 4, 'latent': 4, 'entropy': 4, 'quality': 0,
        'goal': 3, 'scores': 3, 'stop': 4}


def test_images_alone_are_replayed_with_nothing_to_compare(run, make_loop):
    bare = run_of([replace(episode, done='', first_goal=None, views=[
        replace(view, reconstruction=None, occupied=None, latent=None, entropy=None, goal=None)
        for view in episode.views]) for episode in run.episodes])
    reconstructor, _ = make_loop()
    episodes = replay(bare, reconstructor)
    assert compare(episodes, THRESHOLD).verdict == NOTHING_RECORDED
    assert all(step.decision is None for episode in episodes for step in episode.steps)


def test_a_cell_at_the_edge_of_the_cloud_is_off_by_what_it_is_beyond_the_edge(run, make_loop):
    view = run.episodes[0].views[1]
    occupancy = view.reconstruction.occupancy.copy()
    lowest = np.where(occupancy > 0, occupancy, 1).argmin()
    beyond = occupancy.flat[lowest] - FLOOR
    occupancy.flat[lowest] = 0
    lacking = changed(run, reconstruction=replace(view.reconstruction, occupancy=occupancy))
    found = compare(replay(lacking, *make_loop()), THRESHOLD).deviations['probabilities']
    assert found.same == found.compared - 1
    assert found.largest == pytest.approx(beyond, abs=1e-6)


def test_an_empty_cloud_is_compared_whatever_the_resolution_that_it_was_read_with(
        run, make_loop):
    view = run.episodes[0].views[1]
    for cells in (32, 64):
        empty = VoxelGrid(np.zeros((cells,) * 3, np.float32))
        found = compare(replay(changed(run, occupied=empty), *make_loop()), THRESHOLD)
        apart = found.deviations['occupancy'].largest
        assert apart == pytest.approx(view.occupied.occupancy.max() - THRESHOLD, abs=1e-6)


LIMITED = {'views': 4, 'motion_weight': 0.3, 'limits': MotionLimits((-1.0, 2.0), [0.6, 1.1])}


@pytest.mark.parametrize(('given_up', 'views', 'done'), [
    ((0, 1, 2), 4, 'max_views'), ((2, 0, 1), 4, 'max_views'),
    ((0, 1, 99), 2, 'no_reachable_azimuth')])
def test_goals_that_were_given_up_are_left_out_again(make_loop, given_up, views, done):
    episode = episode_of(*make_loop(**LIMITED), SECOND, 1.0, given_up)
    assert (len(episode.views), episode.done) == (views, done)
    again = replay(run_of([episode]), *make_loop(**LIMITED))
    assert compare(again, THRESHOLD).verdict == SAME_BITS


def test_a_run_under_limits_replays_otherwise_without_them(make_loop):
    run = run_of([episode_of(*make_loop(**LIMITED), SECOND, 1.0)])
    assert compare(replay(run, *make_loop(views=4)), THRESHOLD).verdict == DIFFERENT


@pytest.mark.parametrize('where', [
    {'elevation_range': (-0.2, 1.1)}, {'reachable_views': (
        0.9, 0.4, 0.0, 1.5, 1.1, 2.5, 3.0, -0.4, 0.0, 5.0, 0.6, 2.0)}])
@pytest.mark.parametrize('given_up', [(), (1, 0, 0)])
def test_goals_at_several_elevations_that_cost_time_replay_to_the_same_bits(
        make_loop, where, given_up):
    settings = {'views': 3, 'motion': TimedMotion(0.5, 0.3, 1.0, 0.05), **where}
    episode = episode_of(*make_loop(**settings), SECOND, orbit_camera(1.0, 0.8), given_up)
    again = replay(run_of([episode]), *make_loop(**settings))
    assert compare(again, THRESHOLD).verdict == SAME_BITS


def test_the_setup_has_the_places_of_goals_and_the_cost_of_time():
    recorded = {'elevation_range': [0, 1.1], 'reachable_views': [], 'motion_cost': 0.3,
                'azimuth_speed': 0.02, 'elevation_speed': 1, 'view_time': 2.0}
    planner = recorded_setup(replace(run_of([]), parameters={
        'view_planner': {'policy': 'farthest', **recorded}})).load_planner()
    planner.first_goal(orbit_camera(1.0, 0.3))
    goal = planner.add_view(np.zeros((1, 4, 4), np.float32), orbit_camera(1.0, 0.3), 9.0).goal
    assert abs(goal.camera.azimuth - 1.0) < 0.2
    assert goal.camera.elevation > 0.6


def test_an_end_that_a_service_asked_for_is_no_difference(run, make_loop):
    first = run.episodes[0]
    after_goal = replace(first, views=first.views[:2], done='stopped')
    before_goal = replace(after_goal, views=[
        first.views[0], replace(first.views[1], goal=None)])
    for episode, decided in ((after_goal, 2), (before_goal, 1)):
        found = compare(replay(run_of([episode]), *make_loop()), THRESHOLD)
        assert found.verdict == SAME_BITS
        assert found.deviations['stop'].compared == decided


@pytest.mark.parametrize('given_up', [(), (1, 0, 2)])
def test_goals_of_a_planner_that_follows_the_camera_s_elevation_replay_to_the_same_bits(
        make_loop, given_up):
    loop = make_loop()
    episode = episode_of(*loop, SECOND, orbit_camera(1.0, 0.8, 2.4), given_up)
    assert {round(view.camera.elevation, 9) for view in episode.views} == {0.8}
    assert compare(replay(run_of([episode]), *make_loop()), THRESHOLD).verdict == SAME_BITS


def test_a_policy_that_looks_at_the_volume_is_shown_what_is_published_of_it(network):
    class Looks(FarthestPolicy):
        wants_volume = True

        def choose(self, seen, state):
            volumes.append(seen.occupancy[0])
            return super().choose(seen, state)

    volumes = []
    reconstructor, planner = loop_of(network, FarthestPolicy())
    run = run_of([episode_of(reconstructor, planner, SECOND, 1.0)])
    replay(run, *loop_of(network, Looks()))
    for view, volume in zip(run.episodes[0].views, volumes, strict=True):
        np.testing.assert_array_equal(volume, view.reconstruction.occupancy)


@pytest.mark.parametrize(('recorded', 'elevation', 'distance'), [
    ({}, 0.3, 2.1 * 0.5), ({'elevation': float('nan'), 'distance': float('nan')}, 0.3, 2.1 * 0.5),
    ({'elevation': 0.7, 'distance': 2}, 0.7, 2.0)])
def test_goals_of_a_replay_stand_where_the_recorded_parameters_say(recorded, elevation, distance):
    bag = replace(run_of([]), parameters={
        'reconstructor': {'object_size': 0.5},
        'view_planner': {'policy': 'farthest', **recorded}})
    camera = recorded_setup(bag).load_planner().first_goal(orbit_camera(1.0, 0.3)).camera
    assert (camera.elevation, camera.distance) == pytest.approx((elevation, distance))


@pytest.mark.parametrize(('asked', 'told', 'expected'), [
    ('auto', 'openvino 1, bf16, a processor, 1 threads', 'bf16'),
    ('auto', 'openvino 1, f32, a processor, 1 threads', 'f32'),
    ('int8', 'openvino 1, int8 with bf16, a processor, 1 threads', 'int8')])
def test_a_replay_computes_in_the_precision_that_auto_was(asked, told, expected):
    run = replace(run_of([]), parameters={'reconstructor': {'precision': asked}},
                  provenance={'weights_sha256': weights_hash(SHIPPED), 'computed_by': told})
    assert recorded_setup(run).precision == expected
    assert recorded_setup(replace(run, provenance={})).precision == asked


def test_a_replay_computes_with_the_threads_of_the_run_and_leaves_torch_as_it_was(monkeypatch):
    before, set_to = torch.get_num_threads(), []
    setup = recorded_setup(replace(run_of([]), parameters={
        'reconstructor': {'threads': before + 1, 'runtime': 'torch'}}))
    reconstructor = setup.load_reconstructor()
    setting = torch.set_num_threads
    monkeypatch.setattr(torch, 'set_num_threads',
                        lambda count: (set_to.append(count), setting(count)))
    reconstructor.add_view(image_at(1.0), orbit_camera(1.0))
    assert set_to == [before + 1, before]
    assert torch.get_num_threads() == before
    assert f'{before + 1} threads' in reconstructor.provenance['computed_by']


def test_the_setup_is_that_of_the_bag_with_the_cores_defaults():
    bag = replace(run_of([]), provenance={'weights_sha256': weights_hash()}, parameters={
        'reconstructor': {'weights': '', 'threshold': float('nan'), 'object_size': 0.25,
                          'threads': 2, 'take_views': 'at_goal'},
        'view_planner': {'weights': '', 'policy': 'random', 'seed': 5, 'max_views': 3,
                         'motion_weight': 1, 'azimuth_range': [-1, 2.0],
                         'forbidden_sectors': [0.6, 1.1], 'reachable_azimuths': []}})
    setup = recorded_setup(bag)
    assert setup.weights == SHIPPED
    assert setup.threads == 2
    assert setup.reconstructor == {'object_size': 0.25}
    assert setup.planner == {
        'policy': 'random', 'seed': 5, 'max_views': 3, 'weights': SHIPPED, 'motion_weight': 1.0,
        'azimuth_range': (-1.0, 2.0), 'forbidden_sectors': (0.6, 1.1), 'reachable_azimuths': ()}
    goal = setup.load_planner().first_goal(orbit_camera(0.8))
    assert goal.camera.azimuth == pytest.approx(np.pi / 6)
    assert setup.load_reconstructor().object_size == 0.25


def test_a_replay_has_the_policy_that_auto_came_to():
    bag = replace(run_of([]), provenance={'weights_sha256': weights_hash()}, parameters={
        'view_planner': {'policy': 'auto', 'policy_in_use': 'uniform'}})
    assert recorded_setup(bag).planner['policy'] == 'uniform'
    assert not recorded_setup(bag).load_planner().wants_volume


def test_a_bag_that_names_no_policy_has_no_planner():
    assert recorded_setup(run_of([])).load_planner() is None


def test_weights_are_found_by_their_hash_wherever_they_lie(tmp_path):
    other = FOLDER / '2d3d.safetensors'
    bag = replace(run_of([]), provenance={'weights_sha256': weights_hash(other)})
    assert recorded_setup(bag).weights == other
    moved = tmp_path / 'moved.safetensors'
    moved.write_bytes(b'weights of another day')
    bag = replace(bag, provenance={'weights_sha256': weights_hash(moved)})
    assert recorded_setup(bag, moved).weights == moved
    with pytest.raises(WeightsError, match='which have changed since'):
        recorded_setup(bag)
    for wrong, reason in ((other, 'not the weights of the recording: '),
                          (tmp_path / 'none', 'no such file')):
        with pytest.raises(WeightsError, match=reason):
            recorded_setup(bag, wrong)
    assert recorded_setup(bag, other, any_weights=True).weights == other


@pytest.mark.parametrize(('node', 'parameter', 'value'), [
    ('reconstructor', 'object_size', 'large'), ('reconstructor', 'threads', 0),
    ('reconstructor', 'weights', ['a']), ('view_planner', 'seed', -1),
    ('view_planner', 'max_views', 10**9), ('view_planner', 'policy', 5),
    ('view_planner', 'azimuth_range', 'all'), ('view_planner', 'forbidden_sectors', ['a', 'b'])])
def test_a_recorded_parameter_that_cannot_be_is_refused_by_its_name(node, parameter, value):
    bag = replace(run_of([]), parameters={f'/robot/{node}': {parameter: value}})
    with pytest.raises(DataError, match=f'parameter {parameter}: invalid value: expected'):
        recorded_setup(bag)


def test_size_and_front_are_those_given_else_the_bags_own():
    bag = replace(run_of([]), parameters={'turntable_camera': {'object_size': 2},
                                          'view_planner': {'policy': 'farthest'}})
    assert recorded_setup(bag).reconstructor == {'object_size': 2.0}
    setup = recorded_setup(bag, scene_parameters={'object_size': 0.25, 'object_yaw': 1.0})
    assert setup.reconstructor == {'object_size': 0.25, 'object_yaw': 1.0}
    assert setup.planner['object_yaw'] == 1.0
