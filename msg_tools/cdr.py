"""A camera's messages as the bytes that go over the wire, made with no node running."""

from active_recon.cameras import Camera
from msg_tools.cameras import camera_to_msgs
from msg_tools.images import image_to_msg
from msg_tools.stamps import stamp_from_nanoseconds
import numpy as np
from numpy.typing import NDArray
from rclpy.serialization import serialize_message
from std_msgs.msg import Header


def camera_to_cdr(image: NDArray[np.uint8], camera: Camera, stamp: int, frame: str
                  ) -> tuple[bytes, bytes, bytes]:
    """
    Return the Image, CameraInfo and PoseStamped of one view as CDR bytes.

    The image is RGB, (H, W, 3) uint8; `stamp` in nanoseconds; `frame` is the camera's own.
    """
    header = Header(stamp=stamp_from_nanoseconds(stamp), frame_id=frame)
    msgs = image_to_msg(image, header), *camera_to_msgs(camera, header)
    first, second, third = (bytes(serialize_message(msg)) for msg in msgs)
    return first, second, third
