"""Parameters that change while a node runs, by the services that `ros2 param` calls."""

import math
import re
import shutil

from active_recon.geometry.cameras import Camera
from active_recon.models.weights_files import find_weights, PAPER_MODEL, SHIPPED
from active_recon.parameters.declaration import NEW_START
from active_recon.volumes.voxels import VoxelGrid
from geometry_msgs.msg import PoseStamped
from judged_quality import quality_of
from msg_tools.cameras import pose_from_msg
from msg_tools.goals import azimuth_goal_to_msg, view_goal_from_msg
from msg_tools.stamps import stamp_from_nanoseconds
from msg_tools.voxels import voxel_grid_to_msg
import numpy as np
import pytest
from rcl_interfaces.srv import (
    DescribeParameters,
    GetParameters,
    SetParameters,
    SetParametersAtomically,
)
from rclpy.parameter import Parameter
from sensor_msgs.msg import JointState, PointCloud2
from std_msgs.msg import Header

from .conftest import ANY_WEIGHTS, FakeCamera, FakeReconstructor, LATCHED_QOS
from .test_planner_node import latent  # noqa: F401

pytestmark = pytest.mark.ros


def messages(values):
    return [Parameter(name, value=value).to_parameter_msg() for name, value in values.items()]


def change(bench, node, **values):
    """Set each parameter by itself; return the results by name."""
    request = SetParameters.Request(parameters=messages(values))
    answer = bench.ask(SetParameters, f'{node}/set_parameters', request)
    return dict(zip(values, answer.results, strict=True))


def change_together(bench, node, **values):
    request = SetParametersAtomically.Request(parameters=messages(values))
    return bench.ask(
        SetParametersAtomically, f'{node}/set_parameters_atomically', request).result


def test_a_threshold_counts_from_the_next_view_and_what_is_refused_changes_nothing(
        start_node, bench):
    start_node('reconstructor', take_views='all', threshold=0.01)
    camera = FakeCamera(bench)
    camera.show()
    cells = camera.occupancy[-1].width
    assert cells > 0
    results = change(bench, 'reconstructor', threshold=1.5, weights='other.safetensors',
                     take_views='some', mesh_format='stl')
    assert {name: each.successful for name, each in results.items()} == {
        'threshold': False, 'weights': False, 'take_views': False, 'mesh_format': True}
    assert ('invalid value: expected a number from 0.01 to 0.99, or nan, got 1.5'
            in results['threshold'].reason)
    assert 'read-only' in results['weights'].reason
    assert 'invalid value: expected one of auto' in results['take_views'].reason
    assert not change_together(
        bench, 'reconstructor', threshold=0.99, max_pose_gap=-1.0).successful
    camera.show()
    assert camera.occupancy[-1].width > cells / 4  # the same image again: about as much is known
    assert change_together(bench, 'reconstructor', threshold=0.99, max_pose_gap=1).successful
    camera.show()
    assert camera.occupancy[-1].width < cells / 4


def test_parameters_that_exclude_each_other_change_together_or_in_their_order(start_node, bench):
    start_node('view_planner', policy='farthest', motion_weight=0.3)
    new = {'motion_cost': 0.01, 'motion_weight': 0.0}
    assert change_together(bench, 'view_planner', **new).successful
    assert change_together(bench, 'view_planner', motion_weight=0.3, motion_cost=0.0).successful
    one_by_one = change(bench, 'view_planner', **new)
    assert not one_by_one['motion_cost'].successful
    assert 'both given' in one_by_one['motion_cost'].reason
    assert one_by_one['motion_weight'].successful
    assert change(bench, 'view_planner', motion_cost=0.01)['motion_cost'].successful


def test_views_are_taken_by_the_rule_that_was_set_last(start_node, bench):
    start_node('reconstructor', weights=ANY_WEIGHTS, take_views='at_goal')
    camera = FakeCamera(bench)

    def is_unused():
        camera.send(*camera.messages())
        return bench.counts('reconstructor').get('images_unused')

    bench.until(is_unused, 'an image that is not used')
    assert not camera.occupancy
    assert change(bench, 'reconstructor', take_views='all')['take_views'].successful
    camera.show()


def in_use(bench):
    """Return the policy that the planner's read-only parameter names."""
    answer, = bench.ask(GetParameters, 'view_planner/get_parameters',
                        GetParameters.Request(names=['policy_in_use'])).values
    return answer.string_value


def test_a_view_on_which_the_policy_failed_is_decided_on_by_the_one_that_is_set_instead(
        start_node, bench, latent):  # noqa: F811
    start_node('view_planner', policy='attention', weights=PAPER_MODEL, start_azimuth=1.0,
               max_views=2)
    fake = FakeReconstructor(bench)
    fake.begin('only')
    taken = fake.show(latent[:3], 1.0)
    bench.until(lambda: bench.state('view_planner').problem, 'the failure')
    assert change(bench, 'view_planner', policy='farthest')['policy'].successful
    goal = view_goal_from_msg(fake.wait_goal(taken))
    assert goal.azimuth == pytest.approx(1.0 + math.pi, abs=0.14)
    bench.until(lambda: not bench.state('view_planner').problem, 'the end of the warning')
    fake.show(latent, goal.azimuth)
    bench.until(lambda: fake.done and fake.done[-1].frame_id == 'max_views', 'the end')


def test_a_policy_that_is_changed_goes_on_from_what_the_episode_has_seen(
        start_node, bench, latent, tmp_path):  # noqa: F811
    shutil.copy(find_weights('2d3d'), tmp_path / 'mine.safetensors')
    shutil.copy(SHIPPED.with_name(f'{SHIPPED.stem}-scorer.safetensors'),
                tmp_path / 'mine-scorer.safetensors')  # of other weights
    planner = start_node('view_planner', policy='auto', max_views=8, start_azimuth=0.0,
                         entropy_tolerance=0.0, weights=tmp_path / 'mine.safetensors')
    bench.until(lambda: 'view policy of other weights' in bench.state('view_planner').problem,
                'the warning that auto is an even sweep')
    assert planner.log('policy uniform')
    assert (in_use(bench), bench.state('view_planner').facts['Policy']) == ('uniform', 'uniform')
    fake = FakeReconstructor(bench)
    fake.begin('only')
    fake.wait_goal(0)
    second = view_goal_from_msg(fake.wait_goal(fake.show(latent, 0.0))).azimuth
    assert second == pytest.approx(math.tau / 8)
    assert change(bench, 'view_planner', policy='farthest')['policy'].successful
    assert in_use(bench) == 'farthest'
    bench.until(lambda: not bench.state('view_planner').problem, 'the end of the warning')
    third = view_goal_from_msg(fake.wait_goal(fake.show(latent, second))).azimuth
    assert third == pytest.approx(math.pi + math.tau / 16, abs=0.14)
    assert change(bench, 'view_planner', max_views=3)['max_views'].successful
    fake.show(latent, third)
    bench.until(lambda: fake.done[-1].frame_id == 'max_views', 'the end after three views')


def test_a_view_that_waits_for_its_quality_is_not_lost_to_a_policy_that_wants_probabilities(
        start_node, bench, latent):  # noqa: F811
    planner = start_node('view_planner', policy='farthest', start_azimuth=0.0)
    fake = FakeReconstructor(bench, ('episode', *FakeReconstructor.PARTS, 'quality'))
    fake.begin('only')
    fake.wait_goal(0)
    stamp = fake.show(latent, 0.0)
    assert not bench.within(1.0, lambda: bench.counts('view_planner').get('views'))
    assert change(bench, 'view_planner', policy='visible_entropy')['policy'].successful
    bench.advertise(PointCloud2, 'probabilities', LATCHED_QOS).publish(voxel_grid_to_msg(
        VoxelGrid(np.full((8, 8, 8), 0.5, np.float32)), 0.02,
        Header(stamp=stamp_from_nanoseconds(stamp), frame_id='object')))
    fake.show(latent, 0.0, stamp, parts=('quality',), quality=quality_of())
    fake.wait_goal(stamp)
    assert not planner.log('refused')


def test_a_policy_whose_weights_are_missing_is_refused_and_the_last_one_stays(
        start_node, bench, latent, tmp_path):  # noqa: F811
    start_node('view_planner', policy='farthest', start_azimuth=0.0,
               weights=tmp_path / 'none.safetensors')
    fake = FakeReconstructor(bench)
    fake.begin('only')
    fake.wait_goal(0)
    request = SetParameters.Request(parameters=messages({'policy': 'attention'}))
    result, = bench.ask(SetParameters, 'view_planner/set_parameters', request).results
    assert not result.successful
    assert 'no such file' in result.reason
    goal = fake.wait_goal(fake.show(latent, 0.0))
    assert view_goal_from_msg(goal).azimuth == pytest.approx(math.pi, abs=0.14)


def test_the_services_describe_what_may_change(start_node, bench):
    start_node('view_planner', policy='farthest')
    names = ['policy', 'max_views', 'entropy_tolerance', 'weights']
    policy, views, tolerance, weights = bench.ask(
        DescribeParameters, 'view_planner/describe_parameters',
        DescribeParameters.Request(names=names)).descriptors
    assert not policy.read_only and 'one of auto, attention' in policy.additional_constraints
    assert views.integer_range[0].to_value == 1000
    assert tolerance.floating_point_range[0].to_value == pytest.approx(0.99)
    assert weights.read_only and NEW_START in weights.additional_constraints


def test_a_turntable_turns_and_streams_as_fast_as_was_set_last(start_node, bench, box):
    start_node('turntable_camera', mesh=box, rate=0.1, speed=0.001)  # no goal is reached so
    poses = bench.subscribe(PoseStamped, 'camera/pose')
    goals = bench.advertise(JointState, 'next_azimuth', LATCHED_QOS)
    result = change_together(bench, 'turntable_camera', rate=50, speed=100)
    assert result.successful, result.reason

    def there():
        goals.publish(azimuth_goal_to_msg(2.0, Header()))
        azimuth = Camera(pose_from_msg(poses[-1])).azimuth if poses else 0.0
        return len(poses) > 10 and abs(azimuth - 2.0) < 0.2

    bench.until(there, 'a stream of poses, and the goal')


def test_a_target_that_the_tables_never_promise_is_warned_of_while_it_is_set(start_node, bench):
    planner = start_node('view_planner', target_quality=0.95, start_azimuth=0.0)
    line, = planner.log('WARN.*target_quality')
    assert re.search(r'target_quality 0.95 is never reached: expected at most 0\.\d, all that the '
                     'tables of the weights promise with the policy attention', line)
    assert change(bench, 'view_planner', target_quality=0.3)['target_quality'].successful
    bench.until(lambda: not bench.state('view_planner').problem, 'no warning')
    results = change(bench, 'view_planner', policy='uniform', target_quality=0.9)
    assert all(each.successful for each in results.values())
    bench.until(lambda: 'with the policy uniform' in bench.state('view_planner').problem,
                'the warning')
