"""What is told of a camera's motion."""

import math

from active_recon.acquisition.motion_monitor import MotionMonitor
from active_recon.acquisition.stillness import STILL_ANGLE
from active_recon.geometry.cameras import orbit_camera
from active_recon.simulation.turntable import Turntable
import numpy as np
import pytest

TOLERANCE, TIMEOUT = 0.14, 1.0
HORIZON = 0.0  # where views are as far apart as their azimuths

GOAL = orbit_camera(1.0, 0.6)


class Motion:
    """A stream of poses, heard by a monitor."""

    def __init__(self, rate=30.0):
        self.monitor = MotionMonitor(TOLERANCE, TIMEOUT)
        self.rate = rate
        self.now = 100.0

    def run(self, azimuth_at, seconds, goal=None):
        """Go on for a while; return the time from now at which each fault was first found."""
        began, found = self.now, {}
        goal_camera = None if goal is None else orbit_camera(goal, HORIZON)
        for _ in range(round(seconds * self.rate)):
            camera = orbit_camera(azimuth_at(self.now), HORIZON)
            self.monitor.add(camera, round(self.now * 1e9), goal_camera)
            for kind in self.monitor.faults():
                found.setdefault(kind, self.now - began)
            self.now += 1 / self.rate
        return found


@pytest.mark.parametrize('rate', [10.0, 30.0, pytest.param(200.0, marks=pytest.mark.slow)])
@pytest.mark.parametrize('speed', [0.3, 1.0, 20.0, 100.0])
@pytest.mark.parametrize('step', [math.tau / 24, 1e-4], ids=['view by view', 'smooth'])
def test_a_turntable_that_goes_from_goal_to_goal_neither_jumps_nor_stalls(rate, speed, step):
    motion, turntable = Motion(rate), Turntable(speed=speed)
    for goal in (1.0, 5.0, 0.5, 3.5, 3.3, 0.0):
        turntable.turn_to(goal, motion.now)
        shown = 0.2 + abs(math.pi / speed)
        assert not motion.run(lambda now: round(turntable.azimuth_at(now) / step) * step,
                              shown, goal)


@pytest.mark.parametrize('rate', [10.0, 30.0, 200.0])
@pytest.mark.parametrize('sigma', [0.05, 0.5])
def test_poses_that_jump_are_told_within_a_second_and_no_more_a_second_after(rate, sigma):
    motion, rng = Motion(rate), np.random.default_rng(0)
    assert not motion.run(lambda now: 2.0, 2.0)
    found = motion.run(lambda now: 2.0 + sigma * rng.standard_normal(), 3.0)
    assert found['noisy_poses'] <= 1.0
    motion.run(lambda now: 2.0, 1.1)
    assert not motion.monitor.faults()


def test_the_poses_of_two_cameras_on_one_topic_are_told_with_what_may_be_behind_it():
    motion = Motion()
    motion.run(lambda now: 3.0 * (round(now * 30) % 2), 2.0)
    assert 'as those of two publishers do' in motion.monitor.faults()['noisy_poses']


def test_poses_that_tremble_less_than_a_still_camera_may_are_not_told():
    motion, rng = Motion(), np.random.default_rng(0)
    assert not motion.run(lambda now: rng.uniform(-STILL_ANGLE, STILL_ANGLE) / 2, 5.0)


def test_a_camera_that_stands_away_from_its_goal_has_stalled_until_it_moves_on():
    motion = Motion()
    motion.run(lambda now: 1.0, 5.0)
    found = motion.run(lambda now: 1.0, 2.0, goal=2.0)
    assert found == {'stalled': pytest.approx(TIMEOUT, abs=0.05)}
    assert 'goal, 57 degrees away' in motion.monitor.faults()['stalled']
    began = motion.now - 0.1
    assert not motion.run(lambda now: min(1.0 + now - began, 2.0), 3.0, goal=2.0)


def test_a_camera_at_the_goal_s_azimuth_below_it_has_stalled_too():
    motion = Motion()
    for _ in range(60):
        motion.monitor.add(orbit_camera(1.0, 0.1), round(motion.now * 1e9), GOAL)
        motion.now += 1 / motion.rate
    assert 'goal, 29 degrees away' in motion.monitor.faults()['stalled']


def test_a_camera_without_an_open_goal_or_near_it_may_stand_for_ever():
    motion = Motion()
    assert not motion.run(lambda now: 1.0, 10.0)
    assert not motion.run(lambda now: 1.0, 10.0, goal=1.1)


def test_each_goal_has_its_own_time_to_be_gone_to():
    motion = Motion()
    for goal in (2.0, 3.0, 4.0, 5.0):
        assert not motion.run(lambda now: 0.0, 0.9 * TIMEOUT, goal)


def test_poses_that_are_older_than_the_last_are_passed_by():
    motion = Motion()
    motion.run(lambda now: 1.0, 0.5)
    before = motion.now
    for back in range(20):
        motion.monitor.add(orbit_camera(back % 2), round((before - 0.5) * 1e9) + back, None)
    assert not motion.monitor.faults()


def test_after_the_clock_went_back_the_motion_is_watched_anew():
    motion = Motion()
    motion.run(lambda now: 1.0, 3.0, goal=2.0)
    motion.now -= 60.0
    assert motion.run(lambda now: 1.0, 2.0, goal=2.0) == {
        'stalled': pytest.approx(TIMEOUT, abs=0.05)}
