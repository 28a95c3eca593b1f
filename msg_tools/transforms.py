"""Transforms between frames from TransformStamped, as tf2 publishes them in TFMessage."""

from sys import intern

from active_recon.geometry.transform_tree import Transform
from geometry_msgs.msg import TransformStamped
from msg_tools.cameras import numbers_from_msgs
from msg_tools.stamps import nanoseconds_from_stamp


def transform_from_msg(msg: TransformStamped) -> Transform:
    """
    Return a transform; names of frames lose a first '/', as tf2 drops it.

    Raises MessageError if it is not finite, a million kilometres long, or its quaternion is zero.
    """
    parent, child = msg.header.frame_id.lstrip('/'), msg.child_frame_id.lstrip('/')
    position, quaternion = numbers_from_msgs(
        msg.transform.translation, msg.transform.rotation,
        f'transform of the frame {child!r} in {parent!r}')
    return Transform(nanoseconds_from_stamp(msg.header.stamp), intern(parent), intern(child),
                     position, quaternion)
