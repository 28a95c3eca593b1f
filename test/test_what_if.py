"""A run with overrides: another model or threshold, another policy among recorded views."""

from dataclasses import replace
import math
from pathlib import Path

from active_recon.bags.replay.comparison import compare, SAME_BITS
from active_recon.bags.replay.other_cube import about
from active_recon.bags.replay.replay import replay
from active_recon.bags.replay.what_if import (
    default_folder,
    reconstruct_episode,
    replan_episode,
    run_with_overrides,
)
from active_recon.bags.runs.loop_setup import LoopSetup, Overrides, recorded_setup
from active_recon.bags.runs.run import RecordedEpisode, RecordedView
from active_recon.errors import DataError
from active_recon.geometry.cameras import AZIMUTHS, orbit_camera
from active_recon.models.network_2d3d import Network2d3d
from active_recon.models.weights import Bundle, save_weights
from active_recon.models.weights_files import config_hash, weights_hash
from active_recon.planner import Planner
from active_recon.policies.geometric import FarthestPolicy, UniformPolicy
from active_recon.volumes.depth_images import DepthImage
import numpy as np
import pytest
from recorded_runs import episode_of, image_at, loop_of, policies, run_of, SECOND, THRESHOLD
import torch


@pytest.fixture
def sweep():
    """Return an episode of all 24 azimuths that nobody has asked for."""
    views = [RecordedView(SECOND * (number + 2), image_at(azimuth), orbit_camera(azimuth), None,
                          None, None, None, None, {}) for number, azimuth in enumerate(AZIMUTHS)]
    return RecordedEpisode('sweep', SECOND, None, views, '')


@pytest.fixture
def loop(network, attention):
    return loop_of(network, policies(attention)['attention']())


def azimuths(episode):
    return [view.camera.azimuth for view in episode.views]


def test_a_policy_gets_the_views_that_it_asks_for(sweep, loop):
    reconstructor, _ = loop
    episode = replan_episode(sweep, reconstructor, Planner(UniformPolicy(4), 4, 0.0), 0.14)
    np.testing.assert_allclose(azimuths(episode), np.radians([0, 90, 180, 270]), atol=1e-9)
    goals = [view.goal and view.goal.camera for view in episode.views]
    assert [goal and round(math.degrees(goal.azimuth)) for goal in goals] == [90, 180, 270, None]
    assert episode.done == 'max_views'
    images = {view.image.tobytes() for view in sweep.views}
    assert all(view.image.tobytes() in images for view in episode.views)


def test_a_replanned_episode_is_a_run_like_a_recorded_one(sweep, loop):
    run = run_of([replan_episode(sweep, *loop, 0.14)])
    stamps = [stamp for view in run.episodes[0].views
              for stamp in (view.stamp, view.goal.stamp if view.goal else view.stamp + 1)]
    assert stamps == sorted(set(stamps))
    assert stamps[0] > run.episodes[0].first_goal.stamp >= run.episodes[0].begin
    assert compare(replay(run, *loop), THRESHOLD).verdict == SAME_BITS


def test_replanning_with_the_same_policy_takes_the_same_views(loop):
    episode = episode_of(*loop, SECOND, 1.0)
    again = replan_episode(episode, *loop, 0.14)
    assert azimuths(again) == azimuths(episode)
    for before, after in zip(episode.views, again.views, strict=True):
        np.testing.assert_array_equal(before.reconstruction.occupancy,
                                      after.reconstruction.occupancy)
        assert before.entropy == after.entropy
    assert again.done == episode.done


def test_a_view_that_was_never_taken_is_refused_by_its_azimuth(sweep, loop):
    reconstructor, _ = loop
    half = replace(sweep, views=sweep.views[:12])  # 0 to 165 degrees
    with pytest.raises(DataError, match='after view 1, azimuth 180.0 degrees.* 13.0 off'):
        replan_episode(half, reconstructor, Planner(FarthestPolicy(), 4, 0.0), 0.14)


def test_an_episode_without_views_is_refused(sweep, loop):
    with pytest.raises(DataError, match='no views in the episode'):
        replan_episode(replace(sweep, views=[]), *loop, 0.14)


def test_another_threshold_changes_the_occupied_cells_alone(loop):
    episode = episode_of(*loop, SECOND, 1.0)
    reconstructor, _ = loop
    reconstructor.threshold = 0.2
    again = reconstruct_episode(episode, reconstructor)
    for before, after in zip(episode.views, again.views, strict=True):
        kept = before.reconstruction.occupancy > 0.2
        np.testing.assert_array_equal(after.occupied.occupancy > 0, kept)
        assert 0 < kept.sum() < (before.occupied.occupancy > 0).sum()
        assert (after.stamp, after.goal, after.entropy) == (
            before.stamp, before.goal, before.entropy)


@pytest.fixture
def weights(tmp_path, tiny, network, attention):
    """Return two weights files, the first of them that of `network`."""
    torch.manual_seed(1)
    paths = [tmp_path / 'one.safetensors', tmp_path / 'two.safetensors']
    for path, net in zip(paths, [network, Network2d3d.from_config(tiny)], strict=True):
        save_weights(path, Bundle(net, attention, tiny, THRESHOLD))
    return paths


def test_a_run_with_overrides_says_so_and_replays_to_the_same_bits(
        sweep, weights, tiny, tmp_path):
    recorded = LoopSetup(weights[0], {'object_size': 1.0}, None)
    run = replace(run_of([sweep]), path=tmp_path / 'walk', provenance={
        'object': 'chair', 'config_sha256': 'old'})
    other = run_with_overrides(run, recorded, Overrides(weights[1], 'attention', 0.12))
    assert other.provenance == {
        'object': 'chair', 'policy': 'attention', 'replay_of': 'walk', 'version': '0.1.0',
        'weights_sha256': weights_hash(weights[1]), 'config_sha256': config_hash(tiny),
        'computed_by': f'torch {torch.__version__}, f32, cpu, 1 threads', 'needs_front': 'true'}
    setup = recorded_setup(other)
    assert setup.weights == weights[1]
    assert setup.planner['policy'] == 'attention'
    assert compare(replay(other, setup.load_reconstructor(), setup.load_planner()),
                   0.12).verdict == SAME_BITS


@pytest.mark.parametrize('overrides', [Overrides(threshold=0.2), Overrides(policy='uniform')])
def test_a_run_with_overrides_is_computed_from_the_whole_images(
        sweep, weights, tmp_path, overrides):
    others = [replace(view, reduced=lambda by, view=view: (255 - view.image, view.camera))
              for view in sweep.views]
    (whole,), (found,) = (
        run_with_overrides(replace(run_of([episode]), path=tmp_path),
                           LoopSetup(weights[0], {}, None), overrides).episodes
        for episode in (sweep, replace(sweep, views=others)))
    for view, expected in zip(found.views, whole.views, strict=True):
        np.testing.assert_array_equal(view.latent, expected.latent)
        np.testing.assert_array_equal(view.reconstruction.occupancy,
                                      expected.reconstruction.occupancy)


def test_other_weights_are_computed_as_they_can_be_and_not_as_those_of_the_recording(
        sweep, weights):
    run = replace(run_of([sweep]), provenance={
        'weights_sha256': weights_hash(weights[0]),
        'computed_by': 'openvino 2026.4, bf16, a CPU, 2 threads'})
    assert recorded_setup(run, weights[0]).precision == 'bf16'
    assert recorded_setup(run, weights[1], any_weights=True).precision == 'auto'


def test_the_views_of_several_episodes_stay_apart_and_one_without_views_stays_so(
        weights, sweep, tmp_path):
    soon = replace(sweep, id='soon', begin=2 * SECOND)  # its views are a second apart
    empty = replace(sweep, id='empty', begin=3 * SECOND, views=[])
    run = replace(run_of([sweep, soon, empty]), path=tmp_path)
    other = run_with_overrides(run, LoopSetup(weights[0], {}, None), Overrides(policy='uniform'))
    assert [len(episode.views) for episode in other.episodes] == [3, 3, 0]
    times = [time for episode in other.episodes
             for time in (episode.begin, *(view.stamp for view in episode.views))]
    assert times == sorted(times)
    stamps = [view.stamp for episode in other.episodes for view in episode.views]
    assert len(set(stamps)) == len(stamps)
    with pytest.raises(DataError, match='no views in the bag'):
        run_with_overrides(replace(run, episodes=[empty]), LoopSetup(weights[0], {}, None),
                           Overrides(policy='uniform'))


def test_the_topics_of_a_new_bag_have_their_own_names_and_it_knows_its_object(
        weights, sweep, tmp_path):
    shown = {'/cell/turntable_camera': {'mesh': 'chair'}}
    run = replace(run_of([sweep]), path=tmp_path, parameters=shown, provenance={
        'object': 'chair', '/cell/camera/image_raw': '/usb_cam/image', 'view': '/shots'})
    other = run_with_overrides(run, LoopSetup(weights[0], {}, None), Overrides(threshold=0.2))
    assert other.provenance['object'] == 'chair'
    assert not {'/cell/camera/image_raw', 'view'} & other.provenance.keys()
    assert other.parameters['/cell/turntable_camera'] == {'mesh': 'chair'}


def test_under_another_model_alone_nothing_tells_who_chose_the_views(weights, tmp_path, loop):
    run = replace(run_of([episode_of(*loop, SECOND, 1.0)]), path=tmp_path, parameters={
        '/view_planner': {'policy': 'attention', 'weights': str(weights[0]), 'max_views': 3}})
    recorded = LoopSetup(weights[0], {}, {'policy': 'attention', 'weights': weights[0]})
    other = run_with_overrides(run, recorded, Overrides(weights=weights[1]))
    assert azimuths(other.episodes[0]) == azimuths(run.episodes[0])
    assert '/view_planner' not in other.parameters
    same_model = run_with_overrides(run, recorded, Overrides(threshold=0.2))
    assert same_model.parameters['/view_planner']['max_views'] == 3
    assert same_model.parameters['/reconstructor']['threshold'] == 0.2


def test_in_another_cube_a_run_is_that_of_a_loop_which_had_it(weights, sweep, tmp_path):
    centre = np.array([0.2, -0.1, 0.3])
    away = replace(run_of([about(sweep, -centre)]), path=tmp_path, parameters={
        '/reconstructor': {'object_size': 2.0, 'object_frame': 'table'},
        '/turntable_camera': {'mesh': 'chair'}, '/view_planner': {'policy': 'attention'}})
    wide = LoopSetup(weights[0], {'object_size': 2.0}, {'policy': 'attention'})
    found = run_with_overrides(away, wide, Overrides(box=(*centre.tolist(), 1.0)))
    expected = reconstruct_episode(
        sweep, LoopSetup(weights[0], {'object_size': 1.0}, None).load_reconstructor())
    for view, own in zip(found.episodes[0].views, expected.views, strict=True):
        np.testing.assert_allclose(view.camera.pose, own.camera.pose, atol=1e-12)
        assert view.reconstruction.size == 1.0
        np.testing.assert_allclose(view.reconstruction.occupancy, own.reconstruction.occupancy,
                                   atol=1e-5)
    assert set(found.parameters) == {'/reconstructor'}  # the cube of the others is another one
    assert found.parameters['/reconstructor']['object_size'] == 1.0
    assert found.parameters['/reconstructor']['object_frame'] == 'object'


def test_about_another_middle_goals_and_depth_are_where_they_were(loop):
    episode = episode_of(*loop, SECOND, 1.0, given_up=(1,))
    apart = orbit_camera(0.5, 0.2, 3.0)
    deep = DepthImage(np.ones((4, 4), np.float32), apart)
    episode = replace(episode, views=[replace(episode.views[0], depth=deep), *episode.views[1:]])
    centre = np.array([0.3, 0.0, -0.2])
    moved = about(episode, centre)
    before, after = (each.first_goal.final for each in (episode, moved))
    np.testing.assert_allclose(after.camera.position, before.camera.position - centre)
    np.testing.assert_allclose(after.candidates.positions, before.candidates.positions - centre)
    x, y, _ = after.candidates.positions.T
    np.testing.assert_allclose(after.candidates.azimuths, np.arctan2(y, x) % (2 * np.pi))
    np.testing.assert_allclose(moved.views[0].depth.camera.position, apart.position - centre)
    back = about(moved, -centre)
    for view, own in zip(back.views, episode.views, strict=True):
        np.testing.assert_allclose(view.camera.pose, own.camera.pose, atol=1e-12)
        assert (view.goal is None) == (own.goal is None)


def test_another_policy_takes_the_place_of_what_auto_came_to(weights, sweep, tmp_path):
    run = replace(run_of([sweep]), path=tmp_path, parameters={'/view_planner': {
        'policy': 'auto', 'policy_in_use': 'attention', 'weights': str(weights[0])}})
    other = run_with_overrides(
        run, LoopSetup(weights[0], {}, {'policy': 'attention', 'weights': weights[0]}),
        Overrides(policy='farthest'))
    assert other.provenance['policy'] == 'farthest'
    assert recorded_setup(other).planner['policy'] == 'farthest'


def test_each_model_has_its_own_threshold_unless_one_is_given(weights):
    recorded = LoopSetup(weights[0], {'threshold': 0.3}, None)
    assert recorded.with_overrides(
        Overrides(weights[1])).load_reconstructor().threshold == THRESHOLD
    assert recorded.with_overrides(
        Overrides(weights[1], threshold=0.2)).load_reconstructor().threshold == 0.2
    assert recorded.with_overrides(
        Overrides(policy='farthest')).load_reconstructor().threshold == 0.3


def test_the_new_bag_lies_beside_the_old_one_wherever_the_user_stands(tmp_path, monkeypatch):
    bag = tmp_path / 'run.of.today'
    bag.mkdir()
    monkeypatch.chdir(bag)
    overrides = Overrides(Path('some/2d3d.safetensors'), 'farthest', 0.25)
    expected = tmp_path / 'run.of.today_2d3d_farthest_threshold-0.25'
    assert default_folder(Path('.'), overrides) == default_folder(bag, overrides) == expected
    assert default_folder(tmp_path / 'one.mcap', Overrides(policy='random')) == (
        tmp_path / 'one_random')
