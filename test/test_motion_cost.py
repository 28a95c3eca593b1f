"""The time that a way takes, and what it costs beside a policy's scores."""

import math

from active_recon.acquisition.motion import MotionLimits
from active_recon.acquisition.motion_cost import MotionCost, TimedMotion
from active_recon.errors import ConfigError
from active_recon.geometry.cameras import azimuth_difference, orbit_camera
from active_recon.geometry.view_distance import view_distance
from active_recon.planner import Planner
from active_recon.policies.base import Choice
from active_recon.policies.geometric import FarthestPolicy, HeuristicPolicy
import numpy as np
import pytest

FREE = MotionLimits()
LATENT = np.zeros((8, 4, 4), np.float32)
HERE = orbit_camera(0.5, 0.4)
GOALS = [orbit_camera(azimuth, elevation) for azimuth in (0.5, 1.0, 3.0, 5.9)
         for elevation in (-0.2, 0.4, 1.3)]


def test_the_time_is_that_of_the_slower_axis_and_of_the_view():
    motion = TimedMotion(azimuth_speed=0.5, elevation_speed=0.2, view_time=3.0)
    expected = [3.0 + max(abs(float(azimuth_difference(goal.azimuth, 0.5))) / 0.5,
                          abs(goal.elevation - 0.4) / 0.2) for goal in GOALS]
    np.testing.assert_allclose(motion.seconds(HERE, GOALS, FREE), expected, atol=1e-9)


@pytest.mark.parametrize('factor', [0.1, 3.0])
def test_speeds_and_seconds_are_inverse(factor):
    one, other = (TimedMotion(0.5 * by, 0.2 * by).seconds(HERE, GOALS, FREE)
                  for by in (1.0, factor))
    np.testing.assert_allclose(other * factor, one)


def test_without_limits_the_way_is_the_short_one():
    rng = np.random.default_rng(0)
    for start in rng.uniform(-7, 7, 20):
        ends = rng.uniform(-7, 7, 50)
        np.testing.assert_allclose(FREE.way(start, ends),
                                   np.abs(azimuth_difference(ends, start)), atol=1e-9)


@pytest.mark.parametrize(('limits', 'start', 'end', 'way'), [
    (MotionLimits((-2.0, 2.0)), -1.9, 1.9, 3.8),
    (MotionLimits((-2.0, 2.0)), 2.0, -2.0, 4.0),
    (MotionLimits((-2.0, 2.0)), 0.5, 1.0, 0.5),
    (MotionLimits(forbidden_sectors=[1.0, 1.2]), 0.9, 1.3, math.tau - 0.4),
    (MotionLimits(forbidden_sectors=[1.0, 1.2]), 1.3, 0.9, math.tau - 0.4),
    (MotionLimits(forbidden_sectors=[6.2, 0.1]), 6.0, 0.5, 5.5),
    (MotionLimits(forbidden_sectors=[1.0, 1.2, 4.0, 4.2]), 0.9, 1.3, 0.4),
    (MotionLimits((-2.0, 2.0), [0.0, 0.1]), -0.5, 0.5, 1.0),
    (MotionLimits(reachable_azimuths=[0.0, 1.0, 2.0]), 0.0, 2.0, 2.0),
    (MotionLimits(forbidden_sectors=[1.0, 1.2]), 1.1, 1.5, 0.4),
])
def test_the_way_avoids_what_is_forbidden_where_it_can(limits, start, end, way):
    assert limits.way(start, [end])[0] == pytest.approx(way, abs=1e-9)


@pytest.mark.parametrize('turns', [-3, -2, -1, 0])
def test_the_way_within_a_range_is_the_same_in_whatever_turn_its_ends_are_told(turns):
    rng = np.random.default_rng(2)
    ends = rng.uniform(1.3, 7.3, 50)
    for start in rng.uniform(1.3, 7.3, 20):
        np.testing.assert_allclose(
            MotionLimits((1.2, 7.4 + turns * math.tau)).way(start, ends),
            np.abs(ends - start), atol=1e-9)


def test_the_way_is_the_same_there_and_back_and_turns_with_the_limits():
    rng = np.random.default_rng(1)
    for _ in range(100):
        low, by = rng.uniform(-4, 4, 2)
        sector = rng.uniform(0, 6)
        straight, turned = (MotionLimits((low + turn, low + 5 + turn),
                                         [sector + turn, sector + 0.4 + turn])
                            for turn in (0.0, by))
        start, end = rng.uniform(0, math.tau, 2)
        way = straight.way(start, [end])[0]
        assert straight.way(end, [start])[0] == pytest.approx(way)
        assert turned.way(start + by, [end + by])[0] == pytest.approx(way)
        short = abs(float(azimuth_difference(start, end)))
        assert min(abs(way - short), abs(way - (math.tau - short))) < 1e-9


def test_gains_keep_their_unit_and_other_scores_are_scaled():
    scores = np.random.default_rng(0).normal(size=len(GOALS)).astype(np.float32)
    cost = MotionCost(timed=TimedMotion(motion_cost=0.02))
    seconds = cost.timed.seconds(HERE, GOALS, FREE)
    np.testing.assert_allclose(cost.utility(scores, True, HERE, GOALS, FREE),
                               scores - 0.02 * seconds, atol=1e-6)
    relative = cost.utility(scores, False, HERE, GOALS, FREE)
    np.testing.assert_allclose(relative, (scores - scores.min()) / np.ptp(scores) - 0.02 * seconds,
                               atol=1e-6)
    np.testing.assert_allclose(cost.utility(40 * scores - 3, False, HERE, GOALS, FREE), relative,
                               atol=1e-5)


@pytest.mark.parametrize('is_gain', [True, False])
def test_motion_that_costs_nothing_leaves_the_scores_their_bits(is_gain):
    scores = np.random.default_rng(0).normal(size=len(GOALS)).astype(np.float32)
    for timed in (TimedMotion(), TimedMotion(0.1, 0.3, 5.0)):
        kept = MotionCost(timed=timed).utility(scores, is_gain, HERE, GOALS, FREE)
        np.testing.assert_array_equal(kept, scores)


class Gains(HeuristicPolicy):
    """Expects most gain far from the last view: 0.1 of IoU at the other side."""

    def choose(self, seen, state):
        away = 1 - (seen.candidates[..., :3, 3] * seen.taken[:, -1:, :3, 3]).sum(-1) / 4.41
        return Choice((0.05 * away).astype(np.float32), is_gain=True), state


@pytest.mark.parametrize('policy', [FarthestPolicy, Gains])
def test_the_more_a_second_costs_the_sooner_the_next_view_is_there(policy):
    times = []
    for cost in (0.0, 0.003, 0.01, 0.03, 0.1, 1.0):
        motion = TimedMotion(1.0, 0.5, 1.0, cost)
        planner = Planner(policy(), 9, 0.0, elevation_range=(0.0, 1.2), motion=motion)
        goal = planner.add_view(LATENT, HERE, 10.0).goal
        times.append(motion.seconds(HERE, [goal.camera], FREE)[0])
    assert (np.diff(times) <= 1e-9).all()
    assert times[0] > times[-1]


def test_a_slow_lift_keeps_goals_at_their_height_and_a_slow_table_at_their_azimuth():
    goals = [Planner(FarthestPolicy(), 9, 0.0, elevation_range=(0.0, 1.2),
                     motion=TimedMotion(*speeds, motion_cost=0.3)).add_view(
                         LATENT, orbit_camera(0.0, 0.3), 10.0).goal.camera
             for speeds in ((1.0, 0.02), (0.02, 1.0))]
    climbs = [abs(goal.elevation - 0.3) for goal in goals]
    turns = [abs(float(azimuth_difference(goal.azimuth, 0.0))) for goal in goals]
    assert climbs[0] < 0.2 < climbs[1]
    assert turns[1] < 0.2 < turns[0]


def test_the_first_view_costs_nothing():
    planner = Planner(FarthestPolicy(), elevation_range=(0.0, 1.2),
                      motion=TimedMotion(motion_cost=10.0))
    planner.first_goal(HERE)
    goal = planner.give_up(HERE, orbit_camera(3.0, 1.0)).goal
    assert view_distance(goal.camera, HERE) < 0.5


@pytest.mark.parametrize(('settings', 'message'), [
    ({'azimuth_speed': 0.0}, 'azimuth_speed: out of range: expected rad/s above 0, got 0'),
    ({'elevation_speed': math.nan}, 'elevation_speed: .* got nan'),
    ({'view_time': -1.0}, 'view_time: out of range: expected 0 or more, got -1'),
    ({'motion_cost': math.inf}, 'motion_cost: .* got inf')])
def test_values_out_of_range_are_refused(settings, message):
    with pytest.raises(ConfigError, match=message):
        TimedMotion(**settings)
