"""What choosing views is worth: renderings, oracles, sequences, and luck that does not repeat."""

from dataclasses import replace
import json
import math

from active_recon.datasets.drawn_cameras import DOME_ELEVATIONS, Viewing
from active_recon.datasets.layout import list_objects
from active_recon.datasets.making import make_dataset, shape_jobs
from active_recon.errors import ConfigError, DataError, ViewError
from active_recon.evaluation.next_view import study
from active_recon.evaluation.next_view.choosing import (
    chosen_ahead,
    chosen_by,
    chosen_together,
    judged,
    motion_time,
)
from active_recon.evaluation.next_view.fixed_sequence import find_sequence, FixedSequence
from active_recon.evaluation.next_view.renderings import another_rendering, POSE_ERROR
from active_recon.evaluation.next_view.study import (
    Episodes,
    figures,
    find_offsets,
    Found,
    known_names,
    run_episodes,
)
from active_recon.evaluation.next_view.summary import markdown
from active_recon.evaluation.next_view.swapping import (
    require_same_cameras,
    swapped_row,
    turned,
)
from active_recon.evaluation.next_view.watching import Ahead, Walk, WatchedObject
from active_recon.evaluation.posed.entrants import Entrant
from active_recon.evaluation.posed.scene import read_scene
from active_recon.evaluation.posed.scoring import pooled
from active_recon.evaluation.posed.walking import some_objects
from active_recon.evaluation.rollouts import Observer
from active_recon.geometry.cameras import AZIMUTHS, orbit_camera
from active_recon.geometry.view_distance import pose_directions
from active_recon.models.carving import Carving
from active_recon.models.network import ReconstructionNetwork
from active_recon.policies import load_policy, Observation, POLICIES, PolicyEntry
from active_recon.policies.geometric import FarthestPolicy, UniformPolicy
from active_recon.training.view_gains import some_views
from active_recon.volumes.occupancy_threshold import expected_iou
from coarse_hull import Coarse
import numpy as np
import pytest
import torch


class Chance(ReconstructionNetwork):
    """What it predicts depends on the last bits of its images alone: all IoU is luck."""

    image_size, resolution, needs_front = 128, 32, False

    def initial_state(self, batch):
        return {'sum': torch.zeros(batch, dtype=torch.float64),
                'latent': torch.zeros(batch, 1, 4, 4)}

    def encode(self, images, cameras):
        return images.double().mean(dim=(1, 2, 3))

    def update(self, encoded, cameras, state):
        return {'sum': state['sum'] + encoded, 'latent': state['latent']}

    def decode(self, state):
        level = (state['sum'] * 1e6) % 1
        filled = (torch.arange(32 ** 3) + 0.5) / 32 ** 3 < level[:, None]
        return torch.where(filled, 5.0, -5.0).reshape(-1, 32, 32, 32)


@pytest.fixture(scope='module')
def scene(tmp_path_factory):
    """Return two lamps and two chairs on a turntable, 32 cells a side."""
    folder = tmp_path_factory.mktemp('turntable')
    for category in ('lamp', 'chair'):
        list(make_dataset(shape_jobs(category, range(2), folder), 1,
                          viewing=Viewing('turntable', 6)))
    return read_scene(list_objects(folder), [Carving(0)])


@pytest.fixture(scope='module')
def dome(tmp_path_factory):
    """Return a lamp under a dome of cameras."""
    folder = tmp_path_factory.mktemp('dome') / 'lamp'
    list(make_dataset(shape_jobs('lamp', range(1), folder), 1, viewing=Viewing('dome', 6)))
    return read_scene(list_objects(folder), [Carving(0)])


@pytest.fixture
def carving():
    return Entrant('carving', Coarse(0).eval(), {32: 0.5})


@pytest.fixture
def watched(scene, carving):
    views = some_objects(scene.views, torch.tensor([1]))
    return WatchedObject(carving.network, views, scene.truths[32][1], 0.5)


@pytest.fixture
def few(scene, carving):
    """Return an object of eight views: every pair of them is soon tried."""
    views = some_views(some_objects(scene.views, torch.tensor([1])), np.arange(0, 24, 3))
    return WatchedObject(carving.network, views, scene.truths[32][1], 0.5)


@pytest.fixture
def ring(scene):
    """Return the same objects of eight views each."""
    return replace(scene, framed={128: some_views(scene.views, np.arange(0, 24, 3))})


@pytest.fixture
def short():
    return Episodes(('random', 'uniform', 'visible_entropy', 'peeking', 'oracle'), 2, 3, 2,
                    bfloat16=False)


@pytest.mark.slow
def test_two_renderings_show_the_same_outlines_in_another_light_from_a_little_beside(scene):
    one, other = (another_rendering(scene.views, seed) for seed in (1, 2))
    colors = [rendering.images[..., :3].double() for rendering in (one, other)]
    alpha = scene.views.images[..., 3:]
    for rendering in (one, other):
        torch.testing.assert_close(rendering.images[..., 3:], alpha)
        assert (rendering.images[..., :3] <= alpha).all()
        turn = rendering.poses[..., :3, :3] @ scene.views.poses[..., :3, :3].mT
        angle = torch.acos((turn.diagonal(dim1=-2, dim2=-1).sum(-1) - 1) / 2)
        torch.testing.assert_close(angle, torch.full_like(angle, POSE_ERROR), rtol=1e-3, atol=0)
    on_object = (alpha > 0).expand_as(one.images[..., :3])
    apart = (colors[0] - colors[1])[on_object].abs().mean()
    assert 3 < apart < 60
    again = another_rendering(scene.views, 1)
    torch.testing.assert_close(again.images, one.images)
    torch.testing.assert_close(again.poses, one.poses)


def test_looking_ahead_knows_what_walking_there_brings(watched):
    walk = watched.step(watched.begin(3), 10)
    ahead = watched.ahead(walk)
    assert np.flatnonzero(np.isnan(ahead.iou)).tolist() == [3, 10]
    for view in (0, 7, 23):
        assert judged(watched, (3, 10, view))[2] == pytest.approx(ahead.iou[view], abs=1e-5)


@torch.inference_mode()
def test_the_iou_that_is_expected_is_that_of_the_probabilities(scene):
    fine = Carving(0).eval()
    observer, state = Observer(fine, scene.views), fine.initial_state(1)
    for view in (0, 5):
        state = observer.update(torch.tensor([1]), torch.tensor([view]), state)
    occupancy = pooled(observer.occupancy(state)[0].numpy(), 32)
    watched = WatchedObject(
        fine, some_objects(scene.views, torch.tensor([1])), scene.truths[32][1], 0.5)
    assert watched.ahead(watched.begin(0)).expected[5] == pytest.approx(
        expected_iou(occupancy, occupancy > 0.5), abs=1e-4)


def test_the_oracle_takes_what_is_best_and_no_policy_has_a_better_second_view(watched):
    order = chosen_ahead(lambda ahead: ahead.iou, watched, 5, 3)
    assert order[0] == 5 and len(set(order)) == 3
    best = judged(watched, order)[1]
    assert best == pytest.approx(np.nanmax(watched.ahead(watched.begin(5)).iou))
    for policy in (UniformPolicy(3), FarthestPolicy(), load_policy('unseen_entropy')):
        assert judged(watched, chosen_by(policy, watched, 5, 3))[1] <= best + 1e-6


def test_no_three_views_from_a_start_are_better_than_those_that_are_best_together(few):
    order = chosen_together(few, 5, 3)
    assert order[0] == 5 and len(set(order)) == 3
    pairs = [(one, other) for one in range(8) for other in range(one) if 5 not in (one, other)]
    best = judged(few, order)
    assert best[2] == pytest.approx(max(judged(few, (5, *pair))[2] for pair in pairs))
    assert best[1] >= judged(few, (5, order[2]))[1]
    assert best[2] >= judged(few, chosen_ahead(lambda ahead: ahead.iou, few, 5, 3))[2]


def test_views_after_those_that_are_best_together_are_the_oracles(few):
    order = chosen_together(few, 5, 4)
    walk = few.begin(5)
    for view in order[1:3]:
        walk = few.step(walk, view)
    assert order[:3] == chosen_together(few, 5, 3)
    assert order[3] == np.nanargmax(few.ahead(walk).iou)
    assert chosen_together(few, 5, 2) == chosen_ahead(
        lambda ahead: ahead.iou, few, 5, 2)


def test_pairs_are_not_tried_where_there_are_two_views(few, monkeypatch):
    looked = []
    ahead = type(few).ahead
    monkeypatch.setattr(type(few), 'ahead', lambda own, walk: (
        looked.append(walk.taken), ahead(own, walk))[1])
    chosen_together(few, 5, 2)
    assert looked == [(5,)]


def test_the_more_motion_costs_the_less_a_policy_moves_and_no_view_is_taken_twice(watched):
    orders = [chosen_by(load_policy('visible_entropy'), watched, 5, 6, cost)
              for cost in (0.0, 0.2, 100.0)]
    times = [motion_time(watched, order) for order in orders]
    assert times == sorted(times, reverse=True) and times[0] > times[2]
    assert times[2] == pytest.approx(5 * math.radians(15))
    assert all(len(set(order)) == 6 for order in orders)


def test_the_motion_of_an_even_sweep_is_the_way_around(watched):
    assert motion_time(watched, (5, 11, 17, 23)) == pytest.approx(math.radians(270))
    assert motion_time(watched, (0, 12, 0)) == pytest.approx(math.radians(360))


def test_a_policy_s_views_are_where_it_goes(watched):
    assert chosen_by(UniformPolicy(4), watched, 5, 4) == (5, 11, 17, 23)
    assert chosen_by(FarthestPolicy(), watched, 0, 2) == (0, 12)
    assert sorted(chosen_by(FarthestPolicy(), watched, 3, 30)) == list(range(24))


class Fails(FarthestPolicy):
    """A policy with a fault of its own."""

    def choose(self, seen, state):
        return 1 / 0


def test_a_policy_that_fails_is_told_where_its_views_are_chosen(watched):
    with pytest.raises(ViewError, match='policy: fails with ZeroDivisionError: division'):
        chosen_by(Fails(), watched, 5, 4)


def test_of_several_policies_the_one_that_fails_is_named(ring, carving, monkeypatch):
    monkeypatch.setitem(POLICIES, 'mine', PolicyEntry(lambda options: Fails()))
    with pytest.raises(ViewError, match='^mine@0.01: policy: fails with ZeroDivisionError'):
        run_episodes(ring, carving, Episodes(('uniform', 'mine@0.01'), 1, 2, bfloat16=False))


def test_a_sweep_of_more_views_than_there_are_takes_each_once():
    ring = Planted((1,), AZIMUTHS[::6])
    assert sorted(chosen_by(UniformPolicy(5), ring, 0, 5)) == [0, 1, 2, 3]


class Planted:
    """A ring of cameras of which the same places around the first are always best."""

    def __init__(self, best, azimuths=AZIMUTHS, easy=0.0):
        self.views = self
        self.poses = torch.from_numpy(np.stack([orbit_camera(at).pose for at in azimuths]))[None]
        self.best, self.count, self.easy = best, len(azimuths), easy

    def begin(self, view):
        return Walk((view,), {})

    def step(self, walk, view):
        return Walk((*walk.taken, view), {})

    def ahead(self, walk):
        worth = self.easy + np.arange(self.count) / 1000
        worth[(walk.taken[0] + self.best[len(walk.taken) - 1]) % self.count] += 0.1
        worth[list(walk.taken)] = np.nan
        return Ahead(worth, worth)

    def observation(self, walk, wants_volume):
        poses = self.poses.numpy()
        return Observation(np.zeros((1, 1, 4, 4), np.float32), poses[:, list(walk.taken)], poses)


def test_a_sequence_that_is_best_for_all_is_found_and_followed_from_any_start():
    objects, starts = [Planted((7, 18, 3)) for _ in range(5)], [0, 3, 11, 20, 23]
    offsets = find_sequence(objects, starts, 4)
    np.testing.assert_allclose(np.degrees(offsets), [[105, 30], [270, 30], [45, 30]], atol=0.1)
    taken = chosen_by(FixedSequence(offsets), objects[0], 22, 4)
    assert taken == (22, 5, 16, 1)
    assert len(set(chosen_by(FixedSequence(np.zeros((3, 2))), objects[0], 4, 4))) == 4


def test_a_sequence_is_as_long_as_objects_have_views():
    ring = Planted((2, 1, 3, 1), AZIMUTHS[::6])
    offsets = find_sequence([ring, ring], [0, 3], 6)
    np.testing.assert_allclose(np.degrees(offsets), [[180, 30], [90, 30], [270, 30]], atol=0.1)
    assert chosen_by(FixedSequence(offsets), ring, 1, 6) == (1, 3, 2, 0)
    with pytest.raises(DataError, match='nothing to choose: expected .* two views or more'):
        find_sequence([Planted((0,), AZIMUTHS[:1])], [0], 5)


def test_places_that_only_an_easy_object_has_are_not_therefore_better():
    whole = [Planted((4,)) for _ in range(3)]
    easy = [Planted((1,), AZIMUTHS[::2], easy=0.8) for _ in range(4)]  # 30 degrees on
    common = find_sequence([*whole, *easy], [0] * 7, 2)
    np.testing.assert_allclose(np.degrees(common), [[30, 30]], atol=0.1)
    rest = find_sequence([*[Planted((3,)) for _ in range(5)], *easy], [0] * 9, 2)
    np.testing.assert_allclose(np.degrees(rest), [[45, 30]], atol=0.1)  # of the five alone


def test_without_common_places_there_is_no_sequence():
    rng = np.random.default_rng(0)
    objects = [Planted((1, 2), rng.uniform(0, math.tau, 6)) for _ in range(4)]
    with pytest.raises(DataError, match='expected a grid of azimuths'):
        find_sequence(objects, [0, 1, 2, 3], 3)


@pytest.mark.slow
def test_luck_does_not_repeat(scene):
    full = replace(scene, framed={128: some_views(scene.views, np.arange(0, 24, 2))},
                   truths={32: torch.ones(4, 32, 32, 32, dtype=torch.bool)})
    found = figures(run_episodes(full, Entrant('chance', Chance(), {32: 0.5}), Episodes(
        ('random', 'oracle'), 6, 4, 3, bfloat16=False)))
    assert found['gap']['same']['low'] > 0.2
    assert found['gap']['repeatable']['low'] < 0 < found['gap']['repeatable']['high']


def test_a_study_tells_every_policy_s_figures_and_json_holds_them(ring, carving, short):
    told = []
    found = run_episodes(ring, carving, short, advance=told.append)
    assert sum(told) == 4
    assert found.other['random'].shape == (4, 2, 2, 3)
    assert found.other['oracle'].shape == (4, 2, 1, 3) and set(found.same) == {'random', 'oracle'}
    result = figures(found)
    assert json.loads(json.dumps(result, allow_nan=False)) == result
    shares = [result['policies'][name]['share'] for name in ('random', 'oracle')]
    assert [share['mean'] for share in shares] == pytest.approx([0, 1])
    assert result['gap']['same']['low'] > 0
    ahead = result['policies']['uniform']['ahead']
    assert set(ahead) == set(short.policies) - {'uniform'}
    first = {json.dumps(own['iou'][0]['mean'])[:8] for own in result['policies'].values()}
    assert len(first) == 1  # no policy chose it
    again = run_episodes(ring, carving, replace(short, policies=('random',)))
    np.testing.assert_array_equal(again.other['random'], found.other['random'])


def test_a_sequence_found_on_objects_is_measured_like_a_policy(ring, carving):
    episodes = Episodes(('sequence', 'uniform'), 1, 3, bfloat16=False)
    with pytest.raises(ConfigError, match='expected training objects'):
        run_episodes(ring, carving, episodes)
    offsets = find_offsets(ring, carving, episodes)
    assert offsets.shape == (2, 2)
    result = figures(run_episodes(ring, carving, episodes, offsets))
    assert 'gap' not in result and 'share' not in result['policies']['sequence']
    text = markdown({'command': 'a command', 'sets': [
        {'data': 'd', 'objects': 4, 'views': 8, 'starts': 1, 'side': 32, **result}],
        'sequence': {'offsets_deg': np.degrees(offsets).tolist(), 'objects': 4, 'data': 't'}})
    assert '| sequence |' in text and 'ahead of uniform' in text


@pytest.mark.parametrize(('name', 'looking'), [
    ('swapped', 'visible_entropy'), ('swapped_turned', 'visible_entropy'),
    ('swapped@1e-6', 'visible_entropy@1e-6')])
def test_swapped_looks_at_another_object_and_only_there(ring, carving, monkeypatch, name,
                                                        looking):
    monkeypatch.setattr(study, '_LOOKS_ELSEWHERE', 'visible_entropy')
    monkeypatch.setattr(study, 'turned', lambda views, rng: views)
    episodes = Episodes((looking, name), 1, 3, bfloat16=False)
    lone = replace(ring, framed={128: some_objects(ring.views, torch.tensor([1]))},
                   truths={32: ring.truths[32][1:2]})
    same = run_episodes(lone, carving, episodes)
    np.testing.assert_array_equal(same.other[name], same.other[looking])
    found = run_episodes(ring, carving, episodes)
    assert (found.motion[name] != found.motion[looking]).any()


def test_what_is_swapped_in_is_another_object_of_the_set_and_each_comes_once():
    for count in (2, 3, 8, 61):
        rows = [swapped_row(row, count) for row in range(count)]
        assert sorted(rows) == list(range(count))
        assert all(row != other for row, other in enumerate(rows))


def test_another_object_is_only_shown_where_the_same_cameras_see_it(scene):
    views = scene.views
    require_same_cameras(views)
    poses = views.poses.clone()
    poses[1] = poses[1].roll(1, dims=0)
    with pytest.raises(DataError, match='no other object can be shown'):
        require_same_cameras(replace(views, poses=poses))


def test_cameras_see_of_a_turned_object_what_others_saw(scene):
    views = some_objects(scene.views, torch.tensor([1]))
    found = {}
    for seed in range(40):
        images = turned(views, np.random.default_rng(seed)).images
        steps = [step for step in range(24)
                 if torch.equal(images, views.images.roll(step, dims=1))]
        assert steps  # the cameras are 15 degrees apart, in order
        found.setdefault(steps[0], seed)
    assert len(found) > 10


def test_an_object_turned_by_azimuth_is_seen_so_from_every_elevation(dome):
    images = turned(dome.views, np.random.default_rng(3)).images
    rings = [part.reshape(1, 4, 12, *part.shape[2:]) for part in (images, dome.views.images)]
    assert any(torch.equal(rings[0], rings[1].roll(step, dims=2)) for step in range(1, 12))


def test_an_object_among_cameras_that_are_no_grid_cannot_be_turned(scene):
    odd = some_views(some_objects(scene.views, torch.tensor([1])), np.array([0, 1, 5, 12]))
    with pytest.raises(DataError, match='expected a grid of azimuths'):
        for seed in range(9):
            turned(odd, np.random.default_rng(seed))


def test_without_a_gap_nothing_has_a_share_of_it():
    alike = np.random.default_rng(0).random((5, 2, 1, 3))
    result = figures(Found(*[{'random': alike, 'oracle': alike}] * 2,
                           {name: alike[..., 0] for name in ('random', 'oracle')}))
    assert result['policies']['random']['share'] is None
    assert result['gap']['repeatable']['mean'] == 0


def test_policies_that_there_are_not_and_episodes_without_a_choice_are_refused():
    with pytest.raises(ConfigError, match="no such policy: expected some of attention.*'best'"):
        Episodes(('random', 'best'))
    with pytest.raises(ConfigError, match='nothing to choose'):
        Episodes(('random',), count=1)
    with pytest.raises(ConfigError, match="expected NAME@COST .* got 'uniform@much'"):
        Episodes(('random', 'uniform@much'))
    for name in ('peeking@0.1', 'oracle@0.1', 'together@0.1'):
        with pytest.raises(ConfigError, match=f'oracle and together without, got {name!r}'):
            Episodes(('random', name))
    assert {'attention', 'sequence', 'peeking', 'oracle'} <= set(known_names())


def test_a_dome_is_a_grid_of_azimuths_at_four_elevations(dome):
    cameras, lights = Viewing('dome').of('chair/one')
    directions = pose_directions(np.array([camera.pose for camera in cameras]))
    elevations = np.arcsin(directions[:, 2]).round(6)
    assert sorted(set(elevations)) == pytest.approx(DOME_ELEVATIONS)
    assert len(cameras) == len(lights) == 48 == len(set(map(tuple, directions.round(6))))
    assert [camera.azimuth for camera in cameras[:12]] == pytest.approx(AZIMUTHS[::2])
    np.testing.assert_allclose(pose_directions(dome.views.poses[0].numpy()), directions,
                               atol=1e-6)
