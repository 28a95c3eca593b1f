"""Recordings of a turntable by other people: their topics, their types, no loop."""

from io import BytesIO

from active_recon.geometry.cameras import CANONICAL_INTRINSICS, orbit_camera
from loop_bags import BEGIN, header, PERIOD
from msg_tools.cameras import camera_to_msgs
from msg_tools.images import image_to_msg
import numpy as np
import PIL.Image
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
