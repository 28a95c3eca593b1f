"""The loop of turntable, reconstructor and planner, over real DDS."""

from functools import partial
import signal

from active_recon.datasets.layout import ObjectFolder, write_object
from active_recon.geometry.cameras import azimuth_difference, AZIMUTHS, orbit_camera
from active_recon.volumes.rendering import Renderer
from active_recon.volumes.voxels import VoxelGrid
from geometry_msgs.msg import PoseArray, PoseStamped
from msg_tools.cameras import pose_from_msg
from msg_tools.goals import azimuth_goal_from_msg, view_goal_from_msg
from msg_tools.stamps import nanoseconds_from_stamp
from msg_tools.voxels import voxel_grid_from_msg
import numpy as np
import pytest
from rcl_interfaces.srv import GetParameters
import rosless
from sensor_msgs.msg import Image, JointState, PointCloud2
from std_msgs.msg import Header
import trimesh

from .conftest import LATCHED_QOS

pytestmark = pytest.mark.ros
VIEWS = 3


@pytest.fixture(scope='module')
def dataset(tmp_path_factory):
    root = tmp_path_factory.mktemp('dataset')
    for name, extents in (('flat', (1, 0.8, 0.2)), ('tall', (0.3, 0.3, 1))):
        renderer = Renderer(trimesh.creation.box(extents))
        cameras = [orbit_camera(azimuth) for azimuth in AZIMUTHS]
        write_object(ObjectFolder(root, 'box', name), [renderer.render(one) for one in cameras],
                     cameras, VoxelGrid(np.zeros((32, 32, 32), np.float32)))
    return root


@pytest.fixture(scope='module')
def start_reconstructor(start_shared_node, tmp_path_factory):
    return partial(start_shared_node, 'reconstructor', take_views='at_goal',
                   output_dir=tmp_path_factory.mktemp('meshes'))


@pytest.fixture(scope='module')
def start_planner(start_shared_node):
    return partial(start_shared_node, 'view_planner', policy='uniform', max_views=VIEWS,
                   entropy_tolerance=0.0)


@pytest.fixture(scope='module')
def loop(start_shared_node, start_reconstructor, start_planner, dataset):
    """Return the three nodes by name."""
    return {'turntable_camera': start_shared_node('turntable_camera', dataset=dataset, rate=30.0,
                                                  time_scale=20.0),
            'reconstructor': start_reconstructor(), 'view_planner': start_planner()}


def stamp_of(msg):
    return nanoseconds_from_stamp(getattr(msg, 'header', msg).stamp)


class Watch:
    """What is heard of the loop."""

    def __init__(self, bench):
        self.bench = bench
        self.episodes = bench.subscribe(Header, 'episode', LATCHED_QOS)
        self.done = bench.subscribe(Header, 'done', LATCHED_QOS)
        self.views = bench.subscribe(PoseStamped, 'view')
        self.occupancy = bench.subscribe(PointCloud2, 'occupancy')
        self.goals = bench.subscribe(JointState, 'next_azimuth')

    def episode(self):
        return self.bench.until(lambda: self.episodes and self.episodes[-1], 'an episode')

    def wait_done(self):
        """Wait until the current episode is done; return its end."""
        def end():
            begin = stamp_of(self.episode())
            ends = [msg for msg in self.done if msg.frame_id and stamp_of(msg) > begin]
            return ends and ends[-1]
        return self.bench.until(end, 'the end of the episode')


@pytest.fixture
def watch(bench, loop):
    watch = Watch(bench)
    for topic in ('episode', 'done', 'view', 'occupancy', 'next_azimuth'):
        bench.until(lambda topic=topic: bench.node.count_publishers(topic), f'{topic}')
    watch.wait_done()
    return watch


def new_episode(watch):
    """Begin an episode and wait for its end; return its id and its end."""
    answer = watch.bench.call('start_episode')
    assert answer.success
    watch.bench.until(lambda: watch.episode().frame_id == answer.message, 'the new episode')
    return answer.message, watch.wait_done()


def test_an_episode_ends_after_max_views_each_near_its_goal(bench, watch):
    name, end = new_episode(watch)
    begin = stamp_of(watch.episode())
    assert end.frame_id == 'max_views'
    for heard in (watch.views, watch.occupancy):  # the end may overtake what it is the end of
        bench.until(lambda heard=heard: stamp_of(end) in map(stamp_of, heard), 'the last view')
    views = [msg for msg in watch.views if stamp_of(msg) > begin]
    assert len(views) == VIEWS
    assert stamp_of(end) == stamp_of(views[-1])
    goals = {stamp_of(msg): azimuth_goal_from_msg(msg)
             for msg in watch.goals if stamp_of(msg) > begin}
    assert len(goals) == VIEWS
    for (_, goal), view in zip(sorted(goals.items()), views, strict=True):
        assert abs(azimuth_difference(view_goal_from_msg(view).azimuth, goal)) <= 0.14
    clouds = {stamp_of(msg): msg for msg in watch.occupancy}
    assert all(stamp_of(view) in clouds for view in views)
    voxel_grid_from_msg(clouds[stamp_of(views[-1])])


def test_someone_without_ros_receives_occupancy_and_next_azimuth(bench, watch, ros_domain):
    with (rosless.subscribe('/occupancy', ros_domain, reliability='reliable') as occupancy,
          rosless.subscribe('/next_azimuth', ros_domain, reliability='reliable') as goals):
        new_episode(watch)
        cloud, goal = occupancy.read(10.0), goals.read(10.0)
    assert [field.name for field in cloud.fields] == ['x', 'y', 'z', 'occupancy']
    assert len(cloud.data) == cloud.width * 16
    assert 0 <= goal.position[0] < 2 * np.pi


def test_who_comes_late_finds_what_is_latched(bench, watch):
    end = watch.wait_done()
    heard = {topic: bench.subscribe(kind, topic, LATCHED_QOS) for kind, topic in (
        (Header, 'episode'), (PoseStamped, 'next_view'), (Header, 'done'),
        (PointCloud2, 'occupancy'), (PointCloud2, 'probabilities'))}
    bench.until(lambda: all(heard.values()), 'all latched topics')
    assert heard['episode'][-1] == watch.episode()
    assert heard['done'][-1] == end
    assert stamp_of(heard['occupancy'][-1]) == stamp_of(heard['probabilities'][-1])
    assert stamp_of(heard['occupancy'][-1]) == stamp_of(end)


def test_next_object_begins_an_episode_and_shows_another_object(bench, watch):
    images = bench.subscribe(Image, 'camera/image_raw')
    before = bench.until(lambda: images and images[-1], 'an image')
    episode = watch.episode().frame_id
    answer = bench.call('next_object')
    assert answer.success
    assert answer.message == 'box/tall (2 of 2)'
    shown, = bench.ask(GetParameters, 'turntable_camera/get_parameters',
                       GetParameters.Request(names=['object'])).values
    assert shown.string_value == 'box/tall'  # which a recording that begins now has
    bench.until(lambda: watch.episode().frame_id != episode, 'a new episode')
    begin = stamp_of(watch.episode())
    after = bench.until(lambda: next((msg for msg in images if stamp_of(msg) > begin), None),
                        'an image of the new episode')
    assert after.data != before.data
    assert watch.wait_done().frame_id == 'max_views'


def test_a_plan_is_a_new_goal(bench, watch):
    new_episode(watch)
    views, goals = len(watch.views), {stamp_of(msg) for msg in watch.goals}
    answer = bench.call('plan')
    assert answer.success
    goal = bench.until(lambda: next((msg for msg in watch.goals if stamp_of(msg) not in goals),
                                    None), 'a new goal')
    assert azimuth_goal_from_msg(goal) == pytest.approx(float(answer.message), abs=1e-5)
    bench.until(lambda: len(watch.views) > views, 'its view')
    watch.wait_done()


def test_all_views_of_an_episode_are_told_together(bench, watch):
    _, end = new_episode(watch)
    told = bench.subscribe(PoseArray, 'views', LATCHED_QOS)
    bench.until(lambda: told and stamp_of(told[-1]) == stamp_of(end), 'the views')
    bench.until(lambda: stamp_of(end) in map(stamp_of, watch.views), 'the last view')
    assert told[-1].poses == [msg.pose for msg in watch.views[-VIEWS:]]


def test_a_planner_that_comes_back_after_the_end_says_so_and_asks_for_nothing(
        bench, watch, loop, start_planner):
    begin, taken = stamp_of(watch.episode()), len(watch.views)
    loop['view_planner'].stop(signal.SIGKILL)
    bench.within(0.3, lambda: False)  # a goal of before may be on its way
    goals, ends = len(watch.goals), len(watch.done)
    loop['view_planner'] = start_planner()
    bench.until(lambda: any(msg.frame_id for msg in watch.done[ends:]), 'the end, told again')
    assert watch.done[-1].frame_id == 'max_views'
    assert stamp_of(watch.episode()) == begin
    assert not bench.within(1.0, lambda: watch.goals[goals:] or watch.views[taken:])


def test_a_reconstructor_that_comes_back_begins_a_new_episode(
        bench, watch, loop, start_reconstructor):
    before = watch.episode()
    assert loop['reconstructor'].stop(signal.SIGTERM) == 0
    loop['reconstructor'] = start_reconstructor()
    bench.until(lambda: watch.episode().frame_id != before.frame_id, 'a new episode')
    assert stamp_of(watch.episode()) > stamp_of(before)
    assert watch.wait_done().frame_id == 'max_views'


def test_every_pose_is_of_a_camera_that_looks_at_the_object(bench, watch):
    poses = bench.subscribe(PoseStamped, 'camera/pose')
    pose = pose_from_msg(bench.until(lambda: poses and poses[-1], 'a pose'))
    forward = pose[:3, 2]
    np.testing.assert_allclose(-pose[:3, 3] / np.linalg.norm(pose[:3, 3]), forward, atol=1e-6)


@pytest.mark.parametrize('how', [
    signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.slow)])
@pytest.mark.parametrize('name', ['turntable_camera', 'reconstructor', 'view_planner'])
def test_a_node_that_is_asked_to_stop_ends_without_complaint(start_node, box, name, how):
    parameters = {'turntable_camera': {'mesh': box}, 'view_planner': {'policy': 'farthest'}}
    node = start_node(name, **parameters.get(name, {}))
    assert node.stop(how) == 0
    assert not node.log('Traceback|ERROR|FATAL')
