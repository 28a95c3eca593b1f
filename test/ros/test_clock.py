"""Nodes on a clock of a simulation: they follow it, and begin an episode where it goes back."""

import itertools
import math
import re

from active_recon.geometry.cameras import Camera, orbit_camera
from geometry_msgs.msg import PoseStamped
from msg_tools.cameras import pose_from_msg, pose_to_msg
from msg_tools.goals import azimuth_goal_to_msg, view_goal_from_msg
from msg_tools.stamps import nanoseconds_from_stamp, stamp_from_nanoseconds
import pytest
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from std_msgs.msg import Header

from .conftest import ANY_WEIGHTS, FakeCamera, FakeReconstructor, LATCHED_QOS
from .test_parameter_changes import change
from .test_planner_node import latent  # noqa: F401

pytestmark = pytest.mark.ros
S = 1_000_000_000


class FakeClock:
    """The time of a simulation, in the bench's hand; it is told until it is heard."""

    def __init__(self, bench):
        self._bench = bench
        self._publisher = bench.advertise(Clock, '/clock')
        self.now = 0

    def tell(self, seconds):
        self.now = round(seconds * S)
        self._publisher.publish(Clock(clock=stamp_from_nanoseconds(self.now)))

    def until(self, condition, what, seconds):
        """Tell a time until the condition holds."""
        def told():
            self.tell(seconds)
            return condition()
        return self._bench.until(told, what)


def begin_of(episode):
    return nanoseconds_from_stamp(episode.stamp)


def test_a_reconstructor_begins_an_episode_where_its_clock_goes_back(start_node, bench):
    node = start_node('reconstructor', weights=ANY_WEIGHTS, take_views='all', use_sim_time=True)
    clock = FakeClock(bench)
    episodes = bench.subscribe(Header, 'episode', LATCHED_QOS)
    bench.until(lambda: episodes, 'the first episode')
    camera = FakeCamera(bench)

    sent = itertools.count()

    def taken(second):
        camera.send(*camera.messages(second * S + next(sent)))  # best effort may lose one
        return any(second * S <= nanoseconds_from_stamp(msg.header.stamp) < (second + 1) * S
                   for msg in camera.occupancy)

    clock.until(lambda: taken(100), 'a view', 100.0)
    clock.tell(99.95)
    clock.until(lambda: taken(160), 'a view after a jump ahead', 160.0)
    assert len(episodes) == 1
    clock.until(lambda: len(episodes) == 2, 'a second episode', 50.0)
    assert begin_of(episodes[1]) == 50 * S
    bench.until(lambda: taken(161) or bench.counts('reconstructor').get('refused/last_episode'),
                'the refusal of what was on its way since before the jump')
    assert not taken(161)
    clock.until(lambda: taken(50), 'a view of the second episode', 50.0)
    assert len(episodes) == 2
    said, = node.log('the clock went back by 110.000 s: ')
    assert episodes[1].frame_id in said
    assert bench.counts('reconstructor')['clock_jumps'] == 1


def test_a_reconstructor_that_hears_no_clock_of_its_simulation_says_so(start_node, bench):
    node = start_node('reconstructor', weights=ANY_WEIGHTS, take_views='all', use_sim_time=True)
    FakeCamera(bench).show()
    bench.until(lambda: bench.counts('reconstructor').get('warned/no_clock'), 'the warning')
    assert 'warned/clock_ahead' not in bench.counts('reconstructor')
    line, = node.log('use_sim_time')
    assert re.search('WARN.* use_sim_time is set and no /clock has been received: expected .*got '
                     r'an image of \d+\.\d{3} s; start what publishes /clock', line)


def test_a_camera_that_waits_for_the_same_clock_is_told_of_it_too(start_node, bench):
    start_node('reconstructor', weights=ANY_WEIGHTS, take_views='all', use_sim_time=True)
    camera = FakeCamera(bench)

    def warned():
        camera.send(*camera.messages(0))
        return bench.counts('reconstructor').get('warned/no_clock')

    bench.until(warned, 'the warning')
    bench.until(lambda: 'no /clock has been received' in bench.state('reconstructor').problem,
                'the warning beside what is refused')


def test_a_goal_of_before_the_clock_began_is_open_since_the_clock_began(start_node, bench):
    node = start_node('view_planner', policy='farthest', start_azimuth=1.0, goal_timeout=30.0,
                      use_sim_time=True)
    clock, fake = FakeClock(bench), FakeReconstructor(bench)
    fake.begin('of no time', 0)
    bench.until(lambda: fake.goals, 'the first goal')
    clock.until(lambda: len(within(fake.goals, 0, 1)) >= 3, 'the goal to be repeated', 1000.0)
    assert not node.log('left out of this episode')
    clock.until(lambda: node.log('left out of this episode'), 'its end after 30 s', 1031.0)


def test_a_node_that_changes_to_the_clock_of_a_simulation_begins_an_episode(start_node, bench):
    start_node('reconstructor', weights=ANY_WEIGHTS)
    episodes = bench.subscribe(Header, 'episode', LATCHED_QOS)
    bench.until(lambda: episodes, 'the first episode')
    assert change(bench, 'reconstructor', use_sim_time=True)['use_sim_time'].successful
    bench.until(lambda: len(episodes) == 2, 'an episode of the simulation')
    assert begin_of(episodes[1]) < begin_of(episodes[0])


@pytest.fixture
def planner(start_node, bench):
    """Return a planner's clock at 110 s, and its reconstructor in an episode of 100 s."""
    start_node('view_planner', policy='farthest', start_azimuth=1.0, use_sim_time=True)
    clock, fake = FakeClock(bench), FakeReconstructor(bench)
    fake.begin('of before', 100 * S)
    clock.until(lambda: within(fake.goals, 110, 111), 'the first goal', 110.0)
    return clock, fake


def within(goals, low, high):
    """Return the goals whose stamps lie between two times in seconds."""
    return [msg for msg in goals if low * S <= nanoseconds_from_stamp(msg.header.stamp) < high * S]


def wait_second(bench, fake, latent):  # noqa: F811
    """Take the first view, just after 50 s, and wait for the goal after it."""
    fake.show(latent, 1.0, 50 * S + S // 10)
    bench.until(lambda: any(
        view_goal_from_msg(msg).azimuth == pytest.approx(1.0 + math.pi, abs=0.14)
        for msg in within(fake.goals, 50, 51)), 'the second goal')


def test_a_planner_waits_for_the_episode_of_the_new_time(bench, planner, latent):  # noqa: F811
    clock, fake = planner
    clock.until(lambda: bench.counts('view_planner').get('clock_jumps') == 1, 'the jump', 50.0)
    fake.goals.clear()
    fake.show(latent, 1.0, 111 * S)  # on its way since before the jump
    fake.begin('of now', 50 * S)
    first = clock.until(lambda: within(fake.goals, 50, 51), 'the first goal again', 50.0)[-1]
    assert view_goal_from_msg(first).azimuth == pytest.approx(1.0)
    wait_second(bench, fake, latent)
    assert bench.counts('view_planner')['clock_jumps'] == 1


def test_a_planner_keeps_an_episode_that_came_before_it_heard_the_new_time(
        bench, planner, latent):  # noqa: F811
    clock, fake = planner
    fake.goals.clear()
    fake.begin('of now', 50 * S)
    bench.until(lambda: bench.counts('view_planner').get('episodes') == 2, 'the new episode')
    first = clock.until(lambda: within(fake.goals, 50, 51), 'its first goal', 50.0)[-1]
    assert view_goal_from_msg(first).azimuth == pytest.approx(1.0)
    wait_second(bench, fake, latent)
    assert bench.counts('view_planner')['episodes'] == 2


@pytest.mark.parametrize(('begin', 'order'), [
    (0, 'the clock first'), pytest.param(0, 'the episode first', marks=pytest.mark.slow),
    pytest.param(20, 'the clock first', marks=pytest.mark.slow)])
def test_views_of_an_episode_that_began_at_an_earlier_stamp_are_not_of_the_one_after_a_jump(
        start_node, bench, latent, begin, order):  # noqa: F811
    start_node('view_planner', policy='farthest', start_azimuth=1.0, use_sim_time=True)
    clock, fake = FakeClock(bench), FakeReconstructor(bench)
    fake.begin('of before', begin * S)
    clock.until(lambda: within(fake.goals, 110, 111), 'the first goal', 110.0)
    fake.show(latent, 1.0, 110 * S)
    bench.until(lambda: bench.counts('view_planner').get('views') == 1, 'its view')
    if order == 'the clock first':
        clock.until(lambda: bench.counts('view_planner').get('clock_jumps') == 1, 'a jump', 50.0)
    fake.begin('of now', 50 * S)
    bench.until(lambda: bench.counts('view_planner').get('episodes') == 2, 'the new episode')
    clock.until(lambda: bench.counts('view_planner').get('clock_jumps') == 1, 'the jump', 50.0)
    fake.goals.clear()
    clock.until(lambda: within(fake.goals, 50, 51), 'its first goal', 50.0)
    assert view_goal_from_msg(fake.goals[-1]).azimuth == pytest.approx(1.0)
    wait_second(bench, fake, latent)


def test_a_goal_that_another_policy_has_none_instead_of_ends_where_the_clock_goes_back(
        start_node, bench, latent):  # noqa: F811
    start_node('view_planner', policy='uniform', max_views=24, start_azimuth=math.radians(58),
               azimuth_range='[1.0, 1.3]', use_sim_time=True)  # of a single candidate
    clock, fake = FakeClock(bench), FakeReconstructor(bench)
    fake.begin('only', 20 * S)
    clock.until(lambda: within(fake.goals, 110, 111), 'the first goal', 110.0)
    fake.show(latent, math.radians(58), 110 * S + S // 2)
    clock.until(lambda: view_goal_from_msg(fake.goals[-1]).azimuth == pytest.approx(
        math.radians(73)), 'the goal between candidates', 111.0)
    assert change(bench, 'view_planner', policy='farthest')['policy'].successful
    clock.until(lambda: fake.done[-1].frame_id == 'no_reachable_azimuth', 'the end', 50.0)


def test_a_first_goal_is_not_where_the_camera_stood_before_the_clock_went_back(start_node, bench):
    start_node('view_planner', policy='farthest', use_sim_time=True)
    clock, fake = FakeClock(bench), FakeReconstructor(bench)
    poses = bench.advertise(PoseStamped, 'camera/pose')

    def stands_at(azimuth, second):
        header = Header(stamp=stamp_from_nanoseconds(second * S), frame_id='object')
        poses.publish(pose_to_msg(orbit_camera(azimuth).pose, header))

    fake.begin('of before', 100 * S)
    clock.until(lambda: stands_at(2.0, 110) or fake.goals, 'a goal', 110.0)
    clock.until(lambda: bench.counts('view_planner').get('clock_jumps') == 1, 'the jump', 50.0)
    fake.begin('of now', 50 * S)
    bench.until(lambda: bench.counts('view_planner').get('episodes') == 2, 'the new episode')
    late = bench.within(0.5, lambda: stands_at(2.0, 111) or within(fake.goals, 50, 51))
    assert not late  # the poses were on their way since before the jump
    first = bench.until(lambda: stands_at(1.0, 50) or within(fake.goals, 50, 51), 'a goal')[-1]
    assert view_goal_from_msg(first).azimuth == pytest.approx(1.0)


def test_a_turntable_begins_anew_where_its_clock_goes_back(start_node, bench, box):
    start_node('turntable_camera', mesh=box, start_azimuth=1.0, use_sim_time=True)
    clock = FakeClock(bench)
    poses = bench.subscribe(PoseStamped, 'camera/pose')
    goals = bench.advertise(JointState, 'next_azimuth', LATCHED_QOS)

    def was_at(azimuth, low, high):
        """Return whether a pose of that time, seconds, is near an azimuth."""
        return any(abs(Camera(pose_from_msg(msg)).azimuth - azimuth) < 0.14 for msg in poses
                   if low * S <= nanoseconds_from_stamp(msg.header.stamp) < high * S)

    def let_pass(seconds):
        """Let the time go on: the stream stands still with the clock."""
        clock.tell(next(seconds))
        goals.publish(azimuth_goal_to_msg(2.0, Header()))

    before, after = itertools.count(100, 0.1), itertools.count(50, 0.1)
    bench.until(lambda: let_pass(before) or was_at(2.0, 100, 1000), 'the goal')
    bench.until(lambda: clock.tell(next(after)) or was_at(1.0, 50, 100), 'the start')
    bench.until(lambda: let_pass(after) or was_at(2.0, 50, 100), 'the goal again')
