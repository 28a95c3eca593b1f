"""What the view planner asks of the camera's motion, over real DDS: limits, timeouts, stops."""

import math

from active_recon.geometry.cameras import azimuth_difference
from msg_tools.goals import view_goal_from_msg
from msg_tools.stamps import nanoseconds_from_stamp
import numpy as np
import pytest

from .conftest import FakeReconstructor
from .test_parameter_changes import change_together

pytestmark = pytest.mark.ros
START = 1.0
LATENT = np.zeros((4, 4, 4), np.float32)


@pytest.fixture(scope='module')
def node(start_shared_node):
    return start_shared_node('view_planner', policy='farthest', start_azimuth=START, max_views=50,
                             entropy_tolerance=0.0)


@pytest.fixture(scope='module')
def shared_fake(shared_bench, node):
    return FakeReconstructor(shared_bench)


@pytest.fixture
def fake(shared_fake, request):
    """Begin an episode of the test's own; wait until its first goal is asked for."""
    begin = shared_fake.bench.now()
    shared_fake.begin(request.node.name, begin)
    assert azimuth(shared_fake.wait_goal(begin)) == pytest.approx(START)
    return shared_fake


def azimuth(goal):
    return view_goal_from_msg(goal).azimuth


def count(fake, key):
    return int(fake.bench.counts('view_planner').get(key, 0))


def change(fake, **values):
    """Change parameters while the node runs; return why it refuses, '' if it does not."""
    result = change_together(fake.bench, 'view_planner', **values)
    return '' if result.successful else result.reason


def wait_end(fake, reason):
    """Wait for an end for a reason, in the topic and in the diagnostics; return its stamp."""
    end = fake.bench.until(
        lambda: fake.done and fake.done[-1].frame_id == reason and fake.done[-1], reason)
    fake.bench.until(
        lambda: fake.bench.state('view_planner').facts.get('Done') == reason, f'the fact {reason}')
    return nanoseconds_from_stamp(end.stamp)


def test_a_goal_without_a_view_gives_way_to_the_next_best_until_none_is_left(fake, node):
    before, asked = count(fake, 'warned/goal_timeout'), fake.bench.now()
    try:
        assert not change(fake, reachable_azimuths=[START, 2.0, 3.5], goal_timeout=0.3)
        assert wait_end(fake, 'no_reachable_azimuth') > asked
        fake.bench.until(lambda: count(fake, 'warned/goal_timeout') == before + 3, 'the count')
        first = node.log('left out of this episode')[0]
        assert 'no view from azimuth 57.3, elevation 30.0 degrees: expected one' in first
        assert 'the next best is azimuth 114.6, elevation 30.0 degrees' in first
        assert node.log('done: no_reachable_azimuth')
        assert 'taken or given up' in fake.bench.call('plan').message
    finally:
        assert not change(fake, reachable_azimuths=[], goal_timeout=0.0)


def test_a_goal_that_is_skipped_gives_way_to_the_next_best_at_once_until_none_is_left(fake, node):
    try:
        assert not change(fake, reachable_azimuths=[START, 2.0])
        asked = fake.bench.now()
        answer = fake.bench.call('skip_goal')
        assert (answer.success, answer.message) == (True, '2.000000')
        assert azimuth(fake.wait_goal(asked)) == pytest.approx(2.0)
        [told] = node.log('skipped: ')
        assert 'azimuth 57.3, elevation 30.0 degrees is left out of this episode, the next' in told
        assert fake.bench.call('skip_goal').message == 'no_reachable_azimuth'
        assert wait_end(fake, 'no_reachable_azimuth') > asked
        answer = fake.bench.call('skip_goal')
        assert (answer.success, answer.message) == (
            False, 'no goal to skip: expected an open one, there is none')
    finally:
        assert not change(fake, reachable_azimuths=[])


def test_a_goal_that_is_forbidden_while_it_is_open_is_taken_back(fake):
    asked = fake.bench.now()
    try:
        assert not change(fake, forbidden_sectors=[0.5, 1.5])
        goal = azimuth(fake.wait_goal(asked))
        assert abs(azimuth_difference(goal, START)) > 0.5
        taken = fake.show(LATENT, goal)
        assert not 0.5 <= azimuth(fake.wait_goal(taken)) <= 1.5
        reason = change(fake, azimuth_range=[0.6, 1.4])
        assert 'together they leave none' in reason
    finally:
        assert not change(fake, forbidden_sectors=[])


def test_a_weight_of_motion_draws_the_goals_near(fake):
    try:
        assert not change(fake, motion_weight=100.0)
        taken = fake.show(LATENT, START)
        near = azimuth(fake.wait_goal(taken))
        assert abs(azimuth_difference(near, START)) < math.radians(23)
    finally:
        assert not change(fake, motion_weight=0.0)
    taken = fake.show(LATENT, near)
    assert abs(azimuth_difference(azimuth(fake.wait_goal(taken)), near)) > 2


def test_a_stopped_episode_asks_for_nothing_more_and_the_next_one_does(fake, node):
    asked = fake.bench.now()
    answer = fake.bench.call('stop_episode')
    assert (answer.success, answer.message) == (True, 'stopped')
    assert wait_end(fake, 'stopped') > asked
    assert node.log('done: stopped')
    assert fake.bench.call('stop_episode').message == 'already done'
    late = fake.show(LATENT, START)
    fake.bench.until(lambda: nanoseconds_from_stamp(fake.done[-1].stamp) == late,
                     'the end after a late view')
    assert fake.done[-1].frame_id == 'stopped'
    assert nanoseconds_from_stamp(fake.goals[-1].header.stamp) < asked
    begin = fake.bench.now()
    fake.begin('after the stop', begin)
    fake.wait_goal(begin)
    fake.bench.until(lambda: not fake.done[-1].frame_id, 'an end that is taken back')


def test_what_is_late_of_the_last_episode_never_reaches_the_new_one(fake):
    taken = fake.show(LATENT, START)
    fake.wait_goal(taken)
    dropped = count(fake, 'dropped/last_episode')
    old, begin = fake.bench.now(), fake.bench.now() + 1
    fake.begin('the new one', begin)
    first = fake.wait_goal(begin)
    assert azimuth(first) == pytest.approx(START)
    fake.show(LATENT, 4.0, old)
    fake.bench.until(lambda: count(fake, 'dropped/last_episode') == dropped + 3,
                     'every part of the late view dropped')
    taken = fake.show(LATENT, START)
    goal = azimuth(fake.wait_goal(taken))
    assert abs(azimuth_difference(goal, START)) == pytest.approx(math.pi, abs=0.14)


def test_parts_of_a_late_view_are_not_joined_across_episodes(fake):
    stamp = fake.show(LATENT, 4.0, parts=('latent', 'view'))
    begin = fake.bench.now()
    dropped = count(fake, 'dropped/last_episode')
    fake.begin('across', begin)
    fake.wait_goal(begin)
    fake.show(LATENT, 4.0, stamp, parts=('entropy',))
    fake.bench.until(lambda: count(fake, 'dropped/last_episode') == dropped + 1, 'its last part')
    assert azimuth(fake.goals[-1]) == pytest.approx(START)


def test_a_view_that_is_heard_before_its_episode_counts_in_it(fake):
    begin = fake.bench.now()
    taken = fake.show(LATENT, START)
    fake.wait_goal(taken)
    asked = fake.bench.now()
    fake.begin('heard late', begin)
    goal = azimuth(fake.wait_goal(asked))
    assert abs(azimuth_difference(goal, START)) == pytest.approx(math.pi, abs=0.14)
