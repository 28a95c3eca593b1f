"""The planner: where next, when it is enough, and in whose frame."""

import gc
import math
import weakref

from active_recon.acquisition.motion import MotionLimits
from active_recon.acquisition.motion_cost import TimedMotion
from active_recon.errors import ConfigError, ViewError
from active_recon.geometry.cameras import azimuth_difference, AZIMUTHS, Camera, orbit_camera
from active_recon.models import candidate_looks, sight
from active_recon.planner import Planner
from active_recon.policies import Choice, scoring
from active_recon.policies.attention import AttentionPolicy
from active_recon.policies.geometric import FarthestPolicy, RandomPolicy, UniformPolicy
from active_recon.runtimes.torch import TorchPolicyRuntime
from active_recon.volumes.voxels import VoxelGrid
from judged_quality import quality_of
import numpy as np
import pytest

LATENT = np.random.default_rng(0).normal(size=(8, 4, 4)).astype(np.float32)


def learned(attention):
    return AttentionPolicy(TorchPolicyRuntime(attention))


def views_until_done(planner, entropies):
    """Follow every goal; return the number of views taken and the reason for the end."""
    camera = planner.first_goal(orbit_camera(0.0)).camera
    for count, entropy in enumerate(entropies, 1):
        decision = planner.add_view(LATENT, camera, entropy)
        if decision.goal is None:
            return count, decision.reason
        camera = decision.goal.camera
    return len(entropies), ''


@pytest.mark.parametrize('most', [1, 2, 5])
def test_it_stops_after_max_views(most):
    planner = Planner(FarthestPolicy(), max_views=most)
    assert views_until_done(planner, [100, 10, 1000, 1, 50]) == (most, 'max_views')


def test_it_stops_when_the_entropy_has_settled_over_two_views():
    planner = Planner(FarthestPolicy(), max_views=24, entropy_tolerance=0.01)
    assert views_until_done(planner, [100, 99.5, 90, 89.5, 89.2]) == (5, 'entropy_settled')


@pytest.mark.parametrize('entropies', [[100, 100], [100, 98, 100, 98, 100], [1, 1.1, 1.2, 1.3]])
def test_an_entropy_that_still_changes_has_not_settled(entropies):
    planner = Planner(FarthestPolicy(), max_views=24, entropy_tolerance=0.01)
    assert views_until_done(planner, entropies) == (len(entropies), '')


def test_an_entropy_of_nothing_left_has_settled():
    assert views_until_done(Planner(FarthestPolicy(), 24), [0.0] * 5) == (3, 'entropy_settled')


def test_a_tolerance_of_zero_never_settles():
    planner = Planner(FarthestPolicy(), max_views=6, entropy_tolerance=0)
    assert views_until_done(planner, [5.0] * 6) == (6, 'max_views')


@pytest.mark.parametrize('half', [0.6, 1.0, 1.5])
@pytest.mark.parametrize('first', [-1.0, 0.0, 1.0])
def test_an_even_sweep_is_even_within_the_azimuths_that_the_camera_can_reach(half, first):
    planner = Planner(UniformPolicy(5), 5, 0, limits=MotionLimits((-half, half)))
    goal, taken = planner.first_goal(orbit_camera(first * half)), []
    while goal is not None:
        taken.append(float(azimuth_difference(goal.camera.azimuth, 0.0)))
        goal = planner.add_view(np.zeros((1, 4, 4), np.float32), goal.camera, 10.0).goal
    assert len(taken) == 5
    # Each is at the candidate nearest to its place, and those are 15 degrees apart
    assert np.diff(sorted(taken)).max() <= 2 * half / 4 + math.pi / 12


def test_the_first_view_is_where_it_is_asked_for():
    goal = Planner(FarthestPolicy()).first_goal(orbit_camera(-1.0))
    assert goal.camera.azimuth == pytest.approx(math.tau - 1.0)
    best = goal.candidates[goal.scores.argmax()]
    assert abs(azimuth_difference(best.azimuth, -1.0)) < math.pi / 24


def test_a_plan_repeats_the_goal_also_when_the_episode_is_done():
    planner = Planner(FarthestPolicy(), max_views=2)
    first = planner.first_goal(orbit_camera(0.3))
    assert planner.plan() is first
    second = planner.add_view(LATENT, orbit_camera(0.3), 10).goal
    assert planner.plan() is second
    assert planner.plan() is second
    assert planner.add_view(LATENT, second.camera, 9).goal is None
    after = planner.plan()
    assert after is planner.plan()
    assert abs(azimuth_difference(after.camera.azimuth, second.camera.azimuth)) > 1


def test_there_is_no_plan_before_the_first_view_nor_after_a_reset():
    planner = Planner(FarthestPolicy())
    with pytest.raises(ViewError, match='no view in this episode yet: expected one before a plan'):
        planner.plan()
    planner.first_goal(orbit_camera(0.0))
    planner.reset()
    with pytest.raises(ViewError, match='no view in this episode yet: expected one before a plan'):
        planner.plan()


def test_a_reset_planner_is_as_good_as_new(attention):
    planner = Planner(learned(attention), max_views=4, entropy_tolerance=0)
    runs = []
    for _ in range(2):
        runs.append([planner.add_view(LATENT, orbit_camera(azimuth), 10.0).reason
                     or planner.plan().camera.azimuth for azimuth in (0.0, 2.0, 4.0, 1.0)])
        planner.reset()
    assert runs[0] == runs[1]
    assert runs[0][-1] == 'max_views'


@pytest.mark.parametrize('yaw', [0.3, math.pi / 2, -2.0, 6.0])
@pytest.mark.parametrize('kind', ['farthest', 'uniform', 'attention'])
def test_a_turned_object_turns_everything_with_it(attention, kind, yaw):
    def make(object_yaw):
        policy = {'farthest': FarthestPolicy(), 'uniform': UniformPolicy(5),
                  'attention': learned(attention)}[kind]
        return Planner(policy, object_yaw=object_yaw, entropy_tolerance=0)

    straight, turned = make(0.0), make(yaw)
    for azimuth in (AZIMUTHS[3], AZIMUTHS[9], AZIMUTHS[16]):
        goal = straight.add_view(LATENT, orbit_camera(azimuth), 10.0).goal
        other = turned.add_view(LATENT, orbit_camera(azimuth + yaw), 10.0).goal
        np.testing.assert_allclose(
            other.camera.pose, goal.camera.turned(yaw).pose, atol=1e-5)
        for candidate, before in zip(other.candidates, goal.candidates, strict=True):
            np.testing.assert_allclose(candidate.pose, before.turned(yaw).pose, atol=1e-9)
        np.testing.assert_allclose(other.scores, goal.scores, atol=1e-4)
        assert all(0 <= camera.azimuth < math.tau for camera in (other.camera, *other.candidates))


@pytest.mark.parametrize('wrong', [
    (np.full_like(LATENT, math.nan), orbit_camera(1.0), 10.0),
    (LATENT, orbit_camera(1.0), math.nan), (LATENT, orbit_camera(1.0), math.inf),
    (LATENT[:3], orbit_camera(1.0), 10.0)],
    ids=['latent', 'entropy', 'infinite entropy', 'another latent'])
def test_a_view_that_is_refused_changes_nothing(attention, wrong):
    disturbed, undisturbed = (Planner(learned(attention), 3, 0) for _ in range(2))
    disturbed.add_view(LATENT, orbit_camera(0.0), 10.0)
    before = disturbed.plan()
    with pytest.raises(ViewError, match='latent or entropy not finite|wrong shape of the latent'):
        disturbed.add_view(*wrong)
    assert disturbed.plan() is before
    undisturbed.add_view(LATENT, orbit_camera(0.0), 10.0)
    one, other = (planner.add_view(LATENT, orbit_camera(1.0), 10.0).goal
                  for planner in (disturbed, undisturbed))
    np.testing.assert_array_equal(one.camera.pose, other.camera.pose)


def test_a_policy_that_fails_to_prepare_is_told():
    class Fails(FarthestPolicy):
        def prepare(self, taken, candidates):
            raise RuntimeError('a fault of its own')

    planner = Planner(Fails())
    with pytest.raises(ViewError, match='policy: prepare fails with RuntimeError: a fault of'):
        planner.expect_camera(orbit_camera(0.0), 1.0)
    assert planner.add_view(LATENT, orbit_camera(0.0), 10.0).goal is not None


def test_a_policy_that_fails_is_told_and_nothing_has_changed():
    class Fails(FarthestPolicy):
        def choose(self, seen, state):
            if seen.taken.shape[1] == 2:
                raise RuntimeError('a fault of its own')
            return super().choose(seen, state)

    planner = Planner(Fails(), 5, 0.0)
    asked = planner.add_view(LATENT, orbit_camera(0.0), 10.0).goal
    with pytest.raises(ViewError, match='policy: fails with RuntimeError: a fault of its own'):
        planner.add_view(LATENT, asked.camera, 9.0)
    assert planner.plan() is asked


def test_a_policy_that_fails_to_begin_is_told():
    class Fails(FarthestPolicy):
        def initial_state(self):  # of how many episodes?
            return {}

    with pytest.raises(ViewError, match='policy: initial_state fails with TypeError: .*argument'):
        Planner(Fails())


@pytest.mark.parametrize('azimuth', [math.nan, math.inf, -math.inf])
def test_a_camera_that_is_not_finite_is_none(azimuth):
    with pytest.raises(ViewError, match='expected finite angles'):
        Planner(FarthestPolicy()).first_goal(orbit_camera(azimuth))


@pytest.mark.parametrize(('settings', 'message'), [
    ({'max_views': 0}, 'max_views: too few: expected 1 or more, got 0'),
    ({'entropy_tolerance': 1.0}, r'entropy_tolerance: out of range: expected a share in \[0, '
                                 r'1\), got 1'),
    ({'entropy_tolerance': math.nan}, 'entropy_tolerance: .* got nan'),
    ({'object_yaw': math.inf}, 'object_yaw: not finite: expected radians, got inf'),
])
def test_settings_out_of_range_are_refused_with_the_range(settings, message):
    with pytest.raises(ConfigError, match=message):
        Planner(FarthestPolicy(), **settings)


def test_it_is_loaded_by_the_name_of_its_policy_and_repeats_with_its_seed():
    goals = [Planner.load('random', seed=seed).add_view(LATENT, orbit_camera(0.0), 1.0)
             .goal.camera.azimuth
             for seed in (1, 1, 2)]
    assert goals[0] == goals[1] != goals[2]
    with pytest.raises(ConfigError, match="no policy is called 'best': .* that is installed here"):
        Planner.load('best')


def seen(planner, count):
    """Follow the planner's goals for so many views; return it, and where they were taken."""
    cameras = [planner.first_goal(orbit_camera(1.0)).camera]
    for number in range(count):
        latent = np.random.default_rng(number).normal(size=LATENT.shape).astype(np.float32)
        cameras.append(
            planner.add_view(latent, cameras[-1], 100.0 / (number + 1)).goal.camera)
    return planner, cameras[:-1]


@pytest.mark.parametrize('policy', [
    lambda: RandomPolicy(np.random.default_rng(3)), FarthestPolicy, lambda: UniformPolicy(7)])
def test_a_planner_goes_on_from_what_another_has_seen_as_if_it_had_been_there(policy):
    before, cameras = seen(Planner(UniformPolicy(5), max_views=9), 3)
    after = Planner(policy(), max_views=9)
    after.go_on_from(before)
    always = Planner(policy(), max_views=9)
    for number, camera in enumerate(cameras):
        latent = np.random.default_rng(number).normal(size=LATENT.shape).astype(np.float32)
        always.add_view(latent, camera, 100.0 / (number + 1))
    assert after.plan().camera.azimuth == always.plan().camera.azimuth
    one, other = (each.add_view(LATENT, orbit_camera(2.0), 20.0) for each in (after, always))
    assert one.goal.camera.azimuth == other.goal.camera.azimuth


def test_a_planner_that_goes_on_with_the_same_policy_draws_nothing_anew():
    policy = RandomPolicy(np.random.default_rng(3))
    before, _ = seen(Planner(policy, max_views=9), 2)
    goal = before.plan()
    after = Planner(policy, max_views=3)
    after.go_on_from(before)
    assert after.plan().camera.azimuth == goal.camera.azimuth
    assert after.add_view(LATENT, orbit_camera(2.0), 20.0).reason == 'max_views'


def test_a_first_goal_that_is_open_stays_the_plan_of_the_planner_that_goes_on():
    before = Planner(UniformPolicy(5))
    goal = before.first_goal(orbit_camera(1.0))
    after = Planner(FarthestPolicy())
    after.go_on_from(before)
    assert after.plan().camera.azimuth == goal.camera.azimuth


@pytest.mark.parametrize('policy', [FarthestPolicy, lambda: UniformPolicy(5)])
@pytest.mark.parametrize('elevation_deg', [-20, 0, 45, 80])
def test_a_camera_at_any_elevation_gets_goals_at_its_own(policy, elevation_deg):
    planner, elevation = Planner(policy(), 9, 0.0, distance=0.6), math.radians(elevation_deg)
    goal = planner.first_goal(orbit_camera(1.0, elevation, 0.8))
    for _ in range(4):
        for camera in (goal.camera, *goal.candidates):
            assert (camera.elevation, camera.distance) == pytest.approx((elevation, 0.6))
        goal = planner.add_view(LATENT, orbit_camera(goal.camera.azimuth, elevation, 0.8), 9).goal


def test_goals_stand_at_the_elevation_that_is_given_wherever_the_camera_is():
    planner = Planner(FarthestPolicy(), elevation=0.9, entropy_tolerance=0)
    goals = [planner.first_goal(orbit_camera(1.0, 0.2))]
    goals.append(planner.add_view(LATENT, orbit_camera(1.0, 0.4), 9).goal)
    assert {camera.elevation for goal in goals for camera in (goal.camera, *goal.candidates)} == {
        0.9}


def test_a_camera_straight_above_the_object_gets_goals_too():
    pose = np.diag([1.0, -1, -1, 1])
    pose[2, 3] = 2
    goal = Planner(FarthestPolicy()).add_view(LATENT, Camera(pose), 9).goal
    assert math.radians(88) < goal.camera.elevation < math.pi / 2


class Looking(FarthestPolicy):
    """A policy that looks at the volume."""

    wants_volume = True


def test_a_policy_that_looks_at_the_volume_refuses_a_view_without_one():
    planner, volume = Planner(Looking()), VoxelGrid(np.zeros((32,) * 3, np.float32))
    with pytest.raises(ViewError, match='no probabilities: expected them beside the latent'):
        planner.add_view(LATENT, orbit_camera(1.0), 9)
    assert planner.add_view(LATENT, orbit_camera(1.0), 9, volume).goal is not None


def test_a_policy_that_looks_at_the_volume_goes_on_by_a_sweep_until_a_view_has_one():
    before, _ = seen(Planner(FarthestPolicy(), max_views=9), 2)
    after, sweep = (Planner(policy, max_views=9) for policy in (Looking(), UniformPolicy(9)))
    for planner in (after, sweep):
        planner.go_on_from(before)
    assert after.plan().camera.azimuth == sweep.plan().camera.azimuth
    volume = VoxelGrid(np.zeros((32,) * 3, np.float32))
    camera = after.plan().camera
    goals = [planner.add_view(LATENT, camera, 9, volume).goal.camera.azimuth
             for planner in (before, after)]
    assert goals[0] == goals[1]


def ends_after(planner, qualities):
    """Follow every goal; return the number of views taken and the reason for the end."""
    camera = planner.first_goal(orbit_camera(0.0)).camera
    for count, quality in enumerate(qualities, 1):
        decision = planner.add_view(LATENT, camera, 100.0 / count, quality=quality)
        if decision.goal is None:
            return count, decision.reason
        camera = decision.goal.camera
    return len(qualities), ''


def test_it_stops_once_the_target_is_promised():
    rising = [quality_of(promise=promise) for promise in (0.0, 0.5, 0.6, 0.7)]
    for target, count in ((0.5, 2), (0.55, 3), (0.7, 4)):
        planner = Planner(FarthestPolicy(), 24, 0, target_quality=target)
        assert ends_after(planner, rising) == (count, 'target_reached')


@pytest.mark.parametrize(('provenance', 'elevations', 'count'), [
    ({}, (), 3), ({'runtime': 'torch'}, (), 2), ({'runtime': 'torch'}, (0.0, 1.2), 3)])
def test_a_learned_policy_stops_by_what_is_promised_for_its_own_views_of_a_turntable(
        provenance, elevations, count):
    policy = FarthestPolicy()
    policy.provenance = provenance
    rising = [quality_of(promise=any_order, promise_learned=own)
              for any_order, own in ((0.0, 0.0), (0.4, 0.5), (0.5, 0.6))]
    planner = Planner(policy, 24, 0, target_quality=0.5, elevation_range=elevations)
    assert ends_after(planner, rising) == (count, 'target_reached')


def test_it_says_early_that_the_target_is_out_of_reach():
    planner = Planner(FarthestPolicy(), 24, 0, target_quality=0.8)
    falling = [quality_of(attainable=best) for best in (0.95, 0.85, 0.75, 0.7)]
    assert ends_after(planner, falling) == (3, 'target_out_of_reach')


def test_without_a_target_or_a_quality_nothing_is_said_of_one():
    poor = [quality_of(promise=0.9, attainable=0.1)] * 4
    assert ends_after(Planner(FarthestPolicy(), 4, 0), poor) == (4, 'max_views')
    blind = Planner(FarthestPolicy(), 4, 0, target_quality=0.5)
    assert ends_after(blind, [None] * 4) == (4, 'max_views')


def test_a_target_that_is_reached_with_the_last_view_is_reached():
    planner = Planner(FarthestPolicy(), 2, 0, target_quality=0.5)
    assert ends_after(planner, [quality_of(), quality_of(promise=0.5)]) == (2, 'target_reached')


def test_while_views_are_unusual_a_goal_is_told_as_one_of_an_even_sweep():
    planner = Planner(FarthestPolicy(), 4, 0)
    volume = VoxelGrid(np.full((32, 32, 32), 0.5, np.float32))
    for angle, suspect in ((0.0, ''), (1.0, 'pose'), (2.0, '')):
        planner.add_view(LATENT, orbit_camera(angle), 100.0 / (1 + angle), volume,
                         quality_of(suspect=suspect))
        assert planner.sweeps == bool(suspect)
        assert planner.reason().shows.startswith('next of an even sweep') == bool(suspect)


def test_while_views_are_unusual_their_quality_ends_nothing():
    planner = Planner(FarthestPolicy(), 3, 0, target_quality=0.5)
    unusual = [quality_of(promise=0.9, attainable=0.1, suspect='pose')] * 3
    assert ends_after(planner, unusual) == (3, 'max_views')


def test_while_views_are_unusual_an_even_sweep_takes_the_place_of_the_policy():
    def goals(policy, suspect):
        planner = Planner(policy, 5, 0)
        camera, azimuths = planner.first_goal(orbit_camera(0.5)).camera, []
        for _ in range(4):
            camera = planner.add_view(
                LATENT, camera, 1.0, quality=quality_of(suspect=suspect)).goal.camera
            azimuths.append(camera.azimuth)
        return azimuths

    sweep = goals(UniformPolicy(5), '')
    assert goals(FarthestPolicy(), 'mask') == sweep
    assert goals(FarthestPolicy(), '') != sweep


class Knowing:
    """A policy that knows what each view gains, or only orders them."""

    wants_volume = False

    def __init__(self, gains, is_gain):
        self._gains, self._is_gain = iter(gains), is_gain

    def initial_state(self, batch):
        return {}

    def choose(self, seen, state):
        best = next(self._gains)
        scores = np.full((1, seen.candidates.shape[1]), best, np.float32)
        return Choice(scores, is_gain=self._is_gain), state


@pytest.mark.parametrize(('is_gain', 'count', 'reason'), [
    (True, 3, 'gain_too_small'), (False, 4, 'max_views')])
def test_it_stops_where_no_view_gains_enough_if_the_policy_knows(is_gain, count, reason):
    planner = Planner(Knowing([0.1, 0.03, 0.01, 0.1], is_gain), 4, 0, min_gain=0.02)
    assert not planner.lacks_gains
    assert ends_after(planner, [None] * 4) == (count, reason)
    assert planner.lacks_gains != is_gain


@pytest.mark.parametrize('name', ['target_quality', 'min_gain'])
@pytest.mark.parametrize('share', [-0.1, 1.0, math.nan])
def test_a_target_that_no_iou_can_be_is_refused(name, share):
    with pytest.raises(ConfigError, match=f'{name}: out of range'):
        Planner(FarthestPolicy(), **{name: share})


def test_a_negative_seed_is_refused():
    with pytest.raises(ConfigError, match='seed: negative'):
        Planner.load('random', seed=-1)


def test_a_goal_has_a_reason_where_the_policy_looks_at_the_volume():
    cells = np.zeros((32,) * 3, np.float32)
    cells[10:22, 10:22, 10:22] = 0.5
    planner = Planner.load('unseen_entropy')
    camera = orbit_camera(0.0)
    assert planner.reason() is None
    planner.add_view(np.zeros((1, 4, 4), np.float32), camera, 10.0, VoxelGrid(cells))
    assert planner.reason().shows.startswith('shows the side towards azimuth')
    assert planner.reason().gain is None
    blind = Planner.load('farthest')
    blind.add_view(np.zeros((1, 4, 4), np.float32), camera, 10.0)
    assert blind.reason() is None


def some_cells(seed):
    """Return a block somewhere in a grid, uncertain here and there."""
    cells = np.zeros((32,) * 3, np.float32)
    cells[8 + seed:22, 10:22, 10 + seed:22] = 0.3 + 0.1 * seed
    return VoxelGrid(cells)


def goals_of(expect, policy='unseen_entropy'):
    """Return the azimuths that a planner chooses, with some views expected before they come."""
    planner = Planner.load(policy, seed=3, max_views=9, entropy_tolerance=0)
    camera, azimuths = planner.first_goal(orbit_camera(0.5)).camera, []
    for number in range(3):
        grid = some_cells(number)
        expect(planner, camera, grid)
        camera = planner.add_view(LATENT, camera, 10.0, grid).goal.camera
        azimuths.append(camera.azimuth)
    return azimuths


@pytest.mark.parametrize('policy', ['unseen_entropy', 'random', 'farthest'])
def test_a_view_that_was_expected_is_planned_as_any_other(policy):
    never = goals_of(lambda *_: None, policy)
    assert goals_of(lambda planner, camera, grid: planner.expect_view(
        LATENT, camera, grid), policy) == never
    assert goals_of(lambda planner, camera, grid: planner.expect_view(
        LATENT, orbit_camera(4.0), some_cells(3)), policy) == never


@pytest.mark.parametrize('policy', ['unseen_entropy', 'attention', 'uniform', 'farthest'])
@pytest.mark.parametrize('expected', [False, True])
def test_a_planner_that_knows_the_cameras_of_earlier_views_decides_as_one_that_took_them(
        policy, expected):
    cameras = [orbit_camera(azimuth) for azimuth in (0.3, 1.4, 4.0)]
    always, late = (Planner.load(policy, max_views=5, entropy_tolerance=0) for _ in range(2))
    for number, camera in enumerate(cameras):
        decision = always.add_view(LATENT, camera, 10.0, some_cells(number))
    if expected:
        late.expect_view(LATENT, cameras[-1], volume := some_cells(2))
    else:
        volume = some_cells(2)
    found = late.add_view(LATENT, cameras[-1], 10.0, volume, earlier=cameras[:-1])
    np.testing.assert_array_equal(found.goal.camera.pose, decision.goal.camera.pose)
    for number, reason in enumerate(('', 'max_views'), 3):
        one, other = (each.add_view(LATENT, decision.goal.camera, 10.0, some_cells(number))
                      for each in (always, late))
        assert one.reason == other.reason == reason
        np.testing.assert_array_equal(always.plan().camera.pose, late.plan().camera.pose)


def test_views_before_a_planner_s_first_settle_no_entropy():
    planner = Planner(FarthestPolicy(), max_views=9, entropy_tolerance=0.01)
    cameras = [orbit_camera(azimuth) for azimuth in (0.3, 1.4, 4.0)]
    assert not planner.add_view(LATENT, cameras[-1], 10.0, earlier=cameras[:-1]).reason
    assert not planner.add_view(LATENT, orbit_camera(2.0), 10.0).reason
    assert planner.add_view(LATENT, orbit_camera(3.0), 10.0).reason == 'entropy_settled'


@pytest.mark.parametrize('yaw', [0.0, 0.3])
def test_a_policy_that_has_prepared_for_a_camera_has_its_lines_of_sight_and_chooses_the_same(yaw):
    size, camera = 0.2, orbit_camera(1.234, 0.321, 0.4)
    grid = VoxelGrid(some_cells(1).occupancy, size)
    goals = []
    for told in (True, False):
        planner = Planner.load('attention', object_yaw=yaw, distance=0.4, entropy_tolerance=0)
        scoring._look_at_nothing.cache_clear()
        sight._own_samples.cache_clear()
        candidate_looks._means.cache_clear()
        if told:
            planner.expect_camera(camera, size)
        computed = [kept.cache_info().misses for kept in (
            sight._own_samples, candidate_looks._means)]
        assert computed == [told, told]
        goals.append(planner.add_view(LATENT, camera, 10.0, grid).goal)
        assert [kept.cache_info().misses for kept in (
            sight._own_samples, candidate_looks._means)] == [1, 1]
    np.testing.assert_array_equal(goals[0].scores, goals[1].scores)
    np.testing.assert_array_equal(goals[0].camera.pose, goals[1].camera.pose)


def test_a_view_that_was_expected_is_not_chosen_after_twice():
    class Counting(Looking):
        chosen = 0

        def choose(self, seen, state):
            self.chosen += 1
            return super().choose(seen, state)

    policy, camera, grid = Counting(), orbit_camera(0.5), some_cells(1)
    planner = Planner(policy, 9, 0)
    planner.expect_view(LATENT, camera)  # without its volume: `add_view` tells
    assert policy.chosen == 0
    planner.expect_view(LATENT, camera, grid)
    planner.add_view(LATENT, camera, 10.0, grid)
    assert policy.chosen == 1
    planner.add_view(LATENT, camera, 10.0, grid)
    assert policy.chosen == 2


class Gainful:
    """A policy that looks at the volume and expects a gain of each of its candidates."""

    wants_volume = True

    def __init__(self, gains):
        self._gains = np.array([gains], np.float32)

    def initial_state(self, batch):
        return {}

    def choose(self, seen, state):
        return Choice(self._gains, is_gain=True), state


def ring(gain_at):
    """Return a gain for each of the 24 azimuths: those named, and 0.01 elsewhere."""
    return [gain_at.get(round(math.degrees(azimuth)), 0.01) for azimuth in AZIMUTHS]


def after_one_view(gains, **settings):
    """Return a planner that took one view at azimuth 0, and what it decided."""
    planner = Planner(Gainful(gains), 5, 0, **settings)
    return planner, planner.add_view(np.zeros((1, 4, 4), np.float32), orbit_camera(0.0), 10.0,
                                     VoxelGrid(np.full((32,) * 3, 0.5, np.float32)))


def test_the_reason_tells_the_gain_of_the_goal_and_not_of_a_better_one_out_of_reach():
    planner, decision = after_one_view(
        ring({180: 0.3, 90: 0.2}), limits=MotionLimits(azimuth_range=(-2.0, 2.0)))
    assert math.degrees(decision.goal.camera.azimuth) == pytest.approx(90)
    assert planner.reason().gain == pytest.approx(0.2)
    planner.give_up(decision.goal.camera)
    assert planner.reason().gain == pytest.approx(0.01)


@pytest.mark.parametrize(('best_in_reach', 'reason'), [(0.06, ''), (0.04, 'gain_too_small')])
def test_a_gain_out_of_reach_keeps_no_episode_going(best_in_reach, reason):
    _, decision = after_one_view(
        ring({180: 0.3, 90: best_in_reach}), limits=MotionLimits(azimuth_range=(-2.0, 2.0)),
        min_gain=0.05)
    assert decision.reason == reason


def test_a_goal_given_up_ends_the_episode_where_no_other_gains_enough():
    planner, decision = after_one_view(ring({180: 0.3, 90: 0.06}), min_gain=0.05)
    decision = planner.give_up(decision.goal.camera)
    assert math.degrees(decision.goal.camera.azimuth) == pytest.approx(90)
    assert planner.give_up(decision.goal.camera).reason == 'gain_too_small'


def test_a_gain_that_was_already_taken_keeps_no_episode_going():
    _, decision = after_one_view(ring({0: 0.3}), min_gain=0.05)
    assert decision.reason == 'gain_too_small'


@pytest.mark.parametrize(('cost', 'reason'), [
    (0.0, ''), (0.009, ''), (0.011, 'gain_too_small')])
def test_what_the_way_to_a_view_costs_counts_against_its_gain(cost, reason):
    motion = TimedMotion(azimuth_speed=math.pi / 10, motion_cost=cost)  # half a turn: ten seconds
    _, decision = after_one_view(ring({180: 0.15}), min_gain=0.05, motion=motion)
    assert decision.reason == reason


def test_a_motion_weight_has_no_unit_and_takes_nothing_off_a_gain():
    _, decision = after_one_view(ring({180: 0.15}), min_gain=0.1, motion_weight=50.0)
    assert abs(azimuth_difference(decision.goal.camera.azimuth, 0)) < 0.3
    assert (decision.goal.gain, decision.goal.worth) == pytest.approx((0.01, 0.15))


def test_only_the_last_volume_of_an_episode_is_kept():
    planner = Planner.load('unseen_entropy', max_views=9, entropy_tolerance=0)
    camera, kept = planner.first_goal(orbit_camera(0.5)).camera, []
    for number in range(4):
        grid = some_cells(number)
        kept.append(weakref.ref(grid))
        camera = planner.add_view(LATENT, camera, 10.0, grid).goal.camera
        del grid
    gc.collect()
    assert [each() is not None for each in kept] == [False, False, False, True]


def test_a_policy_that_looks_at_volumes_goes_on_from_the_last():
    def policy():
        return Planner.load('unseen_entropy', seed=3, max_views=9, entropy_tolerance=0)

    before, camera = policy(), orbit_camera(0.5)
    for number in range(3):
        camera = before.add_view(LATENT, camera, 10.0, some_cells(number)).goal.camera
    after = policy()
    after.go_on_from(before)
    assert after.plan().camera.azimuth == before.plan().camera.azimuth


class Mistaken(FarthestPolicy):
    """A policy whose choice is spoilt by a function."""

    def __init__(self, spoil):
        self._spoil = spoil

    def choose(self, seen, state):
        choice, state = super().choose(seen, state)
        return self._spoil(choice, state)


def with_one(scores, value):
    return np.where(np.arange(scores.shape[1]) == 5, value, scores)


@pytest.mark.parametrize(('spoil', 'said'), [
    (lambda choice, state: (Choice(choice.scores[0]), state), r'scores: expected \(1, 24\)'),
    (lambda choice, state: (Choice(choice.scores[:, :-1]), state), r'got \(1, 23\)'),
    (lambda choice, state: (Choice(with_one(choice.scores, np.nan)), state), 'with 1 NaN'),
    (lambda choice, state: (Choice(with_one(choice.scores, -np.inf)), state), 'with 1 NaN or inf'),
    (lambda choice, state: (choice.scores, state), 'expected a Choice of arrays'),
    (lambda choice, state: choice, 'expected a Choice of arrays, and a state'),
    (lambda choice, state: (Choice(choice.scores, 1.0), state), r'azimuth: expected \(1,\)'),
    (lambda choice, state: (Choice(choice.scores, np.array([np.inf])), state), 'azimuth')])
def test_what_a_policy_returns_wrongly_is_refused_and_nothing_has_changed(spoil, said):
    planner = Planner(Mistaken(spoil), max_views=1)
    goal = planner.first_goal(orbit_camera(0.0))
    with pytest.raises(ViewError, match=said):
        planner.add_view(LATENT, goal.camera, 1.0)
    assert planner.plan() is goal


def test_a_goal_that_was_given_up_leaves_out_no_other_azimuth_that_is_listed_later():
    before = Planner(FarthestPolicy(), limits=MotionLimits(reachable_azimuths=(0.0, 2.0)))
    before.give_up(before.first_goal(orbit_camera(0.0)).camera)
    after = Planner(FarthestPolicy(), limits=MotionLimits(reachable_azimuths=(0.0, 0.5)))
    after.go_on_from(before)
    assert after.plan().camera.azimuth == pytest.approx(0.5)
    after = Planner(FarthestPolicy(), limits=MotionLimits(reachable_azimuths=(0.5,)))
    after.go_on_from(before)
    assert after.plan().camera.azimuth == pytest.approx(0.5)


class InPlace(FarthestPolicy):
    """Works in the arrays that it is given."""

    wants_volume = True

    def choose(self, seen, state):
        seen.latent[:] = seen.occupancy[:] = 0
        return super().choose(seen, state)


def test_a_policy_that_works_in_place_leaves_the_reconstruction_as_it_is():
    grid, latent = VoxelGrid(np.full((8, 8, 8), 0.5, np.float32)), LATENT.copy()
    Planner(InPlace()).add_view(latent, orbit_camera(0.0), 1.0, grid)
    assert (grid.occupancy == 0.5).all()
    np.testing.assert_array_equal(latent, LATENT)
