"""Two loops side by side on one machine, each in a namespace of its own."""

from msg_tools.stamps import nanoseconds_from_stamp
import pytest
from sensor_msgs.msg import Image
from std_msgs.msg import Header

from .conftest import ANY_WEIGHTS, LATCHED_QOS

pytestmark = pytest.mark.ros
NODES = ['turntable_camera', 'reconstructor', 'view_planner']
SHARED = {'/diagnostics', '/rosout', '/parameter_events', '/clock'}  # every ROS node's
VIEWS = 2


def stamp_of(msg):
    return nanoseconds_from_stamp(getattr(msg, 'header', msg).stamp)


class Loop:
    """One of the two, and what is heard of it."""

    def __init__(self, bench, start_node, name, mesh):
        self.name = name
        self._bench = bench
        start_node('reconstructor', namespace=name, weights=ANY_WEIGHTS, take_views='at_goal')
        start_node('turntable_camera', namespace=name, mesh=mesh, rate=20.0, time_scale=20.0)
        start_node('view_planner', namespace=name, policy='farthest', max_views=VIEWS,
                   entropy_tolerance=0.0)
        self.images = bench.subscribe(Image, f'{name}/camera/image_raw')
        self.episodes = bench.subscribe(Header, f'{name}/episode', LATCHED_QOS)
        self.done = bench.subscribe(Header, f'{name}/done', LATCHED_QOS)

    def wait_done(self, episode=None):
        """Wait for the end of the episode of that id, of any if none is given."""
        def ended():
            if not self.episodes or episode not in (None, self.episodes[-1].frame_id):
                return False
            begin = stamp_of(self.episodes[-1])
            return any(end.frame_id == 'max_views' and stamp_of(end) >= begin for end in self.done)
        self._bench.until(ended, f'the end of an episode of {self.name}')


def names_of(bench, namespace, node):
    """Return the topics and services of a node, but for those that every node shares."""
    told = [getattr(bench.node, f'get_{kind}_names_and_types_by_node')(node, f'/{namespace}')
            for kind in ('publisher', 'subscriber', 'service', 'client')]
    return {name for names in told for name, _ in names} - SHARED


def test_two_loops_in_two_namespaces_do_not_touch_each_other(bench, start_node, box):
    one = Loop(bench, start_node, 'one', box)
    two = Loop(bench, start_node, 'two', 'chair')
    one.wait_done()
    two.wait_done()
    for loop, other in ((one, two), (two, one)):
        for node in NODES:
            names = names_of(bench, loop.name, node)
            assert names
            assert all(name.startswith(f'/{loop.name}/') for name in names), names
        assert stamp_of(loop.done[-1]) not in map(stamp_of, other.images)
        bench.until(lambda node=f'{loop.name}/reconstructor': bench.counts(node).get(
            'views') == VIEWS, 'the count of the views')
    before = two.episodes[-1].frame_id
    answer = bench.call('one/start_episode')
    assert answer.success
    one.wait_done(answer.message)
    assert two.episodes[-1].frame_id == before
    assert bench.counts('two/reconstructor')['views'] == VIEWS
    assert len({msg.frame_id for msg in [*one.episodes, *two.episodes]}) == 3
