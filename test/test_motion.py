"""Where the camera can go, and which goals follow from it."""

from dataclasses import replace
import math

from active_recon.acquisition.goals import best_goal, Wanted
from active_recon.acquisition.motion import MotionLimits
from active_recon.acquisition.motion_cost import MotionCost, utility
from active_recon.errors import ConfigError, ViewError
from active_recon.geometry.cameras import azimuth_difference, AZIMUTHS, nearest_view, orbit_camera
from active_recon.planner import Planner
from active_recon.policies import Observation
from active_recon.policies.attention import AttentionPolicy
from active_recon.policies.geometric import FarthestPolicy, RandomPolicy, UniformPolicy
from active_recon.runtimes.torch import TorchPolicyRuntime
import numpy as np
import pytest

LATENT = np.random.default_rng(0).normal(size=(8, 4, 4)).astype(np.float32)
KINDS = ('attention', 'random', 'uniform', 'farthest')


@pytest.fixture
def policy(attention):
    """Return what makes a policy of a name."""
    kinds = {'attention': lambda: AttentionPolicy(TorchPolicyRuntime(attention)),
             'random': lambda: RandomPolicy(np.random.default_rng(7)),
             'uniform': lambda: UniformPolicy(7), 'farthest': FarthestPolicy}
    return lambda kind: kinds[kind]()


@pytest.fixture
def planner(policy):
    """Return what makes a planner of azimuths that never settles, of a policy's name."""
    return lambda kind, **settings: Turning(Planner(policy(kind), 100, 0.0, **settings))


class Turning:
    """A planner whose cameras are those of a turntable, told by their azimuths, radians."""

    def __init__(self, planner):
        self._planner = planner
        self.reset, self.stop = planner.reset, planner.stop

    def first_goal(self, azimuth):
        return AzimuthGoal(self._planner.first_goal(orbit_camera(azimuth)))

    def plan(self):
        return AzimuthGoal(self._planner.plan())

    def add_view(self, latent, azimuth, entropy):
        return self._decided(self._planner.add_view(latent, orbit_camera(azimuth), entropy))

    def give_up(self, azimuth, camera=None):
        return self._decided(self._planner.give_up(
            orbit_camera(azimuth), None if camera is None else orbit_camera(camera)))

    def _decided(self, decision):
        return replace(decision, goal=decision.goal and AzimuthGoal(decision.goal))


class AzimuthGoal:
    """A goal by its azimuth, and those of its candidates (N,)."""

    def __init__(self, goal):
        cameras = [goal.camera, *goal.candidates]
        assert {(camera.elevation, camera.distance) for camera in cameras} == {
            (orbit_camera(0.0).elevation, orbit_camera(0.0).distance)}
        self.azimuth = goal.camera.azimuth
        self.candidates = np.array([camera.azimuth for camera in goal.candidates])
        self.scores = goal.scores


def followed(planner, start, views, off=0.0):
    """Follow goals until none is left, each reached so far off, radians; return their azimuths."""
    goals = [planner.first_goal(start).azimuth]
    while len(goals) < views:
        decision = planner.add_view(LATENT, goals[-1] + off, 10.0)
        if decision.goal is None:
            assert decision.reason == 'no_reachable_azimuth'
            break
        goals.append(decision.goal.azimuth)
    return goals


def from_to(low, high, azimuths):
    """Whether azimuths lie counter-clockwise between two, whose width is below a turn."""
    return (np.asarray(azimuths) - low) % math.tau <= (high - low) % math.tau


def apart(a, b):
    return abs(float(azimuth_difference(a, b)))


def random_limits(rng):
    """Return limits that leave something, drawn at random."""
    while True:
        low = rng.uniform(-7, 7)
        drawn = {'forbidden_sectors': [end for begin in rng.uniform(-7, 7, rng.integers(4))
                                       for end in (begin, begin + rng.uniform(0.01, 2.5))]}
        if rng.random() < 0.7:
            drawn['azimuth_range'] = (low, low + rng.uniform(0.05, 6.2))
        if rng.random() < 0.3:
            drawn['reachable_azimuths'] = rng.uniform(-7, 7, 9).tolist()
        try:
            return MotionLimits(**drawn)
        except ConfigError:
            continue


@pytest.mark.parametrize('kind', KINDS)
def test_no_goal_ever_lies_where_the_camera_cannot_go(planner, kind):
    rng = np.random.default_rng(3)
    for _ in range(25):
        limits = random_limits(rng)
        weight = rng.choice([0.0, 0.3, 5.0])
        made = planner(kind, object_yaw=rng.uniform(-3, 3), limits=limits, motion_weight=weight)
        goals = followed(made, rng.uniform(0, 6), 8, off=rng.uniform(-0.1, 0.1))
        low, high = limits.azimuth_range
        if high - low < math.tau:
            assert from_to(low - 2e-4, high + 2e-4, goals).all()
        for sector in zip(limits.forbidden_sectors[::2], limits.forbidden_sectors[1::2],
                          strict=True):
            assert not from_to(*sector, goals).any()
        if limits.reachable_azimuths:
            assert all(min(apart(goal, one) for one in limits.reachable_azimuths) < 2e-4
                       for goal in goals)


def test_a_goal_is_where_the_camera_can_go_however_low_the_scores_are_there():
    limits = MotionLimits(forbidden_sectors=(6.0, 1.0))
    candidates = [orbit_camera(azimuth) for azimuth in AZIMUTHS]
    for low in (-np.inf, np.finfo(np.float32).min):
        goal = best_goal(Wanted(None, np.full(len(candidates), low, np.float32)), candidates,
                         candidates[6], [], [candidates[4]], limits, MotionCost())
        assert limits.allows(goal.camera.azimuth)
        assert goal.camera is not candidates[4]


@pytest.mark.parametrize('by', [0.4, 2.5, -1.3, 6.0])
@pytest.mark.parametrize('kind', KINDS)
def test_turned_limits_turn_the_goals_with_them(planner, kind, by):
    rng = np.random.default_rng(5)
    for _ in range(10):
        limits = random_limits(rng)
        straight, turned = (planner(kind, object_yaw=turn, motion_weight=0.2, limits=MotionLimits(
            *([azimuth + turn for azimuth in azimuths] for azimuths in (
                limits.azimuth_range, limits.forbidden_sectors, limits.reachable_azimuths))))
            for turn in (0.0, by))
        for azimuth in (0.31, 2.12, 4.53):  # between candidates, so that none is as near
            goal = straight.add_view(LATENT, azimuth, 10.0).goal
            other = turned.add_view(LATENT, azimuth + by, 10.0).goal
            if kind != 'random':  # its draws follow the order of the candidates
                assert apart(other.azimuth, goal.azimuth + by) < 1e-5
            assert len(other.candidates) == len(goal.candidates)
            assert all(min(apart(one, each + by) for each in goal.candidates) < 1e-5
                       for one in other.candidates)


@pytest.mark.parametrize('kind', KINDS)
def test_without_limits_and_weight_the_goals_are_the_policys_own_bits(planner, policy, kind):
    alone = policy(kind)
    limited = planner(kind, limits=MotionLimits((0.0, math.tau), [], []), motion_weight=0.0)
    ring = np.stack([orbit_camera(azimuth).pose for azimuth in AZIMUTHS])[None]
    taken, state = [], alone.initial_state(1)
    for azimuth in (0.7, 2.9, 4.4):
        taken.append(azimuth)
        poses = np.stack([orbit_camera(each).pose for each in taken])[None]
        choice, state = alone.choose(Observation(LATENT[None], poses, ring), state)
        goal = limited.add_view(LATENT, azimuth, 10.0).goal
        chosen = AZIMUTHS[choice.scores[0].argmax()]
        if choice.azimuth is not None and not np.isnan(choice.azimuth[0]):
            chosen = choice.azimuth[0]
        assert nearest_view(chosen) not in map(nearest_view, taken)
        assert goal.azimuth == chosen
        np.testing.assert_array_equal(goal.scores, choice.scores[0])
        np.testing.assert_array_equal(goal.candidates, AZIMUTHS)


@pytest.mark.parametrize('kind', KINDS)
def test_with_a_large_weight_nothing_new_that_can_be_reached_is_nearer_than_the_goal(
        planner, kind):
    made = planner(kind, motion_weight=1e3, limits=MotionLimits((-2.0, 2.0), [0.5, 1.0]))
    at, taken = 0.02, []
    for _ in range(8):
        taken.append(nearest_view(at))
        goal = made.add_view(LATENT, at, 10.0).goal
        new = [azimuth for index, azimuth in enumerate(AZIMUTHS)
               if index not in taken and MotionLimits((-2.0, 2.0), [0.5, 1.0]).allows(azimuth)]
        assert nearest_view(goal.azimuth) not in taken
        assert apart(goal.azimuth, at) <= min(apart(one, at) for one in new) + 1e-9
        at = goal.azimuth + 0.01


@pytest.mark.parametrize('kind', KINDS)
def test_the_more_the_way_costs_the_shorter_it_is(planner, kind):
    ways = []
    for weight in (0.0, 0.1, 0.3, 1.0, 3.0, 30.0):
        made = planner(kind, motion_weight=weight)
        for azimuth in (0.2, 1.5):
            goal = made.add_view(LATENT, azimuth, 10.0).goal
        ways.append(apart(goal.azimuth, 1.5))
    assert (np.diff(ways) <= 1e-9).all()
    assert ways[0] > ways[-1]


def test_a_weight_means_the_same_whatever_the_scale_of_the_scores():
    scores = np.array([0.1, 0.7, 0.3], np.float32)
    travel = np.array([0.0, math.pi, math.pi / 2])
    plain = utility(scores, travel, 0.5)
    np.testing.assert_allclose(utility(40 * scores - 3, travel, 0.5), plain, atol=1e-5)
    np.testing.assert_allclose(plain, [0, 1 - 0.5, 1 / 3 - 0.25], atol=1e-6)
    np.testing.assert_allclose(utility(0 * scores, travel, 0.5), [0, -0.5, -0.25])


@pytest.mark.parametrize('kind', KINDS)
def test_every_azimuth_in_reach_is_asked_for_once(planner, kind):
    goals = followed(planner(kind, limits=MotionLimits((0.0, 3.0), [1.2, 1.5])), 0.1, 15)
    count = int(MotionLimits((0.0, 3.0), [1.2, 1.5]).allows(AZIMUTHS).sum())
    assert len(goals) == len({nearest_view(goal) for goal in goals}) == count


@pytest.mark.parametrize('again', [0.1 + math.tau, 0.1 - 2 * math.tau, 0.10001])
def test_an_azimuth_that_is_listed_twice_is_one_candidate_in_whatever_turn_it_is_told(again):
    listed = MotionLimits(reachable_azimuths=[0.1, 2.0, again, 4.0]).candidates(AZIMUTHS)
    np.testing.assert_allclose(listed, [0.1, 2.0, 4.0], atol=2e-5)
    assert len(MotionLimits(reachable_azimuths=[0.0, 1.57, 6.2832]).candidates(AZIMUTHS)) == 2


@pytest.mark.parametrize('kind', KINDS)
def test_listed_azimuths_are_the_only_goals_each_once(planner, kind):
    listed = [0.05, 2.0, -1.0, 3.3, 2.2]
    goals = followed(planner(kind, limits=MotionLimits(reachable_azimuths=listed)), 0.0, 10)
    assert sorted(goals) == pytest.approx(sorted(one % math.tau for one in listed))


def test_a_goal_that_was_reached_roughly_counts_as_what_the_pose_says(planner):
    made = planner('farthest')
    made.add_view(LATENT, 0.0, 10.0)
    asked = made.plan().azimuth
    goal = made.add_view(LATENT, asked - 0.4, 10.0).goal
    exact = planner('farthest')
    for azimuth in (0.0, asked - 0.4):
        expected = exact.add_view(LATENT, azimuth, 10.0).goal
    assert goal.azimuth == expected.azimuth


@pytest.mark.parametrize('kind', KINDS)
def test_no_goal_is_asked_for_again_however_roughly_it_was_reached(planner, kind):
    rng = np.random.default_rng(3)
    for _ in range(25):
        limits, off = random_limits(rng), rng.uniform(-0.12, 0.12)
        goals = followed(planner(kind, limits=limits), rng.uniform(0, 6), 7, off)
        assert all(apart(goal, other) > 1e-5
                   for at, goal in enumerate(goals) for other in goals[:at])


def test_a_view_away_from_the_goal_leaves_it_to_be_asked_for(planner):
    made = planner('farthest', limits=MotionLimits(reachable_azimuths=[1.0, 1.2, 4.0]))
    made.first_goal(1.0)
    assert made.add_view(LATENT, 1.19, 10.0).goal.azimuth == 4.0
    assert made.add_view(LATENT, 4.0, 9.0).goal.azimuth == 1.0


@pytest.mark.parametrize(('azimuth', 'expected'), [(1.0, 1.0), (-0.2, 0.0), (3.0, 2.0943951),
                                                   (2.1, 2.1), (4.0, 2.0943951)])
def test_the_first_goal_is_where_it_is_asked_for_or_the_nearest_that_can_be_reached(
        planner, azimuth, expected):
    made = planner('farthest', limits=MotionLimits((0.0, 2.2)))
    assert made.first_goal(azimuth).azimuth == pytest.approx(expected)


def test_a_stretch_too_narrow_for_a_candidate_is_reached_in_its_middle(planner):
    limits = MotionLimits((1.0, 2.0), [1.02, 1.3, 1.32, 2.0])
    assert limits.allows(AZIMUTHS).sum() == 1
    goals = followed(planner('farthest', limits=limits), 0.0, 2)
    assert goals == pytest.approx([1.01, AZIMUTHS[5]])


@pytest.mark.parametrize('limits', [
    MotionLimits((5.5, 1.0)), MotionLimits((-0.78318, 1.0)), MotionLimits((11.78319, 13.56637))])
def test_a_range_may_lead_through_zero_and_be_told_in_any_turn(limits):
    assert limits.allows([5.6, 6.28, 0.0, 0.99, -0.5]).all()
    assert not limits.allows([1.1, 3.0, 5.4]).any()


@pytest.mark.parametrize('whole', [(0.0, math.tau), (-math.pi, math.pi), (-9.0, 9.0),
                                   (-3.14159, 3.14159)])
def test_a_whole_turn_limits_nothing(whole):
    assert MotionLimits(whole).allows(AZIMUTHS).all()
    np.testing.assert_array_equal(MotionLimits(whole).candidates(AZIMUTHS), AZIMUTHS)


def test_the_ends_of_a_range_can_be_reached_and_those_of_a_sector_cannot():
    limits = MotionLimits((0.5, 3.0), [1.0, 2.0])
    np.testing.assert_array_equal(
        limits.allows([0.5, 3.0, 1.0, 2.0, 1.5, 0.999, 2.001]),
        [True, True, False, False, False, True, True])


@pytest.mark.parametrize(('limits', 'message'), [
    ({'azimuth_range': (1.0, 1.0)}, 'azimuth_range: not a range: expected low and high'),
    ({'azimuth_range': (1.0,)}, 'azimuth_range: not a range: expected low and high'),
    ({'azimuth_range': (1.0, math.nan)}, 'azimuth_range: .*nan'),
    ({'forbidden_sectors': [1.0, 2.0, 3.0]}, 'forbidden_sectors: not sectors: expected pairs'),
    ({'forbidden_sectors': [1.0, math.inf]}, 'forbidden_sectors: .*inf'),
    ({'reachable_azimuths': [0.1, math.nan]}, 'reachable_azimuths: not finite: expected azimuths'),
    ({'forbidden_sectors': [0.0, 7.0]}, 'together they leave none'),
    ({'azimuth_range': (1.0, 2.0), 'forbidden_sectors': [0.9, 2.1]}, 'together they leave none'),
    ({'azimuth_range': (1.0, 2.0), 'reachable_azimuths': [2.5]}, 'together they leave none'),
])
def test_limits_that_are_none_or_leave_nothing_are_refused(limits, message):
    with pytest.raises(ConfigError, match=message):
        MotionLimits(**limits)


@pytest.mark.parametrize('kind', KINDS)
def test_a_goal_that_is_given_up_is_left_out_for_the_episode(planner, kind):
    made = planner(kind, limits=MotionLimits((0.0, 2.0)))
    count = int(MotionLimits((0.0, 2.0)).allows(AZIMUTHS).sum())
    made.add_view(LATENT, 0.01, 10.0)
    failed = made.plan()
    following = made.give_up(failed.azimuth, 0.5).goal
    assert nearest_view(following.azimuth) != nearest_view(failed.azimuth)
    goals = [following.azimuth]
    while (goal := made.add_view(LATENT, goals[-1], 10.0).goal) is not None:
        goals.append(goal.azimuth)
    assert len(goals) == count - 2
    assert {nearest_view(goal) for goal in goals} == (
        {nearest_view(azimuth) for azimuth in AZIMUTHS[1:count]} - {nearest_view(failed.azimuth)})
    made.reset()
    assert made.first_goal(failed.azimuth).azimuth == failed.azimuth


@pytest.mark.parametrize('kind', KINDS)
def test_when_every_azimuth_was_given_up_there_is_none_and_it_says_so(planner, kind):
    made = planner(kind, limits=MotionLimits(reachable_azimuths=[0.0, 1.0, 2.5]))
    first = made.first_goal(0.9)
    assert first.azimuth == 1.0
    second = made.give_up(first.azimuth).goal
    assert second.azimuth == 0.0
    assert made.give_up(second.azimuth, 1.5).goal.azimuth == 2.5
    decision = made.give_up(2.5)
    assert (decision.goal, decision.reason) == (None, 'no_reachable_azimuth')
    with pytest.raises(ViewError, match='every one that can be reached was taken or given up'):
        made.plan()
    assert made.add_view(LATENT, 1.0, 10.0).reason == 'no_reachable_azimuth'


def test_the_way_to_the_next_best_is_counted_from_where_the_camera_is(planner):
    goals = []
    for camera in (AZIMUTHS[3], AZIMUTHS[18]):
        made = planner('farthest', motion_weight=100.0)
        made.add_view(LATENT, AZIMUTHS[8], 10.0)
        goals.append(nearest_view(made.give_up(made.plan().azimuth, camera).goal.azimuth))
    assert goals == [3, 18]


def test_what_was_never_asked_for_cannot_be_given_up(planner):
    with pytest.raises(ViewError, match='no goal to give up: expected one before it'):
        planner('farthest').give_up(1.0)


def test_a_stopped_episode_stays_stopped_until_the_next(planner):
    made = planner('farthest')
    made.first_goal(0.0)
    decision = made.stop()
    assert (decision.goal, decision.reason) == (None, 'stopped')
    assert made.add_view(LATENT, 0.0, 10.0).reason == 'stopped'
    assert made.plan().azimuth == pytest.approx(math.pi)
    made.reset()
    assert made.add_view(LATENT, 0.0, 10.0).goal is not None
