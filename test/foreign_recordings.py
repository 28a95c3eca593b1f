"""Recordings of a turntable by other people: their topics, their types, no loop."""

from io import BytesIO

from active_recon.geometry.cameras import CANONICAL_INTRINSICS, orbit_camera
from active_recon.geometry.rotations import matrix_from_quaternion, quaternion_from_matrix
from loop_bags import BEGIN, header, PERIOD
from msg_tools.cameras import camera_to_msgs
from msg_tools.images import image_to_msg
import numpy as np
import PIL.Image
from recorded_messages import STORE
from sensor_msgs.msg import CompressedImage, JointState

AZIMUTHS = [0.0, 1.5, 3.0]
IMAGES = np.random.default_rng(0).integers(0, 256, (len(AZIMUTHS), 24, 32, 3), np.uint8)
TIMES = [(BEGIN + index * PERIOD, index // 3) for index in range(3 * len(AZIMUTHS))]
"""Of the images, and the number of the azimuth where the camera stands for three of them."""


def images(topic='/cam/color', make=image_to_msg, every=1):
    return [(time, topic, make(IMAGES[number], header(time, 'camera')))
            for time, number in TIMES[::every]]


def png(image, stamp):
    packed = BytesIO()
    PIL.Image.fromarray(image).save(packed, 'PNG')
    return CompressedImage(header=stamp, format='png', data=packed.getvalue())


def joints(topic='/table', names=('turn',), sign=1):
    return [(time, topic, JointState(header=header(time, ''), name=list(names), position=[
        sign * AZIMUTHS[number] if name == 'turn' else 9.0 for name in names]))
        for time, number in TIMES]


def cameras(late=0):
    """Poses and camera info, the poses a little later than the images."""
    lens = CANONICAL_INTRINSICS.resized(32, 24)
    both = [(time, *camera_to_msgs(orbit_camera(AZIMUTHS[number], 0.4, 3.0, lens),
                                   header(time + late, 'camera')))
            for time, number in TIMES]
    for time, info, pose in both:
        info.header = header(time, 'camera')
        yield time, '/info', info
        yield time + late, '/tracker', pose


def transforms(base='object', tool='tool0', camera='camera', late=0, mounted=True):
    """
    A robot's transforms: of the tool in the base, and once of the camera on the tool.

    The camera goes around the base's origin as that of `cameras` does.
    """
    on_tool = np.eye(4)
    on_tool[:3, :3] = matrix_from_quaternion((0.1, -0.2, 0.3, 0.9))
    on_tool[:3, 3] = 0.02, 0.05, -0.1
    if mounted:
        yield BEGIN, '/tf_static', tf_message(on_tool, tool, camera, 0)
    for time, number in TIMES:
        pose = orbit_camera(AZIMUTHS[number], 0.4, 3.0).pose
        yield time + late, '/tf', tf_message(pose @ np.linalg.inv(on_tool), base, tool,
                                             time + late)


def tf_message(pose, parent, child, stamp):
    """The message of one transform, parent from child, (4, 4)."""
    types = STORE.types
    x, y, z, w = quaternion_from_matrix(pose[:3, :3])
    seconds, rest = divmod(stamp, 10**9)
    return types['tf2_msgs/msg/TFMessage']([types['geometry_msgs/msg/TransformStamped'](
        types['std_msgs/msg/Header'](types['builtin_interfaces/msg/Time'](seconds, rest), parent),
        child, types['geometry_msgs/msg/Transform'](
            types['geometry_msgs/msg/Vector3'](*pose[:3, 3].tolist()),
            types['geometry_msgs/msg/Quaternion'](x, y, z, w)))])
