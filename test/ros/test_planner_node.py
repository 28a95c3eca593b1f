"""The view planner alone, over real DDS: what it asks for, and what it refuses."""

import math
import signal
from unittest.mock import Mock

from active_recon.geometry.cameras import azimuth_difference, orbit_camera
from active_recon.models.weights_files import find_weights, PAPER_MODEL, weights_hash
from active_recon.nodes.loop.refused_views import refusing_views
from active_recon.policies.checked import telling_failures
from active_recon.runtimes import load_policy_runtime
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PoseStamped
from judged_quality import quality_of
from msg_tools.cameras import pose_to_msg
from msg_tools.goals import scores_from_msg, view_goal_from_msg
from msg_tools.stamps import nanoseconds_from_stamp, stamp_from_nanoseconds
import numpy as np
import pytest
from sensor_msgs.msg import JointState, PointCloud2
from std_msgs.msg import Header

from .conftest import FakeReconstructor, LATCHED_QOS

pytestmark = pytest.mark.ros


@pytest.fixture(scope='module')
def latent():
    policy = load_policy_runtime(find_weights(PAPER_MODEL))
    return np.zeros(policy.facts['latent_shape'], np.float32)


def test_the_planner_asks_decides_refuses_and_finishes(start_node, bench, latent):
    planner = start_node('view_planner', policy='attention', weights=PAPER_MODEL, max_views=2,
                         entropy_tolerance=0.0, start_azimuth=2.0)
    fake = FakeReconstructor(bench)
    scores = bench.subscribe(PointCloud2, 'azimuth_scores', LATCHED_QOS)
    begin = bench.now()
    fake.begin('first')
    first = fake.wait_goal(begin)
    assert view_goal_from_msg(first).azimuth == pytest.approx(2.0)
    _, azimuths, values = scores_from_msg(bench.until(lambda: scores and scores[-1], 'scores'))
    assert abs(azimuth_difference(azimuths[values.argmax()], 2.0)) <= math.radians(7.5)

    fake.show(latent[:3], 2.0)
    bench.until(lambda: any(key.startswith('refused/') for key in bench.counts('view_planner')),
                'the refusal of a latent of another network')
    line, = planner.log('refused|ERROR|Traceback')
    assert 'refused: wrong shape of the latent: expected' in line
    fake.show_entropy(math.nan)
    bench.until(lambda: bench.counts('view_planner').get('refused/entropy') == 1,
                'the refusal of an entropy that is none')

    taken = fake.show(latent, 2.0)
    second = fake.wait_goal(taken)
    end = fake.show(latent, view_goal_from_msg(second).azimuth)
    done = bench.until(lambda: fake.done and fake.done[-1].frame_id and fake.done[-1], 'the end')
    assert (done.frame_id, nanoseconds_from_stamp(done.stamp)) == ('max_views', end)
    before = bench.now()
    fake.begin('second')
    fake.wait_goal(before)
    bench.until(lambda: not fake.done[-1].frame_id, 'an end that is taken back')


def test_a_view_on_which_a_policy_fails_is_not_laid_to_the_reconstructor():
    told = Mock()
    with refusing_views(told), telling_failures('policy:'):
        raise RuntimeError('no luck')
    (_, said), _ = told.raise_warning.call_args
    assert said == ('no goal after the last view: policy: fails with RuntimeError: no luck; mend '
                    'the policy, or set another, which then chooses')


def test_a_planner_warns_for_as_long_as_it_can_use_no_view_of_the_reconstructor(
        start_node, bench, latent):
    planner = start_node('view_planner', policy='attention', weights=PAPER_MODEL,
                         start_azimuth=2.0)
    fake = FakeReconstructor(bench)
    begin = bench.now()
    fake.begin('first')
    fake.wait_goal(begin)
    told = bench.subscribe(DiagnosticArray, '/diagnostics')

    def levels():
        return [status.level for msg in told for status in msg.status
                if status.name == '/view_planner']

    fake.show(latent[:3], 2.0)
    bench.until(lambda: DiagnosticStatus.WARN in levels(), 'the warning')
    told.clear()
    bench.until(lambda: len(levels()) > 2, 'what is told once a second')
    assert set(levels()) == {DiagnosticStatus.WARN}
    said = bench.state('view_planner').problem
    assert 'no goal after the last view: wrong shape of the latent' in said
    assert 'must be those of the reconstructor' in said
    assert bench.counts('view_planner')['warned/no_goal'] == 1
    fake.wait_goal(fake.show(latent, 2.0))
    bench.until(lambda: not bench.state('view_planner').problem, 'the end of the warning')
    assert planner.log('over: no goal after the last view')


def test_the_goals_of_an_episode_that_a_clock_ahead_began_are_of_that_episode(
        start_node, bench, latent):
    start_node('view_planner', policy='farthest', start_azimuth=1.0, max_views=3)
    fake = FakeReconstructor(bench)
    begin = bench.now() + 60_000_000_000
    fake.begin('of a clock ahead', begin)
    first = fake.wait_goal(begin - 1)
    second = fake.wait_goal(fake.show(latent, 1.0, begin + 1) - 1)
    assert view_goal_from_msg(first).azimuth == pytest.approx(1.0)
    assert view_goal_from_msg(second).azimuth == pytest.approx(1.0 + math.pi, abs=0.14)


def test_a_goal_is_repeated_under_its_stamp_until_its_view_comes(start_node, bench, latent):
    start_node('view_planner', policy='farthest', start_azimuth=1.0)
    fake = FakeReconstructor(bench)
    azimuths = bench.subscribe(JointState, 'next_azimuth')
    fake.begin('only')
    bench.until(lambda: len(azimuths) >= 2, 'the goal again')
    assert len({nanoseconds_from_stamp(msg.header.stamp) for msg in azimuths}) == 1
    taken = fake.show(latent, 1.0)
    second = view_goal_from_msg(fake.wait_goal(taken))
    assert second.azimuth == pytest.approx(1.0 + math.pi, abs=0.14)


def test_a_planner_that_comes_late_goes_on_from_the_latched_view(start_node, bench, latent):
    early = start_node('view_planner', policy='farthest', start_azimuth=1.0)
    fake = FakeReconstructor(bench)
    fake.begin('only')
    fake.wait_goal(0)
    fake.show(latent, 1.0)
    bench.until(lambda: bench.counts('view_planner').get('views') == 1, 'the view')
    early.stop(signal.SIGKILL)
    fake.goals.clear()
    after = bench.now()
    start_node('view_planner', policy='farthest', start_azimuth=1.0)
    second = view_goal_from_msg(fake.wait_goal(after))
    assert second.azimuth == pytest.approx(1.0 + math.pi, abs=0.14)
    assert all(view_goal_from_msg(msg).azimuth != pytest.approx(1.0) for msg in fake.goals)


def test_a_planner_that_comes_late_counts_the_views_before_and_asks_for_none_of_them(
        start_node, bench, latent):
    fake = FakeReconstructor(bench, ('episode', *FakeReconstructor.PARTS, 'views'), heard=False)
    everything = (*FakeReconstructor.PARTS, 'views')
    fake.begin('before')
    fake.show(latent, 3.0, parts=everything, earlier=(1.0, 5.0))
    start_node('view_planner', policy='farthest', max_views=4, entropy_tolerance=0.0)
    goal = view_goal_from_msg(bench.until(lambda: fake.goals, 'a goal')[-1]).azimuth
    away = [abs(azimuth_difference(goal, azimuth)) for azimuth in (1.0, 3.0, 5.0)]
    assert min(away) > 0.8
    fake.show(latent, goal, parts=everything, earlier=(1.0, 5.0, 3.0))
    bench.until(lambda: fake.done and fake.done[-1].frame_id == 'max_views', 'the end')
    bench.until(lambda: bench.counts('view_planner').get('views') == 2, 'its two views')


@pytest.mark.parametrize('simulated', [False, True])
def test_a_planner_that_comes_late_waits_until_it_could_hear_every_part_of_a_view(
        start_node, bench, latent, simulated):
    fake = FakeReconstructor(bench, ('episode', 'latent', 'view'), heard=False)
    fake.begin('before')
    stamp = fake.show(latent, 1.0, parts=('latent', 'view'))
    start_node('view_planner', policy='farthest', start_azimuth=1.0, use_sim_time=simulated)
    bench.until(lambda: bench.counts('view_planner').get('episodes'), 'the episode')
    assert not bench.within(1.5, lambda: fake.goals)
    fake.publish_on('entropy', heard=False)
    fake.show(latent, 1.0, stamp, parts=('entropy',))
    goal = view_goal_from_msg(bench.until(lambda: fake.goals, 'a goal')[0]).azimuth
    assert abs(azimuth_difference(goal, 1.0)) == pytest.approx(math.pi, abs=0.14)


@pytest.mark.parametrize(('parameters', 'first', 'elevation'), [
    ({}, 1.0, math.pi / 4), ({'start_azimuth': 2.0}, 2.0, math.pi / 4),
    ({'elevation': 0.2}, 1.0, 0.2), ({'start_azimuth': 2.0, 'elevation': 0.2}, 2.0, 0.2)])
def test_goals_stand_at_the_camera_s_elevation_unless_another_is_given(
        start_node, bench, latent, parameters, first, elevation):
    start_node('view_planner', policy='farthest', distance=0.7, **parameters)
    fake = FakeReconstructor(bench)
    poses = bench.advertise(PoseStamped, 'camera/pose')
    scores = bench.subscribe(PointCloud2, 'azimuth_scores', LATCHED_QOS)
    begin = bench.now()
    fake.begin('only', begin)
    camera = orbit_camera(1.0, math.pi / 4)

    def asked():
        stamp = stamp_from_nanoseconds(bench.now())
        poses.publish(pose_to_msg(camera.pose, Header(stamp=stamp, frame_id='object')))
        return fake.goals

    goals = [view_goal_from_msg(bench.until(asked, 'the first goal')[-1])]
    assert goals[0].azimuth == pytest.approx(first)
    taken = fake.show(latent, goals[0].azimuth, elevation=math.pi / 4)
    goals.append(view_goal_from_msg(fake.wait_goal(taken)))
    assert goals[1].azimuth == pytest.approx(first + math.pi, abs=0.14)
    for goal in goals:
        assert (goal.elevation, goal.distance) == pytest.approx((elevation, 0.7))
    positions, _, _ = scores_from_msg(bench.until(lambda: scores, 'the scores')[-1])
    np.testing.assert_allclose(positions[:, 2], 0.7 * math.sin(elevation), atol=1e-6)


def test_a_planner_waits_for_the_quality_of_a_view_and_stops_by_it(start_node, bench, latent):
    start_node('view_planner', policy='farthest', start_azimuth=1.0, target_quality=0.5)
    fake = FakeReconstructor(bench, ('episode', *FakeReconstructor.PARTS, 'quality'))
    fake.begin('only')
    fake.wait_goal(0)
    first = fake.show(latent, 1.0)
    assert not bench.within(1.0, lambda: bench.counts('view_planner').get('views'))
    fake.show(latent, 1.0, first, parts=('quality',), quality=quality_of())
    goal = view_goal_from_msg(fake.wait_goal(first))
    second = fake.show(latent, goal.azimuth, parts=('quality', *FakeReconstructor.PARTS),
                       quality=quality_of(promise=0.5))
    done = bench.until(lambda: fake.done and fake.done[-1].frame_id and fake.done[-1], 'the end')
    assert (done.frame_id, nanoseconds_from_stamp(done.stamp)) == ('target_reached', second)


def test_other_weights_than_the_policy_s_are_told_until_they_are_the_same(
        start_node, bench, latent):
    start_node('view_planner', policy='attention', weights=PAPER_MODEL, entropy_tolerance=0.0,
               start_azimuth=1.0)
    fake = FakeReconstructor(bench, ('episode', *FakeReconstructor.PARTS, 'quality'))
    fake.begin('only')
    stamp = 0
    for weights in (64 * 'a', weights_hash(find_weights(PAPER_MODEL))):
        goal = view_goal_from_msg(fake.wait_goal(stamp))
        stamp = fake.show(latent, goal.azimuth, parts=('quality', *FakeReconstructor.PARTS),
                          quality=quality_of(), weights=weights)
        told = 'expected the reconstructor to have them, got aaaaaaaaaaaa'
        bench.until(lambda: (told in bench.state('view_planner').problem)  # noqa: B023
                    == weights.startswith('aaaa'), 'a warning, and its end')  # noqa: B023


def test_another_object_size_than_the_reconstructor_s_is_told_until_it_is_the_same(
        start_node, bench, latent):
    start_node('view_planner', policy='farthest', start_azimuth=1.0, entropy_tolerance=0.0)
    fake = FakeReconstructor(bench, ('episode', *FakeReconstructor.PARTS, 'quality'))
    fake.begin('only')
    stamp = 0
    for size in (0.25, 1.0):
        goal = view_goal_from_msg(fake.wait_goal(stamp))
        stamp = fake.show(latent, goal.azimuth, parts=('quality', *FakeReconstructor.PARTS),
                          quality=quality_of(), object_size=size)
        told = 'object_size: expected that of the reconstructor, 0.25 m, got 1:'
        bench.until(lambda: (told in bench.state('view_planner').problem)  # noqa: B023
                    == (size == 0.25), 'a warning, and its end')  # noqa: B023


def test_a_sweep_in_the_policy_s_place_is_told_while_views_are_unusual(start_node, bench, latent):
    start_node('view_planner', policy='farthest', start_azimuth=1.0, entropy_tolerance=0.0,
               min_gain=0.01)
    fake = FakeReconstructor(bench, ('episode', *FakeReconstructor.PARTS, 'quality'))
    fake.begin('only')
    stamp = 0
    for suspect, told in (('', 'farthest'), ('pose', 'even sweep instead of farthest: unusual '
                                             'views'), ('', 'farthest')):
        goal = view_goal_from_msg(fake.wait_goal(stamp))
        stamp = fake.show(latent, goal.azimuth, parts=('quality', *FakeReconstructor.PARTS),
                          quality=quality_of(suspect=suspect))
        fake.wait_goal(stamp)
        bench.until(lambda: bench.state('view_planner').facts['Policy'] == told, told)  # noqa: B023
        bench.until(lambda: ('min_gain 0.01 has no effect' in bench.state('view_planner').problem)
                    != bool(suspect), 'that only scores of the policy are no gains')  # noqa: B023


OWN_POLICY = """
from active_recon.policies import POLICIES
from active_recon.policies.geometric import FarthestPolicy
from active_recon.policies.registry import PolicyEntry

class Fails(FarthestPolicy):
    def prepare(self, taken, candidates):
        raise RuntimeError('a fault of its own')

POLICIES['own'] = PolicyEntry(lambda options: Fails())
from active_recon.nodes.view_planner import main
main()
"""


def test_a_policy_that_fails_to_prepare_is_told_and_chooses(start_node, bench, latent, tmp_path):
    (tmp_path / 'own.py').write_text(OWN_POLICY)
    planner = start_node('view_planner', program=[str(tmp_path / 'own.py')], policy='own',
                         start_azimuth=0.0)
    fake = FakeReconstructor(bench)
    fake.begin('only')
    fake.wait_goal(0)
    fake.wait_goal(fake.show(latent, 0.0))
    assert planner.log('refused: policy: prepare fails with RuntimeError: a fault of its own')
