"""The room behind the object becomes white before the network sees it, over real DDS."""

from active_recon.acquisition.background import off_color, off_reference, on_white
from active_recon.geometry.cameras import CANONICAL_INTRINSICS, orbit_camera
from active_recon.objects import find_object
from active_recon.reconstructor import Reconstructor
from active_recon.segmentation import Segmentation
from active_recon.volumes.meshes import load_mesh
from active_recon.volumes.rendering import composite, Renderer
from active_recon.volumes.voxels import PUBLISHED_FLOOR
from geometry_msgs.msg import PoseStamped
from msg_tools.cameras import camera_to_msgs
from msg_tools.images import image_from_msg, image_to_msg, mask_to_msg
from msg_tools.stamps import nanoseconds_from_stamp, stamp_from_nanoseconds
from msg_tools.voxels import voxel_grid_from_msg
import numpy as np
import pytest
from sensor_msgs.msg import CameraInfo, Image, PointCloud2
from std_msgs.msg import Header

from .conftest import ANY_WEIGHTS, BUDGET_S, LATCHED_QOS, SEND_AGAIN_S
from .test_life_cycle import Supervisor

pytestmark = pytest.mark.ros
CAMERA = orbit_camera(0.5)
SIDE = CANONICAL_INTRINSICS.width
RNG = np.random.default_rng(0)
CLUTTER = np.kron(RNG.integers(0, 256, (SIDE // 8 + 1,) * 2 + (3,), np.uint8),
                  np.ones((8, 8, 1), np.uint8))[:SIDE, :SIDE]
WALL = (20, 60, 160)
EMPTY = np.full((SIDE, SIDE, 3), WALL, np.uint8)
OBJECT = np.zeros((SIDE, SIDE), np.bool_)
OBJECT[40:100, 50:90] = True
SHOWN = np.where(OBJECT[..., None], RNG.integers(150, 256, EMPTY.shape, np.uint8), EMPTY)


class Room:
    """A camera before which an object stands, and what is made of its images."""

    def __init__(self, bench, masked=False):
        self._bench = bench
        kinds = [(PoseStamped, 'pose'), (CameraInfo, 'camera_info'), (Image, 'image_raw')]
        self._publishers = [bench.advertise(kind, f'camera/{topic}') for kind, topic in kinds]
        self._masks = bench.advertise(Image, 'camera/mask') if masked else None
        self.cleared = bench.subscribe(Image, 'view_image', LATCHED_QOS)
        self.probabilities = bench.subscribe(PointCloud2, 'probabilities', LATCHED_QOS)

    def show(self, image, mask=None, camera=CAMERA):
        """Send one image with all that belongs to it; return its stamp."""
        stamp = self._bench.now()
        header = Header(stamp=stamp_from_nanoseconds(stamp), frame_id='camera')
        info, pose = camera_to_msgs(camera, header)
        if mask is not None:
            self._masks.publish(mask_to_msg(mask, header))
        for publisher, msg in zip(self._publishers, (pose, info, image_to_msg(image, header)),
                                  strict=True):
            publisher.publish(msg)
        return stamp

    def until(self, happened, image, mask=None, camera=CAMERA):
        """Show an image, again where it was lost, until something has happened."""
        for _ in range(round(BUDGET_S / SEND_AGAIN_S)):
            self.show(image, mask, camera)
            if found := self._bench.within(SEND_AGAIN_S, happened):
                return found
        raise AssertionError('shown in vain')

    def take(self, image, mask=None):
        """Show an image until a view of it is taken; return how the network saw it."""
        begin = self._bench.now()

        def seen():
            return [msg for msg in self.cleared
                    if nanoseconds_from_stamp(msg.header.stamp) >= begin]

        return image_from_msg(self.until(seen, image, mask)[0])


def refused(bench, kind):
    return lambda: bench.counts('reconstructor').get(f'refused/{kind}')


def start(start_node, **parameters):
    return start_node('reconstructor', take_views='all', **parameters)


def test_what_a_mask_calls_background_becomes_white_and_a_bad_mask_refuses_its_image_alone(
        bench, start_node):
    start(start_node, background='mask')
    room = Room(bench, masked=True)
    for mask, kind in ((None, 'no_mask'), (OBJECT & False, 'no_object'), (OBJECT[1:], 'mask')):
        room.until(refused(bench, kind), SHOWN, mask)
    assert not room.cleared
    expected = on_white(SHOWN, OBJECT)
    np.testing.assert_array_equal(room.take(SHOWN, OBJECT), expected)
    cloud = bench.until(lambda: room.probabilities, 'the probabilities')[0]
    offline = Reconstructor.load().add_view(expected, CAMERA).grid.above(PUBLISHED_FLOOR)
    np.testing.assert_allclose(voxel_grid_from_msg(cloud, 1.0).occupancy, offline.occupancy,
                               atol=1e-5)


def test_an_image_of_the_empty_scene_is_asked_for_kept_over_episodes_and_forgotten_on_cleanup(
        bench, start_node):
    node = start(start_node, background='reference', weights=ANY_WEIGHTS)
    room = Room(bench)
    room.until(refused(bench, 'no_reference'), SHOWN)
    line, = node.log('refused')
    assert 'empty the scene and call capture_background' in line

    stream = bench.node.create_timer(0.1, lambda: room.show(EMPTY))
    answer = bench.call('capture_background')
    bench.node.destroy_timer(stream)
    assert answer.success
    assert answer.message == f'captured {SIDE} x {SIDE} pixels'

    expected = on_white(SHOWN, off_reference(SHOWN, EMPTY))
    np.testing.assert_array_equal(room.take(SHOWN), expected)
    assert bench.call('start_episode').success
    np.testing.assert_array_equal(room.take(SHOWN), expected)
    room.until(refused(bench, 'no_object'), EMPTY)
    other = orbit_camera(0.5, intrinsics=CANONICAL_INTRINSICS.resized(64, 64))
    room.until(refused(bench, 'reference'), EMPTY[:64, :64], camera=other)

    supervisor = Supervisor(bench, 'reconstructor')
    for transition in ('deactivate', 'activate'):
        assert supervisor.set(transition)
    np.testing.assert_array_equal(Room(bench).take(SHOWN), expected)
    for transition in ('deactivate', 'cleanup', 'configure', 'activate'):
        assert supervisor.set(transition)
    bench.until(lambda: not refused(bench, 'no_reference')(), 'counters at 0')
    Room(bench).until(refused(bench, 'no_reference'), SHOWN)


def test_what_the_segmenter_calls_background_becomes_white(bench, start_node):
    node = start(start_node, background='segment')
    room = Room(bench)
    shown = composite(Renderer(load_mesh(find_object('chair'))).render(CAMERA), CLUTTER)
    expected = Segmentation.load(threads=1).on_white(shown, CAMERA)
    np.testing.assert_array_equal(room.take(shown), expected)
    assert (expected[0, 0] == 255).all() and 0.02 < (expected < 200).any(axis=2).mean() < 0.5
    told = bench.until(lambda: bench.state('reconstructor').facts.get('Segmenter'), 'its library')
    assert 'openvino' in told or 'torch' in told
    assert not node.log('in pieces')


def test_what_is_of_the_background_s_color_becomes_white_also_where_it_cuts_the_object(
        bench, start_node):
    node = start(start_node, background='color', background_color=list(WALL))
    room = Room(bench)
    np.testing.assert_array_equal(room.take(SHOWN), on_white(SHOWN, off_color(SHOWN, WALL)))
    assert not node.log('in pieces')
    cut = SHOWN.copy()
    cut[60:80] = WALL
    np.testing.assert_array_equal(room.take(cut), on_white(cut, off_color(cut, WALL)))
    bench.until(lambda: bench.counts('reconstructor').get('warned/background'), 'the warning')
    assert node.log('in pieces')
