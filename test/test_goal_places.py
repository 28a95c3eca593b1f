"""Where goals can stand: domes and listed views, their limits, and the planner's goals there."""

import math
from pathlib import Path

from active_recon.acquisition.goal_places import Dome, goal_places
from active_recon.acquisition.motion import MotionLimits
from active_recon.errors import ConfigError
from active_recon.geometry.cameras import AZIMUTHS, Camera, orbit_camera
from active_recon.geometry.view_distance import (
    direction_distance,
    nearest_camera,
    nearest_cameras,
    view_distance,
    view_distances,
)
from active_recon.parameters.view_planner import ViewPlannerParameters
from active_recon.planner import Planner
from active_recon.policies.attention import AttentionPolicy
from active_recon.policies.geometric import FarthestPolicy, RandomPolicy, UniformPolicy
from active_recon.runtimes.torch import TorchPolicyRuntime
import numpy as np
import pytest

LATENT = np.zeros((8, 4, 4), np.float32)
RANGE = (0.1, 1.2)
LISTED = (0.0, 0.2, 0.0, 1.5, 1.1, 0.7, 3.0, -0.4, 0.0, 5.0, 0.6, 2.0)
"""Azimuth, elevation and distance of four views."""
POLICIES = {'random': lambda: RandomPolicy(np.random.default_rng(7)),
            'uniform': lambda: UniformPolicy(6), 'farthest': FarthestPolicy}


def directions(cameras):
    return np.array([camera.direction for camera in cameras])


def candidates(limits=None, **where):
    return goal_places(limits or MotionLimits(), **where).candidates(orbit_camera(0.0))


def followed(planner, camera, count):
    """Follow every goal exactly until none is left; return the goals in their order."""
    goals = [planner.first_goal(camera)]
    while len(goals) < count and (
            goal := planner.add_view(LATENT, goals[-1].camera, 10.0).goal) is not None:
        goals.append(goal)
    return goals


@pytest.mark.parametrize('ends', [(0.0, 1.2), (-1.5, 1.5), (0.3, 0.5), (-0.3, 0.9)])
def test_a_dome_reaches_from_end_to_end_in_steps_of_about_twenty_degrees(ends):
    elevations = np.unique([camera.elevation for camera in candidates(elevation_range=ends)])
    assert (elevations[0], elevations[-1]) == ends
    steps = np.degrees(np.diff(elevations))
    np.testing.assert_allclose(steps, steps[0])
    assert len(steps) == 1 or 15 < steps[0] < 30


def test_the_candidates_of_a_dome_are_about_as_far_from_each_other_everywhere():
    seen = directions(candidates(elevation_range=(-1.5, 1.5)))
    apart = direction_distance(seen[:, None], seen)
    np.fill_diagonal(apart, np.inf)
    assert math.radians(8) < apart.min()
    anywhere = np.random.default_rng(0).normal(size=(2000, 3))
    anywhere /= np.linalg.norm(anywhere, axis=1, keepdims=True)
    assert direction_distance(anywhere[:, None], seen).min(axis=1).max() < math.radians(15)


def test_a_dome_has_as_many_candidates_as_the_documentation_tells():
    page = (Path(__file__).parents[1] / 'doc/operation.md').read_text()
    assert f'from 0 to 1.2 rad there are {len(candidates(elevation_range=(0.0, 1.2)))}.' in page


def test_the_widest_ring_of_a_dome_has_the_azimuths_of_a_turntable():
    level = [camera.azimuth for camera in candidates(elevation_range=(0.0, 1.2))
             if camera.elevation == 0]
    np.testing.assert_array_equal(level, AZIMUTHS)


@pytest.mark.parametrize('kind', POLICIES)
@pytest.mark.parametrize('where', [{'elevation_range': RANGE}, {'reachable_views': LISTED}])
def test_no_goal_ever_stands_where_the_camera_cannot_go(kind, where):
    limits = MotionLimits((-1.0, 3.5), [1.0, 1.4])
    planner = Planner(POLICIES[kind](), 100, 0.0, object_yaw=0.4, limits=limits, distance=0.9,
                      **where)
    for goal in followed(planner, orbit_camera(4.0, -0.9), 12):
        for camera in (goal.camera, *goal.candidates):
            assert limits.allows(camera.azimuth)
            if 'elevation_range' in where:
                assert RANGE[0] <= camera.elevation <= RANGE[1]
                assert camera.distance == 0.9
            else:
                place = camera.azimuth, camera.elevation, camera.distance
                assert place in {(0.0, 0.2, 0.9), (1.5, 1.1, 0.7), (3.0, -0.4, 0.9)}


def test_the_nearest_camera_is_at_the_smallest_view_distance_and_of_equals_the_first():
    places = [orbit_camera(azimuth, 0.3) for azimuth in (*AZIMUTHS, *AZIMUTHS)]
    cameras = [orbit_camera(0.37 * step, 0.1 * step) for step in range(12)]
    assert list(nearest_cameras(cameras, places)) == [
        min(range(len(AZIMUTHS)), key=lambda place, camera=camera: view_distance(
            places[place], camera)) for camera in cameras]
    assert len(nearest_cameras([], places)) == 0


def test_the_distances_of_all_pairs_are_the_view_distance_of_each():
    places = [orbit_camera(azimuth, 0.3, 2.0) for azimuth in AZIMUTHS]
    cameras = [orbit_camera(0.37 * step, 0.1 * step) for step in range(12)]
    np.testing.assert_allclose(
        view_distances(cameras, places),
        [[view_distance(camera, place) for place in places] for camera in cameras], atol=1e-15)
    assert view_distances([], places).shape == (0, len(places))


@pytest.mark.parametrize('kind', POLICIES)
def test_every_listed_view_is_asked_for_once(kind):
    planner = Planner(POLICIES[kind](), 100, 0.0, reachable_views=LISTED)
    goals = followed(planner, orbit_camera(2.9, 0.0), 8)
    listed = candidates(reachable_views=LISTED)
    asked = [nearest_camera(goal.camera, listed) for goal in goals]
    assert sorted(asked) == [0, 1, 2, 3]
    assert all(view_distance(goal.camera, listed[at]) < 1e-9
               for goal, at in zip(goals, asked, strict=True))


@pytest.mark.parametrize('kind', POLICIES)
def test_every_place_on_a_dome_is_asked_for_once(kind):
    planner = Planner(POLICIES[kind](), 1000, 0.0, elevation_range=(0.2, 0.9),
                      limits=MotionLimits((0.0, 1.5)))
    places = [camera for camera in candidates(elevation_range=(0.2, 0.9))
              if MotionLimits((0.0, 1.5)).allows(camera.azimuth)]
    goals = followed(planner, places[0], 2 * len(places))
    asked = [nearest_camera(goal.camera, places) for goal in goals]
    assert sorted(asked) == list(range(len(places)))


def test_a_listed_view_is_asked_for_though_one_far_from_it_is_nearest_to_it():
    planner = Planner(FarthestPolicy(), 100, 0.0, reachable_views=LISTED)
    listed = candidates(reachable_views=LISTED)
    begun = orbit_camera(0.5, 0.4, 2.0)  # the camera was there, nearest to the first of them
    assert nearest_camera(begun, listed) == 0
    asked, camera = [], begun
    while (goal := planner.add_view(LATENT, camera, 10.0).goal) is not None:
        camera = goal.camera
        asked.append(nearest_camera(camera, listed))
    assert sorted(asked) == [0, 1, 2, 3]
    assert asked[-1] == 0


def test_attention_stays_at_the_elevation_of_the_camera_until_no_view_is_left_there(attention):
    policy = AttentionPolicy(TorchPolicyRuntime(attention))
    planner = Planner(policy, 100, 0.0, elevation_range=(0.0, 1.2))
    goals = [goal.camera.elevation for goal in followed(planner, orbit_camera(0.3, 0.4), 24)]
    ring = round(24 * math.cos(0.4))
    np.testing.assert_allclose(goals[:ring], 0.4, atol=1e-9)
    assert np.abs(np.subtract(goals[ring:], 0.4)).min() > 0.3


@pytest.mark.parametrize('kind', ['uniform', 'farthest'])
def test_goals_on_a_dome_stand_at_several_elevations(kind):
    goals = followed(Planner(POLICIES[kind](), 9, 0.0, elevation_range=RANGE),
                     orbit_camera(0.0), 6)
    assert len({round(goal.camera.elevation, 3) for goal in goals}) >= 3


@pytest.mark.parametrize(('elevation', 'expected'), [(0.5, 0.5), (-0.3, 0.1), (1.5, 1.2)])
def test_the_first_goal_on_a_dome_is_the_camera_or_the_nearest_elevation(elevation, expected):
    goal = Planner(FarthestPolicy(), elevation_range=RANGE).first_goal(
        orbit_camera(1.01, elevation))
    assert (goal.camera.azimuth, goal.camera.elevation) == pytest.approx((1.01, expected))


def test_the_first_goal_of_listed_views_is_the_nearest_of_them():
    planner = Planner(FarthestPolicy(), reachable_views=LISTED)
    assert planner.first_goal(orbit_camera(1.6, 0.8)).camera.azimuth == 1.5
    above = np.diag([1.0, -1, -1, 1])
    above[2, 3] = 2
    assert planner.first_goal(Camera(above)).camera.elevation == 1.1


@pytest.mark.parametrize('where', [{'elevation_range': RANGE}, {'reachable_views': LISTED}])
def test_a_first_goal_that_is_open_stays_the_plan_of_the_planner_that_goes_on(where):
    before = Planner(UniformPolicy(5), **where)
    goal = before.first_goal(orbit_camera(1.2, 0.4))
    after = Planner(FarthestPolicy(), motion_weight=1.0, **where)
    after.go_on_from(before)
    np.testing.assert_array_equal(after.plan().camera.pose, goal.camera.pose)


@pytest.mark.parametrize('where', [{'elevation_range': RANGE}, {'reachable_views': LISTED}])
def test_a_planner_with_the_same_policy_and_places_draws_nothing_anew(where):
    policy = RandomPolicy(np.random.default_rng(3))
    before = Planner(policy, 9, 0.0, **where)
    goal = followed(before, orbit_camera(0.0), 2)[-1]
    after = Planner(policy, 9, 0.0, **where)
    after.go_on_from(before)
    np.testing.assert_array_equal(after.plan().scores, goal.scores)


def test_a_goal_on_a_dome_that_is_given_up_is_left_out_and_its_neighbours_are_not():
    planner = Planner(FarthestPolicy(), 100, 0.0, elevation_range=RANGE)
    first = planner.first_goal(orbit_camera(0.0, 0.1))
    following = planner.give_up(first.camera).goal
    assert 0 < view_distance(following.camera, first.camera) < math.radians(23)


@pytest.mark.parametrize('yaw', [0.3, -2.0])
@pytest.mark.parametrize('kind', ['uniform', 'farthest'])
def test_a_turned_object_turns_the_goals_on_a_dome_with_it(kind, yaw):
    straight, turned = (Planner(POLICIES[kind](), 9, 0.0, object_yaw=by, elevation_range=RANGE)
                        for by in (0.0, yaw))
    for azimuth, elevation in ((0.31, 0.2), (2.12, 0.9), (4.53, 0.5)):
        goal = straight.add_view(LATENT, orbit_camera(azimuth, elevation), 9.0).goal
        other = turned.add_view(LATENT, orbit_camera(azimuth + yaw, elevation), 9.0).goal
        np.testing.assert_allclose(other.camera.pose, goal.camera.turned(yaw).pose, atol=1e-6)
        np.testing.assert_allclose(other.scores, goal.scores, atol=1e-4)


@pytest.mark.parametrize(('where', 'message'), [
    ({'elevation': 0.5, 'elevation_range': RANGE}, 'elevation, elevation_range: both given'),
    ({'elevation': 0.5, 'reachable_views': LISTED}, 'elevation, reachable_views: both given'),
    ({'elevation_range': RANGE, 'reachable_views': LISTED},
     'elevation_range, reachable_views: both given: expected one of them'),
    ({'reachable_azimuths': (1.0,), 'reachable_views': LISTED},
     'reachable_azimuths, reachable_views: both given: expected one of them'),
    ({'elevation_range': (0.5,)}, 'elevation_range: not a range: expected low and high from'),
    ({'elevation_range': (0.5, 0.5)}, r'elevation_range: not a range.*got \[0.5, 0.5\]'),
    ({'elevation_range': (0.9, 0.5)}, 'elevation_range: not a range'),
    ({'reachable_views': LISTED[:-1]}, 'reachable_views: not views: expected azimuth, elevation'),
    ({'reachable_views': (0.0, 1.7, 0.0)}, 'reachable_views: out of range: .* got 1.7 and'),
    ({'reachable_views': (0.0, 0.7, -1.0)}, 'reachable_views: out of range: .* got 0.7 and -1'),
    ({'reachable_views': (0.0, 0.0, 0.0, -90.0, 0.0, 0.0)},
     'reachable_views: out of range: .* rad, got -90; is it in degrees?'),
    ({'reachable_views': (0.5, 0.7, 1.0, 0.5, 0.7, 2.0)}, 'two in one direction'),
    ({'reachable_views': (0.5, 0.7, 1.0, 0.5 + math.tau, 0.7, 1.0)}, 'two in one direction'),
    ({'reachable_views': (0.0, 0.7, 1.0, 6.2832, 0.7, 1.0)}, 'two in one direction'),
    ({'reachable_views': LISTED, 'azimuth_range': (0.5, 1.0)},
     'azimuth_range, forbidden_sectors, reachable_views: no view left'),
    ({'motion_weight': 0.5, 'motion_cost': 0.1},
     'motion_weight, motion_cost: both given: expected one of them above 0, got 0.5 and 0.1'),
])
def test_what_contradicts_itself_is_refused_in_one_line(where, message):
    with pytest.raises(ConfigError, match=message) as refused:
        ViewPlannerParameters(**where)
    assert '\n' not in str(refused.value)


def test_listed_azimuths_are_the_only_ones_of_every_ring_of_a_dome():
    limits = MotionLimits(reachable_azimuths=(0.5, 2.0))
    dome = goal_places(limits, elevation_range=RANGE)
    assert isinstance(dome, Dome)
    assert [azimuths for azimuths, _ in dome.rings] == [(0.5, 2.0)] * len(dome.rings)


@pytest.mark.parametrize('wrong', [{'distance': 0.0}, {'distance': -1.0},
                                   {'distance': math.nan}, {'elevation': 2.0},
                                   {'elevation': math.nan}])
def test_places_where_no_camera_can_stand_are_refused(wrong):
    (name,) = wrong
    with pytest.raises(ConfigError, match=f'{name}: out of range'):
        goal_places(MotionLimits(), **wrong)
