"""The view planner alone, over real DDS: what it asks for, and what it refuses."""

import math
import signal

from active_recon.cameras import azimuth_difference, orbit_camera
from active_recon.models.weights import load_weights
from active_recon.voxels import VoxelGrid
from conftest import LATCHED
from geometry_msgs.msg import PoseStamped
from msg_tools.cameras import pose_to_msg
from msg_tools.episodes import Episode, episode_to_msg
from msg_tools.goals import scores_from_msg, view_goal_from_msg
from msg_tools.images import latent_to_msg
from msg_tools.stamps import nanoseconds_from_stamp, stamp_from_nanoseconds
from msg_tools.voxels import FLOOR, voxel_grid_to_msg
import numpy as np
import pytest
from sensor_msgs.msg import Image, JointState, PointCloud2
from std_msgs.msg import Header

pytestmark = pytest.mark.ros
GRID = VoxelGrid(np.random.default_rng(0).random((32, 32, 32), np.float32))


@pytest.fixture(scope='module')
def latent():
    config = load_weights().config
    return np.zeros((config.latent_channels * 4, 4, 4), np.float32)


class FakeReconstructor:
    """A reconstructor in the bench's hand."""

    def __init__(self, bench):
        self.bench = bench
        self.publishers = {topic: bench.advertise(kind, topic, LATCHED) for kind, topic in (
            (Header, 'episode'), (Image, 'latent'), (PoseStamped, 'view'),
            (PointCloud2, 'probabilities'))}
        self.goals = bench.hear(PoseStamped, 'next_view', LATCHED)
        self.done = bench.hear(Header, 'done', LATCHED)

    def begin(self, name, stamp=None):
        begin = self.bench.now() if stamp is None else stamp
        self.publishers['episode'].publish(episode_to_msg(Episode(name, begin)))

    def show(self, latent, azimuth, stamp=None):
        """Publish a view's three parts, of now if no stamp is given; return their stamp."""
        stamp = self.bench.now() if stamp is None else stamp
        header = Header(stamp=stamp_from_nanoseconds(stamp), frame_id='object')
        self.publishers['probabilities'].publish(voxel_grid_to_msg(GRID, FLOOR, header))
        self.publishers['latent'].publish(latent_to_msg(latent, header))
        self.publishers['view'].publish(pose_to_msg(orbit_camera(azimuth).pose, header))
        return stamp

    def wait_goal(self, after):
        """Wait for the goal that was asked for after a time in nanoseconds."""
        return self.bench.until(
            lambda: next((msg for msg in reversed(self.goals)
                          if nanoseconds_from_stamp(msg.header.stamp) > after), None), 'a goal')


def test_the_planner_asks_decides_refuses_and_finishes(start_node, bench, latent):
    planner = start_node('view_planner', max_views=2, entropy_tolerance=0.0, start_azimuth=2.0)
    fake = FakeReconstructor(bench)
    scores = bench.hear(PointCloud2, 'azimuth_scores', LATCHED)
    begin = bench.now()
    fake.begin('first')
    first = fake.wait_goal(begin)
    assert view_goal_from_msg(first) == pytest.approx(2.0)
    azimuths, values = scores_from_msg(bench.until(lambda: scores and scores[-1], 'scores'))
    assert abs(azimuth_difference(azimuths[values.argmax()], 2.0)) <= math.radians(7.5)

    fake.show(latent[:3], 2.0)
    bench.until(lambda: any(key.startswith('refused/') for key in bench.counts('view_planner')),
                'the refusal of a latent of another network')
    line, = planner.log('WARN|ERROR|Traceback')
    assert 'refused: expected a latent of the shape' in line

    taken = fake.show(latent, 2.0)
    second = fake.wait_goal(taken)
    end = fake.show(latent, view_goal_from_msg(second))
    done = bench.until(lambda: fake.done and fake.done[-1].frame_id and fake.done[-1], 'the end')
    assert (done.frame_id, nanoseconds_from_stamp(done.stamp)) == ('max_views', end)
    before = bench.now()
    fake.begin('second')
    fake.wait_goal(before)
    bench.until(lambda: not fake.done[-1].frame_id, 'an end that is taken back')


def test_a_goal_is_repeated_under_its_stamp_until_its_view_comes(start_node, bench, latent):
    start_node('view_planner', policy='farthest', start_azimuth=1.0)
    fake = FakeReconstructor(bench)
    azimuths = bench.hear(JointState, 'next_azimuth')
    fake.begin('only')
    bench.until(lambda: len(azimuths) >= 2, 'the goal again')
    assert len({nanoseconds_from_stamp(msg.header.stamp) for msg in azimuths}) == 1
    taken = fake.show(latent, 1.0)
    assert view_goal_from_msg(fake.wait_goal(taken)) == pytest.approx(1.0 + math.pi, abs=0.14)


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
    assert view_goal_from_msg(fake.wait_goal(after)) == pytest.approx(1.0 + math.pi, abs=0.14)
    assert all(view_goal_from_msg(msg) != pytest.approx(1.0) for msg in fake.goals)
