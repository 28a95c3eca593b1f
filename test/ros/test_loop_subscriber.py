"""What a watcher finds out of a loop, over real DDS: where it is, what it says, what is wrong."""

from active_recon.geometry.cameras import orbit_camera
from active_recon.nodes.loop.followed_loop import Loop, LoopFinder
from active_recon.nodes.loop.loop_subscriber import LoopSubscriber
from active_recon.nodes.runtime.diagnostics import Diagnostics
from active_recon.nodes.viewer import TOPICS
from active_recon.volumes.voxels import VoxelGrid
import cv2
from geometry_msgs.msg import PoseArray, PoseStamped
from msg_tools.cameras import pose_to_msg, poses_to_msg
from msg_tools.images import image_to_msg
from msg_tools.stamps import stamp_from_nanoseconds
from msg_tools.voxels import voxel_grid_to_msg
import numpy as np
import pytest
from rclpy.node import Node
from rclpy.parameter import Parameter
from sensor_msgs.msg import CompressedImage, Image, PointCloud2
from std_msgs.msg import Header

from .conftest import ANY_WEIGHTS, LATCHED_QOS, STREAM_QOS
from .test_recorder import CAMERA, start_remapped

pytestmark = pytest.mark.ros


@pytest.fixture
def hear(bench):
    """Return what hears a loop that is told, in the bench's own node."""
    heard = []

    def make(loop):
        heard.append(LoopSubscriber(bench.node, loop, Diagnostics(bench.node)))
        return heard[-1]

    yield make
    for each in heard:
        each.close()


@pytest.fixture
def found(bench):
    """Return the loops that were found, the last one last; `found.finder` finds them."""
    class Found(list):
        finder = None

        def until(self, condition, what):
            def looked():
                self.finder.update()
                return condition(self)

            bench.until(looked, what)

    loops = Found()
    loops.finder = LoopFinder(bench.node, loops.append)
    return loops


def test_a_node_that_is_listed_and_answers_nothing_keeps_from_no_loop(start_node, bench, found):
    # As one that was killed, and stayed in DDS's lists
    silent = Node('reconstructor', context=bench.node.context, start_parameter_services=False)
    try:
        bench.until(lambda: '/reconstructor' in bench.node.get_fully_qualified_node_names(),
                    'the silent node')
        start_node('view_planner', policy='farthest', namespace='cell_1')
        found.until(lambda loops: loops, 'the loop that answers')
        assert found[-1].namespace == '/cell_1'
    finally:
        silent.destroy_node()


def test_the_size_the_frame_and_the_names_of_a_running_loop_are_found(
        start_node, bench, found):
    start_remapped(start_node, 'reconstructor', (*CAMERA, 'view:=seen'), namespace='cell_1',
                   object_size=0.16, object_frame='table')
    found.until(lambda loops: loops, 'the reconstructor')
    assert (found[-1].object_size, found[-1].object_frame) == (0.16, 'table')
    assert found[-1].namespace == '/cell_1'
    names = {name: found[-1].full_name(name) for name in (*TOPICS, 'save_mesh')}
    assert names['camera/image_raw'] == '/cell_1/usb_cam/image'
    assert names['view'] == '/cell_1/seen'
    assert names['occupancy'] == '/cell_1/occupancy'
    assert names['save_mesh'] == '/cell_1/save_mesh'
    start_node('view_planner', policy='farthest', namespace='cell_2')
    found.until(lambda loops: loops.finder.others, 'a second loop')
    assert found.finder.others == ('/cell_1', '/cell_2')
    assert len({loop.namespace for loop in found}) == 1
    start_node('view_planner', policy='farthest', object_size=0.3)
    found.until(lambda loops: loops[-1].namespace == '/', 'the loop of the own namespace')
    assert found.finder.others == ()
    assert found[-1].object_size == 0.3


def test_a_node_that_has_a_new_publisher_is_asked_again(bench, found):
    # As one that is configured late, or that was killed and is started again
    node = Node('view_planner', context=bench.node.context)
    bench.executor.add_node(node)
    try:
        node.declare_parameter('object_size', 0.16)
        found.until(lambda loops: loops and loops[-1].object_size == 0.16, 'the size')
        node.set_parameters([Parameter('object_size', value=0.3)])
        node.create_publisher(Header, 'done', LATCHED_QOS)
        found.until(lambda loops: loops[-1].object_size == 0.3, 'the size that it has now')
    finally:
        bench.executor.remove_node(node)
        node.destroy_node()


def test_publishers_of_a_remapped_topic_are_counted(bench, hear):
    heard = hear(Loop('/', names={'camera/image_raw': '/usb_cam/image_raw'}))
    assert heard.links()['image'].publishers == 0
    bench.node.create_publisher(Image, 'usb_cam/image_raw', STREAM_QOS)
    bench.until(lambda: heard.links()['image'].publishers == 1, 'the publisher')
    assert heard.links()['image'].topic == '/usb_cam/image_raw'
    bench.node.create_publisher(CompressedImage, 'usb_cam/image_raw/compressed', STREAM_QOS)
    bench.until(lambda: heard.links()['image'].publishers == 2, 'the other form')


def test_a_compressed_camera_is_seen(bench, hear):
    heard = hear(Loop('/'))
    publisher = bench.advertise(CompressedImage, 'camera/image_raw/compressed')
    pixels = np.full((60, 80, 3), (10, 200, 30), np.uint8)
    data = cv2.imencode('.png', cv2.cvtColor(pixels, cv2.COLOR_RGB2BGR))[1].tobytes()

    def seen():
        publisher.publish(CompressedImage(format='png', data=data))
        heard.update()
        return heard.observer.state.picture is not None

    bench.until(seen, 'the picture')
    assert np.array_equal(heard.observer.state.picture, pixels)
    assert heard.links()['image'].age_s is not None


def test_the_grid_has_the_size_that_the_loop_says_and_the_network_image_is_shown(bench, hear):
    heard = hear(Loop('/', object_size=0.16))
    grid = VoxelGrid(np.random.default_rng(0).random((8, 8, 8), np.float32), 0.16)
    image = np.full((64, 64, 3), (1, 2, 3), np.uint8)
    header = Header(stamp=stamp_from_nanoseconds(bench.now()), frame_id='object')
    for kind, topic, msg in (
            (PointCloud2, 'occupancy', voxel_grid_to_msg(grid, 0.5, header)),
            (PointCloud2, 'probabilities', voxel_grid_to_msg(grid, 0.02, header)),
            (Image, 'network_image', image_to_msg(image, header)),
            (PoseArray, 'views', poses_to_msg([orbit_camera(0.1 * n).pose for n in range(6)],
                                              header)),
            (PoseStamped, 'view', pose_to_msg(orbit_camera(0.5).pose, header))):
        bench.node.create_publisher(kind, topic, LATCHED_QOS).publish(msg)

    def taken():
        heard.update()
        state = heard.observer.state
        return state.views and state.network_image is not None and state.missed

    bench.until(taken, 'the view')
    assert heard.observer.state.grid.size == 0.16
    assert heard.observer.state.views[0].entropy == pytest.approx(grid.entropy(), rel=0.05)
    assert heard.observer.state.missed == 5
    assert np.array_equal(heard.observer.state.network_image, image)


def test_what_nodes_warn_of_is_heard_and_forgotten_when_it_is_over(start_node, bench, hear):
    heard = hear(Loop('/'))
    node = start_node('reconstructor', weights=ANY_WEIGHTS)

    def problems():
        heard.update()
        return heard.problems()

    said = bench.until(lambda: problems().get('reconstructor'), 'the warning')
    assert '/camera/' in said and 'none has arrived' in said
    node.stop()
    bench.until(lambda: not problems(), 'its end')


def test_warnings_of_another_loop_are_not_told(start_node, bench, hear):
    heard = hear(Loop('/cell_1'))
    start_node('reconstructor', weights=ANY_WEIGHTS)
    start_node('reconstructor', namespace='cell_1', weights=ANY_WEIGHTS)

    def problems():
        heard.update()
        return heard.problems()

    bench.until(problems, 'the warning')
    assert '/cell_1/camera/' in problems()['reconstructor']


def test_the_reconstructor_tells_what_its_network_saw(start_node, bench, box):
    start_node('turntable_camera', mesh=box, rate=30.0)
    start_node('reconstructor', take_views='all')
    images = bench.subscribe(Image, 'network_image', LATCHED_QOS)
    views = bench.subscribe(PoseStamped, 'view', LATCHED_QOS)
    bench.until(lambda: {str(msg.header.stamp) for msg in images}
                & {str(msg.header.stamp) for msg in views}, 'the image of a view')
    assert images[-1].encoding == 'rgb8'
    assert images[-1].height == images[-1].width > 0


def test_an_image_of_a_time_that_came_again_is_kept(bench, hear):
    heard = hear(Loop('/', object_size=0.16))
    publisher = bench.advertise(Image, 'camera/image_raw')
    grid = VoxelGrid(np.zeros((8, 8, 8), np.float32), 0.16)
    late = bench.now()
    early = late - 90_000_000_000

    def shown(stamp, brightness):
        def sent():
            publisher.publish(image_to_msg(np.full((16, 16, 3), brightness, np.uint8), Header(
                stamp=stamp_from_nanoseconds(stamp))))
            heard.update()
            picture = heard.observer.state.picture
            return picture is not None and (picture == brightness).all()
        bench.until(sent, f'an image of {brightness}')

    for number in range(80):  # more than are kept
        shown(late + number, number)
    shown(early, 200)
    header = Header(stamp=stamp_from_nanoseconds(early), frame_id='object')
    for kind, topic, msg in (
            (PointCloud2, 'occupancy', voxel_grid_to_msg(grid, 0.5, header)),
            (PointCloud2, 'probabilities', voxel_grid_to_msg(grid, 0.02, header)),
            (PoseStamped, 'view', pose_to_msg(orbit_camera(0.5).pose, header))):
        bench.node.create_publisher(kind, topic, LATCHED_QOS).publish(msg)

    def taken():
        heard.update()
        return heard.observer.state.views

    view, = bench.until(taken, 'the view')
    assert (view.image == 200).all()
