"""Which images become views."""

import math

from active_recon.acquisition.stillness import Stillness
from active_recon.acquisition.view_gate import ViewGate
from active_recon.errors import ConfigError
from active_recon.geometry.cameras import Camera, orbit_camera
import numpy as np
import pytest

PERIOD = 100_000_000  # nanoseconds


def offer(gate, azimuths, goals_expected=False, start=0):
    """Offer images at 10 Hz; return the indices of those that became views."""
    taken = []
    for index, azimuth in enumerate(azimuths):
        camera = orbit_camera(azimuth)
        if gate.wants(camera, start + index * PERIOD, goals_expected):
            gate.took(camera)
            taken.append(index)
    return taken


def test_all_takes_every_image_of_a_moving_camera():
    assert offer(ViewGate('all'), [0, 1, 2, 2]) == [0, 1, 2, 3]


def test_by_separation_waits_until_the_camera_is_still():
    gate = ViewGate('by_separation', min_view_separation=0.2)
    assert offer(gate, [0, 0, 0, 0.1, 0.1, 0.5, 0.8, 0.8, 0.8]) == [1, 7]


def test_separation_is_the_short_way_round():
    gate = ViewGate('by_separation', min_view_separation=0.2)
    assert offer(gate, [0.05, 0.05, math.tau - 0.05, math.tau - 0.05]) == [1]


def test_a_goal_is_taken_once_and_only_near_it():
    gate = ViewGate('at_goal', goal_tolerance=0.14)
    assert offer(gate, [0, 0, 0]) == []
    gate.set_goal(orbit_camera(1.0), stamp=1)
    assert offer(gate, [0.83, 0.83, 0.85, 0.85, 0.85, 1.0, 1.0], start=10 * PERIOD) == [3]


@pytest.mark.parametrize(('take_views', 'awaits'), [
    ('at_goal', True), ('auto', True), ('by_separation', False), ('all', False)])
def test_a_goal_awaits_a_view_only_where_views_are_taken_for_goals(take_views, awaits):
    gate = ViewGate(take_views)
    gate.set_goal(orbit_camera(1.0), stamp=1)
    assert (gate.open_goal is not None) is awaits


@pytest.mark.parametrize(('elevation_off', 'azimuth_off', 'taken'), [
    (0.13, 0.0, True), (-0.13, 0.0, True), (0.15, 0.0, False), (-0.15, 0.0, False),
    (0.12, 0.12, False), (0.08, 0.08, True)])
def test_a_view_at_another_elevation_reaches_the_goal_within_the_tolerance_alone(
        elevation_off, azimuth_off, taken):
    gate = ViewGate('at_goal', goal_tolerance=0.14)
    gate.set_goal(orbit_camera(1.0, 0.5), stamp=1)
    camera = orbit_camera(1.0 + azimuth_off, 0.5 + elevation_off)
    assert [gate.wants(camera, number * PERIOD) for number in range(3)] == [False, taken, taken]


def test_how_far_the_camera_is_away_and_how_it_is_rolled_makes_no_other_view():
    gate = ViewGate('at_goal', goal_tolerance=0.01)
    gate.set_goal(orbit_camera(1.0, 0.5), stamp=1)
    pose = orbit_camera(1.0, 0.5, 3.0).pose.copy()
    pose[:3, :3] = pose[:3, :3] @ [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    assert [gate.wants(Camera(pose), number * PERIOD) for number in range(2)] == [False, True]


def test_views_of_one_azimuth_at_two_elevations_are_separate():
    gate = ViewGate('by_separation', min_view_separation=0.2)
    low, high = orbit_camera(1.0, 0.3), orbit_camera(1.0, 0.6)
    assert gate.wants(low, 0) or gate.wants(low, PERIOD)
    gate.took(low)
    assert not gate.wants(high, 2 * PERIOD)
    assert gate.wants(high, 3 * PERIOD)


def test_the_same_azimuth_under_a_new_stamp_is_a_new_goal_and_under_the_old_one_is_not():
    gate = ViewGate('at_goal')
    gate.set_goal(orbit_camera(1.0), stamp=1)
    assert offer(gate, [1, 1, 1]) == [1]
    gate.set_goal(orbit_camera(1.0), stamp=1)
    assert offer(gate, [1, 1], start=10 * PERIOD) == []
    gate.set_goal(orbit_camera(1.0), stamp=2)
    assert offer(gate, [1, 1], start=20 * PERIOD) == [0]


def test_auto_goes_by_separation_until_goals_are_given_or_expected():
    gate = ViewGate('auto')
    assert offer(gate, [0, 0]) == [1]
    assert offer(gate, [1, 1], goals_expected=True, start=10 * PERIOD) == []
    assert offer(gate, [2, 2], start=20 * PERIOD) == [1]
    gate.set_goal(orbit_camera(0.0), stamp=1)
    assert offer(gate, [3, 3, 0, 0], start=30 * PERIOD) == [3]


def test_a_view_that_was_not_used_leaves_its_goal_open():
    gate = ViewGate('at_goal')
    gate.set_goal(orbit_camera(0.0), stamp=1)
    offer(gate, [0.5])
    camera = orbit_camera(0.0)
    assert not gate.wants(camera, PERIOD)
    assert gate.wants(camera, 2 * PERIOD)
    assert gate.wants(camera, 3 * PERIOD)


def test_a_camera_that_turns_in_place_is_not_still():
    gate = ViewGate('by_separation')
    camera = orbit_camera(0.0)
    turned = orbit_camera(0.0)
    turned.pose[:3, :3] = turned.pose[:3, :3] @ [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    assert not gate.wants(camera, 0)
    assert not gate.wants(turned, PERIOD)
    assert gate.wants(turned, 2 * PERIOD)


def test_an_episode_begins_without_goal_and_view():
    gate = ViewGate('auto')
    gate.set_goal(orbit_camera(2.0), stamp=1)
    assert offer(gate, [2, 2]) == [1]
    gate.reset()
    assert offer(gate, [2, 2], start=10 * PERIOD) == [1]


@pytest.mark.parametrize(('settle_time', 'taken'), [(0.0, 5), (0.08, 6), (0.25, 8), (0.3, 8)])
def test_after_a_motion_the_camera_settles_before_an_image_becomes_a_view(settle_time, taken):
    gate = ViewGate('at_goal', settle_time=settle_time)
    gate.set_goal(orbit_camera(1.0), stamp=1)
    assert offer(gate, [0, 0, 0, 0.4, 0.7, *[1.0] * 8]) == [taken]


def test_an_unknown_way_to_take_views_is_refused():
    with pytest.raises(ConfigError, match="take_views: unknown value: expected one of auto.*got "
                                          "'sometimes'"):
        ViewGate('sometimes')


def test_poses_that_jump_are_of_no_still_camera_until_half_a_second_after():
    gate = ViewGate('by_separation')
    jumping = [0.05 * (-1) ** index for index in range(20)]
    assert offer(gate, [*jumping, *[1.0] * 10]) == [25]


def test_a_camera_that_rests_between_two_ways_does_not_jump():
    gate = ViewGate('by_separation', min_view_separation=0.2)
    assert offer(gate, [0, 0, 1, 1, 0, 0, 1, 1]) == [1, 3, 5, 7]


@pytest.mark.parametrize('elevation_deg', [85, 89, 89.99])
def test_a_camera_that_trembles_above_the_object_is_still(elevation_deg):
    stillness, rng = Stillness(), np.random.default_rng(0)
    pose = orbit_camera(0.3, math.radians(elevation_deg), 0.5).pose
    for number in range(200):
        trembling = pose.copy()
        trembling[:3, 3] += rng.normal(0, 3e-4, 3)  # a third of a millimetre
        stillness.add(Camera(trembling), number * PERIOD)
        assert not stillness.jumps(1)
    assert stillness.is_still()
