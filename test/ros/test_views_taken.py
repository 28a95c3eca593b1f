"""Which images the reconstructor takes in when nobody plans, over real DDS."""

from collections import Counter
import math

from active_recon.geometry.cameras import Camera
from active_recon.models.weights_files import PAPER_MODEL
from geometry_msgs.msg import PoseStamped
from msg_tools.cameras import pose_from_msg
from msg_tools.stamps import nanoseconds_from_stamp
import pytest

from .conftest import FakeCamera

pytestmark = pytest.mark.ros
MS = 1_000_000


@pytest.fixture(scope='module')
def reconstructor(start_shared_node):
    return start_shared_node('reconstructor', max_pose_gap=0.1, weights=PAPER_MODEL)


@pytest.fixture(scope='module')
def camera(shared_bench, reconstructor):
    return FakeCamera(shared_bench)


@pytest.fixture
def views(shared_bench, camera):
    views = shared_bench.subscribe(PoseStamped, 'view')
    shared_bench.until(lambda: shared_bench.node.count_publishers('view'), 'a publisher of views')
    assert shared_bench.call('start_episode').success
    return views


def stand(camera, bench, azimuth, **place):
    """Show at once what a camera sees that stands still for 0.2 s; return the stamps."""
    begin = bench.now()
    for later in range(0, 250, 50):
        camera.send(*camera.messages(begin + later * MS, azimuth, **place))
    return range(begin, begin + 250 * MS)


def azimuths(views):
    return [Camera(pose_from_msg(view)).azimuth for view in views]


def test_views_are_taken_where_the_camera_stands_apart_from_the_last(shared_bench, camera, views):
    for count, azimuth in enumerate((0.5, 1.5, 3.0), 1):
        stamps = stand(camera, shared_bench, azimuth)
        shared_bench.until(lambda count=count: len(views) == count, f'view {count}')
        assert nanoseconds_from_stamp(views[-1].header.stamp) in stamps
        shared_bench.until(lambda end=stamps[-1]: shared_bench.now() > end, 'the next stamps')
    assert azimuths(views) == pytest.approx([0.5, 1.5, 3.0])


def test_an_image_from_just_before_the_first_pose_is_unused_and_not_refused(
        shared_bench, camera, views):
    before = Counter(shared_bench.counts('reconstructor'))
    image, info, _ = camera.messages()
    camera.send(image, info)
    stand(camera, shared_bench, 0.5)
    shared_bench.until(lambda: views, 'the view')

    def counted():
        since = Counter(shared_bench.counts('reconstructor')) - before
        return since if since['views'] else None

    since = shared_bench.until(counted, 'the view to be counted')
    assert since['images_unused'] and not since['refused/no_pose']


def test_an_image_between_two_poses_is_seen_from_between_them(shared_bench, camera, views):
    begin = shared_bench.now()
    for later in range(0, 300, 50):
        image, info, _ = camera.messages(begin + later * MS)
        camera.send(image, info)
    for later in range(-25, 300, 50):
        camera.send(pose=camera.messages(begin + later * MS, 2.0 + later / 1e5)[2])
    shared_bench.until(lambda: views, 'a view')
    age = nanoseconds_from_stamp(views[0].header.stamp) - begin
    assert azimuths(views)[0] == pytest.approx(2.0 + age / MS / 1e5, abs=1e-6)


def test_a_view_from_an_unusual_elevation_is_used_and_warned_of(
        shared_bench, reconstructor, camera, views):
    stand(camera, shared_bench, 1.0, elevation=math.radians(50))
    shared_bench.until(lambda: views, 'a view')
    shared_bench.until(
        lambda: shared_bench.counts('reconstructor').get('warned/elevation') == 1, 'the warning')
    line, = reconstructor.log('elevation')
    assert 'wrong elevation of the camera: expected 30 degrees' in line
    assert 'got 50.0' in line
