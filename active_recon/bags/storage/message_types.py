"""Messages out of CDR bytes, by the standard's own definitions alone."""

from functools import cache
from pathlib import Path
from typing import Any

from active_recon.bags.storage.raw import RawMessage
from active_recon.errors import DataError
from rosbags.typesys import get_types_from_msg, get_typestore, Stores
from rosbags.typesys.store import Typestore

HEADER = 'std_msgs/msg/Header'
FLOAT = 'std_msgs/msg/Float64'
IMAGE = 'sensor_msgs/msg/Image'
COMPRESSED_IMAGE = 'sensor_msgs/msg/CompressedImage'
CAMERA_INFO = 'sensor_msgs/msg/CameraInfo'
JOINT_STATE = 'sensor_msgs/msg/JointState'
CLOUD = 'sensor_msgs/msg/PointCloud2'
POSE = 'geometry_msgs/msg/PoseStamped'
DIAGNOSTICS = 'diagnostic_msgs/msg/DiagnosticArray'
READ_TYPES = frozenset((HEADER, FLOAT, IMAGE, COMPRESSED_IMAGE, CAMERA_INFO, JOINT_STATE, CLOUD,
                        POSE, DIAGNOSTICS))
_MOST_PADDING = 12
"""Bytes that may follow: ROS aligns each empty sequence of a JointState for what it lacks."""


@cache
def _standard() -> Typestore:
    return get_typestore(Stores.ROS2_JAZZY)


def read_message(message: RawMessage) -> Any:
    """
    Return a message with the attributes that ROS's own has, its numbers as numpy arrays.

    Raises DataError where the bytes are not one of its type.
    """
    data, store = message.data, _standard()
    try:
        if data[:2] not in (b'\0\0', b'\0\1') or len(data) < 4:
            raise ValueError('another encapsulation than CDR')
        kind = store.get_msgdef(message.type_name)
        read = kind.deserialize_cdr_le if data[1] else kind.deserialize_cdr_be
        content, end = read(data[4:], 0, kind.cls, store)
        if len(data) - 4 - end > _MOST_PADDING:
            raise ValueError(f'{len(data) - 4 - end} bytes left over')
        return content
    except Exception as error:  # the generated code raises whatever the bytes lead it to
        raise DataError(
            f'{message.topic} at {message.received / 1e9:.3f} s: {len(data)} bytes that are no '
            f'{message.type_name} ({error})',
            'message_bytes') from error


@cache
def require_standard(type_name: str, definition: bytes, path: Path) -> None:
    """
    Raise DataError where a definition in a bag is not the standard's.

    Types that are not read here may be defined in any way.
    """
    if type_name not in READ_TYPES:
        return
    try:
        types = get_types_from_msg(definition.decode(), type_name)
        theirs = {name: fields for name, (_, fields) in types.items()}
        ours = {name: _standard().fielddefs[name][1] for name in theirs}
    except Exception as error:  # the parser raises whatever the text leads it to
        raise DataError(f'{path}: its definition of {type_name} cannot be read',
                        'definition') from error
    if theirs != ours:
        raise DataError(f'{path}: {type_name} is defined otherwise than in ROS, by other fields',
                        'definition')
