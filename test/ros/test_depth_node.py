"""Depth beside the images goes into the reconstruction, and bad depth into the counters, live."""

from active_recon.geometry.cameras import CANONICAL_INTRINSICS, orbit_camera
from active_recon.reconstructor import Reconstructor
from active_recon.volumes.depth_images import DepthImage
from active_recon.volumes.voxels import PUBLISHED_FLOOR
from geometry_msgs.msg import PoseStamped
from msg_tools.cameras import camera_to_msgs
from msg_tools.compressed_depth import depth_to_compressed_msg
from msg_tools.images import depth_to_msg, image_to_msg
from msg_tools.stamps import stamp_from_nanoseconds
from msg_tools.voxels import voxel_grid_from_msg
import numpy as np
import pytest
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, PointCloud2
from std_msgs.msg import Header

from .conftest import BUDGET_S, LATCHED_QOS, SEND_AGAIN_S

pytestmark = pytest.mark.ros
CAMERA = orbit_camera(0.5)
SIDE = CANONICAL_INTRINSICS.width
SHOWN = np.full((SIDE, SIDE, 3), 255, np.uint8)
SHOWN[40:100, 50:90] = 90
METRES = np.zeros((SIDE, SIDE), np.float32)
METRES[40:100, 50:90] = 1.9
DELAY_NS = 5_000_000  # of the depth camera


def test_depth_in_either_form_goes_into_its_view_and_bad_depth_leaves_the_view(bench, start_node):
    start_node('reconstructor', take_views='all', use_depth=True)
    kinds = {'depth/image_raw': Image, 'depth/image_raw/compressedDepth': CompressedImage,
             'pose': PoseStamped, 'camera_info': CameraInfo, 'image_raw': Image}
    publishers = [bench.advertise(kind, f'camera/{topic}') for topic, kind in kinds.items()]
    probabilities = bench.subscribe(PointCloud2, 'probabilities', LATCHED_QOS)

    def until(happened, depth_to, metres):
        for _ in range(round(BUDGET_S / SEND_AGAIN_S)):
            stamp = bench.now()
            header = Header(stamp=stamp_from_nanoseconds(stamp), frame_id='camera')
            info, pose = camera_to_msgs(CAMERA, header)
            later = Header(stamp=stamp_from_nanoseconds(stamp + DELAY_NS), frame_id='camera')
            depth = depth_to(metres, later)
            publishers[isinstance(depth, CompressedImage)].publish(depth)
            for publisher, msg in zip(publishers[2:], (
                    pose, info, image_to_msg(SHOWN, header)), strict=True):
                publisher.publish(msg)
            if found := bench.within(SEND_AGAIN_S, happened):
                return found
        raise AssertionError('shown in vain')

    cloud = until(lambda: probabilities, depth_to_compressed_msg, METRES)[0]
    core = Reconstructor.load(threads=1)
    known = core.add_view(SHOWN, CAMERA, DepthImage(METRES))
    assert not known.depth_refusal
    np.testing.assert_allclose(voxel_grid_from_msg(cloud, 1.0).occupancy,
                               known.grid.above(PUBLISHED_FLOOR).occupancy, atol=1e-4)
    views = bench.counts('reconstructor').get('views', 0)
    until(lambda: bench.counts('reconstructor').get('warned/depth'), depth_to_msg,
          METRES[:50])
    bench.until(lambda: bench.counts('reconstructor').get('views', 0) > views, 'the view')
    until(lambda: bench.counts('reconstructor').get('refused/no_stamp'),
          lambda metres, _: depth_to_msg(metres, Header(frame_id='camera')), METRES)
